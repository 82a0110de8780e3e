"""Names of settings that spell no policy: the policies that may have been meant, which are then unknown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.language.policy import BROKER, ENDPOINT, NEED, TOPIC, Policy
from cqos_core.language.values import normalise
from cqos_core.model.problems import InvalidValueError
from cqos_core.model.settings import EVERY_OTHER, Setting
from cqos_core.model.system import SUBSCRIBER
from cqos_core.resolving.layers import Stated

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cqos_core.packs.pack import RulePack
    from cqos_core.packs.presets import Dialect

_TYPING_ERRORS: Final = 2


def can_be_stated(policy: Policy) -> bool:
    """Return whether a system may state a policy; needs of publishers are derived."""
    return policy.level != NEED or SUBSCRIBER in policy.roles


def may_be_meant(pack: RulePack, levels: tuple[str, ...], *, grouped: bool) -> list[str]:
    """Return the names that may be stated; with those of groups in every spelling, where one of these is meant."""
    may_be = [policy for policy in pack.policies if policy.level in levels and may_be_stated(policy)]
    aliases = (alias for policy in may_be for alias in policy.aliases if "." in alias) if grouped else ()
    return [*(policy.name.removeprefix("need.") for policy in may_be), *aliases]


def near_policies(pack: RulePack, levels: tuple[str, ...], name: str) -> set[int]:
    """Return the policies within two typing errors of an unknown name."""
    from cqos_core.model.spelling import distance, folded

    written = folded(name)
    return {
        index
        for level in levels
        for spelling, index in pack.spellings[level].items()
        if distance(written, folded(spelling), _TYPING_ERRORS) <= _TYPING_ERRORS and may_be_stated(pack.policies[index])
    }


def may_be_stated(policy: Policy) -> bool:
    """Whether a system may state a policy, and it does not follow from others."""
    return can_be_stated(policy) and not policy.derived


def may_be_any(pack: RulePack, levels: tuple[str, ...], name: str, dialect: Dialect | None) -> bool:
    """Whether a setting that is not known may set any policy: it has no name, or one that the pack does not have."""
    return name == EVERY_OTHER or all(pack.find(level, name, dialect) is None for level in levels)


def every_policy(pack: RulePack, levels: tuple[str, ...], setting: Setting, code: str = "") -> dict[int, Stated]:
    """Return an unknown setting for every policy of ``levels``; ``code`` is that of the finding with the cause."""
    return {
        index: Stated("", setting, code=code)
        for index, policy in enumerate(pack.policies)
        if policy.level in levels and may_be_stated(policy)
    }


def meant_by(name: str, known: Sequence[str]) -> str:
    """Return advice with the name that was probably meant, and the known names."""
    from cqos_core.model.spelling import nearest, same_start
    from cqos_core.model.suggestions import suggestion

    if nearest(name, known):
        return suggestion(name, known)
    near = same_start(name, known)
    return f"did you mean `{near}`? {suggestion(name, known)}" if near else f"remove it; {suggestion(name, known)}"


def is_slip(pack: RulePack, name: str, text: str) -> bool:
    """Return whether a setting is a common mistake, so that `elsewhere` depends on the settings beside it."""
    from cqos_core.resolving.common_mistakes import meant_instead

    return bool(meant_instead(pack, f"{name}: {text}"))


def elsewhere(
    pack: RulePack, levels: tuple[str, ...], name: str, setting: Setting, beside: Mapping[str, Setting]
) -> str:
    """Say where a setting belongs that stands in a wrong place; empty where its name is known nowhere.

    A map of settings may stand under a name that means nothing: ``qos: {reliability: reliable}``. ``beside`` are all settings of
    the same map.
    """
    from cqos_core.resolving.common_mistakes import meant_instead, settings_of_call

    if slip := meant_instead(pack, f"{name}: {setting.text}"):
        meant, _, text = slip.partition(": ")
        stated = next((each for each in beside if normalise(each) == normalise(meant) and each != name), None)
        if stated is None:
            return f"did you mean `{slip}`?"
        written = f"`{stated}: {beside[stated].text}`"
        same = normalise(beside[stated].text) == normalise(text)
        return f"remove it: {written} stands beside it" + (
            "" if same else f"; if `{slip}` is meant, write that instead"
        )
    if settings := settings_of_call(pack, setting.text):
        return f"write `{settings[1:-1]}` in place of `{name}`"
    names_preset = "qos" in normalise(name) and normalise(setting.text) in pack.preset_names
    if normalise(name) in _TAKING or names_preset:
        return f"write `profile: {setting.text}`, which takes the values of that profile first"
    inside = [f"`{key}`" for key in _keys(setting.text) if any(pack.find(level, key) is not None for level in levels)]
    if inside:
        return f"write {' and '.join(inside)} without `{name}` around {'it' if len(inside) == 1 else 'them'}"
    text = setting.text or "VALUE"
    places = [
        where.format(name=name, text=text, pack=pack.id)
        for level, where in _PLACES.items()
        if level not in levels and (index := pack.find(level, name)) is not None and may_be_stated(pack.policies[index])
    ]
    return f"write it {' or '.join(places)}" if places else ""


_TAKING: Final = frozenset(("base", "extends", "inherits", "inherit", "parent", "preset", "qos_profile"))
"""Words of other formats for the profile from which values are taken."""
_PLACES: Final = {
    ENDPOINT: "at each endpoint, `TOPIC: {{{name}: {text}}}`, or in a profile that endpoints use",
    NEED: "under `needs` of a subscriber: `needs: {{{name}: {text}}}`",
    "participant": "at the participant, beside `publishes` and `subscribes`: `{name}: {text}`",
    "option": "at the participant, beside `publishes` and `subscribes`: `{name}: {text}`; or for all under `options`: "
    "`options: {{{pack}: {{{name}: {text}}}}}`",
    TOPIC: "under `topics`: `topics: {{TOPIC: {{{name}: {text}}}}}`",
    BROKER: "at the broker: `brokers: {{NAME: {{{name}: {text}}}}}`",
}


def _keys(text: str) -> tuple[str, ...]:
    """Return the keys of a map in flow form."""
    from cqos_core.language.domains import flow

    try:
        found = flow(text) if text.lstrip().startswith("{") else {}
    except InvalidValueError:
        return ()
    return tuple(found) if isinstance(found, dict) else ()


def misquoted(pack: RulePack, policy: Policy, text: str) -> str:
    """Say what may be wrong with a text as a whole that is no value of a policy: its quotes, or that it is a map."""
    if text[:1] in _TYPOGRAPHIC:
        return "typographic quotes are part of a value"
    if text[:1] in _DASHES:
        return f"`{text[:1]}` is no minus sign"
    inside = [f"`{key}`" for key in _keys(text) if pack.find(policy.level, key) is not None]
    return (
        f"{' and '.join(inside)} in it {'is a setting' if len(inside) == 1 else 'are settings'} beside it"
        if inside
        else ""
    )


_DASHES: Final = tuple("\u2010\u2011\u2012\u2013\u2014\u2212")
_TYPOGRAPHIC: Final = tuple("\u2018\u2019\u201a\u201c\u201d\u201e\u00ab\u00bb")


def with_unclear(
    found: dict[int, Stated],
    misread: Mapping[str, tuple[Setting, set[int]]],
    pack: RulePack,
    levels: tuple[str, ...],
) -> dict[int, Stated]:
    """Return the settings with unknown values for the policies that misspelt names may mean."""
    for name, (setting, meant) in misread.items():
        every = every_policy(pack, levels, Setting("", setting.place, f"`{name}` is not understood"), "CQ202")
        found = {**found, **{i: every[i] for i in meant}} if meant else {**every, **found}
    return found
