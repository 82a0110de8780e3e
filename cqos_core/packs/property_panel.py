"""The property panel of a pack's settings: headings, labels and the meaning of each value. All of it is optional."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.language.policy import ENDPOINT, parts_of
from cqos_core.language.values import Anything, FromPeers, normalise
from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping

    from cqos_core.language.policy import Meaning, Policy
    from cqos_core.packs.presets import Dialect

HEADINGS: Final = {
    ENDPOINT: "Quality of service",
    "topic": "Topic",
    "participant": "Participant",
    "broker": "Broker",
    "option": "Deployment",
    "need": "Requirements",
}
"""By level, the heading of settings for which the pack has none."""
_TRUTH: Final = {"true": "Yes", "false": "No"}


@dataclass(frozen=True, slots=True)
class Panel:
    """Headings, labels and explanations of a pack's settings.

    A name stands for the policies of this name at every level.

    Attributes:
        groups: heading to the names of its policies, in the order of display.
        advanced: names of policies that are shown on demand only.
        labels: policy name to its name for people.
        values: policy name to what its values and words mean, one sentence each.
        value_labels: policy name to names for people of its values and words.
        roles: policy name to the endpoints at which it has an effect, where others have it too.
    """

    groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    advanced: tuple[str, ...] = ()
    labels: Mapping[str, str] = field(default_factory=dict)
    values: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    value_labels: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    roles: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


def describe_panel(panel: Panel, policy: Policy) -> dict[str, Any]:
    """Return a policy's entry in the property panel, for machines."""
    name = policy.name
    group = next((heading for heading, names in panel.groups.items() if name in names), HEADINGS[policy.level])
    docs, labels = panel.values.get(name, {}), panel.value_labels.get(name, {})
    return {
        "label": panel.labels.get(name) or _in_words(name.removeprefix("need.").replace(".", " ")),
        "group": group,
        "advanced": name in panel.advanced,
        "value_docs": [
            {"value": value, "label": labels.get(value) or _called(policy, value), "doc": docs.get(value, "")}
            for value in values_of(policy)
        ],
    }


def headings(panel: Panel, policies: Iterable[Policy]) -> list[str]:
    """Return the headings of all settings, in the order of display."""
    used = {describe_panel(panel, policy)["group"] for policy in policies}
    return [each for each in dict.fromkeys((*panel.groups, *HEADINGS.values())) if each in used]


def values_of(policy: Policy) -> tuple[str, ...]:
    """Return the values of a policy that can be listed, and its words."""
    return tuple(dict.fromkeys((*map(policy.domain.format, policy.domain.candidates()), *policy.words)))


def _called(policy: Policy, value: str) -> str:
    return _TRUTH[value] if policy.domain.kind == "flag" and value in _TRUTH else _in_words(value)


def _in_words(name: str) -> str:
    words = " ".join(name.replace("_", " ").split())
    return words[:1].upper() + words[1:]


class SettingSpelling(NamedTuple):
    """The spelling of a setting in one kind of file.

    Attributes:
        name: the attribute to write.
        words: those of the policy that have a place there.
        spellings: all names by which a file may state it, normalised.
        roles: the endpoints at which it has an effect.
    """

    policy: Policy
    name: str
    words: tuple[str, ...]
    spellings: tuple[str, ...]
    roles: tuple[str, ...]


def panel_settings(
    panel: Panel, policies: Iterable[Policy], dialect: Dialect, level: str, taken: Collection[str] = ()
) -> Iterator[SettingSpelling]:
    """Yield the settings of a level that a person can state, but those whose names are ``taken`` by something else."""
    for policy in policies:
        name = dialect.writes.get(policy.name, _plain_name(policy))
        if policy.level != level or policy.derived or not name or name in taken:
            continue
        others = (spelt for spelt, meant in dialect.names.items() if normalise(meant) in policy.spellings)
        words = dialect.words if dialect.words is not None else _of_people(policy.words)
        spellings = tuple(sorted({*policy.spellings, *others}))
        roles = panel.roles.get(policy.name, policy.roles)
        yield SettingSpelling(policy, name, tuple(each for each in policy.words if each in words), spellings, roles)


def _plain_name(policy: Policy) -> str:
    """The name, or one without dots where it has some."""
    return next((each for each in (policy.name, *policy.aliases) if "." not in each), policy.name)


def _of_people(words: Mapping[str, Meaning]) -> Iterable[str]:
    """Return the words that a person would write, without those that tools write for unknown and bridges for copied values."""
    return [word for word, meaning in words.items() if not any(map(_is_of_tools, parts_of(meaning)))]


def _is_of_tools(meaning: Meaning) -> bool:
    return isinstance(meaning, Anything) or (isinstance(meaning, FromPeers) and meaning.waits)
