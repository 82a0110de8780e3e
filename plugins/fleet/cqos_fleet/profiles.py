"""Distinct settings become profiles, each resolved once, by the pack."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.matching.judge import ask, judge_endpoint
from cqos_core.model.grouping import grouped
from cqos_core.model.problems import CqosError
from cqos_core.model.settings import Setting
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Endpoint, Participant, ProfileRef, System
from cqos_core.resolving.resolver import Resolver
from cqos_fleet.engines import DOT
from cqos_fleet.value_numbers import Numbered

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.resolved_endpoint import Resolved, ResolvedSystem

SEVERITIES: Final = ("error", "warning", "note")
NO_SETTINGS: Final = ("id", "system", "version", "role", "protocol", "participant", "topic", "type", "profile")
"""Columns that are no settings."""


class Remark(NamedTuple):
    """What a rule, or reading the settings, says of a profile by itself."""

    code: str
    severity: str
    message: str


class KnownProfile(NamedTuple):
    """A profile: a representative endpoint of it, findings about it alone, and the texts that gave it."""

    resolved: Resolved
    version: str
    remarks: tuple[Remark, ...]
    texts: Mapping[str, str]


def setting_name(column: str) -> str:
    """Return the name of the setting that a column has; within an audit, a dot stands before it, so that it is like no other column."""
    return column.removeprefix(DOT).replace(DOT, ".")


def pack_knows(pack: RulePack, column: str) -> bool:
    """Whether a column is a setting of a pack."""
    name = setting_name(column)
    return any(pack.find(level, name) is not None for level in ("endpoint", "participant", "option"))


def settings_of(pack: RulePack, row: Mapping[str, str], *, owned: bool) -> dict[str, str]:
    """Return the settings that a row has of an endpoint, or of its participant."""
    stated = {setting_name(name): text for name, text in row.items() if text and name not in NO_SETTINGS}
    return {name: text for name, text in stated.items() if (pack.find("endpoint", name) is None) is owned}


def endpoint_of(pack: RulePack, row: Mapping[str, str], identifier: str, topic: str, participant: str) -> Endpoint:
    """Return the endpoint of a row."""
    return Endpoint(
        id=identifier,
        role=PUBLISHER if row["role"] == PUBLISHER else SUBSCRIBER,
        topic=topic,
        participant=participant,
        settings={name: Setting(text) for name, text in settings_of(pack, row, owned=False).items()},
        profiles=(ProfileRef(row["profile"]),) if row.get("profile") else (),
        type=row.get("type") or None,
        protocol=pack.id,
    )


def stated_twice(system: str, participant: str, setting: str, one: str, other: str) -> CqosError:
    """Return the error that rows of one participant differ in a setting."""
    where = f" of system `{system}`" if system else ""
    return CqosError(f"participant `{participant}`{where} has {setting} `{one}` in one row and `{other}` in another")


def remarked(result: ResolvedSystem, *owners: str) -> Iterator[tuple[Resolved, list[Remark]]]:
    """Yield endpoints with what reading settings reported of them, of ``owners``, or of the system about what they leave unread."""
    said: dict[str, list[Remark]] = {}
    of_system: dict[str, Remark] = {}
    for finding in result.findings:
        remark = of_system[finding.code] = Remark(finding.code, finding.severity.value, finding.message)
        for member in {member for side in finding.sides for member in side.members}:
            said.setdefault(member, []).append(remark)
    for each in result.endpoints:
        own = [remark for name in (each.id, *owners) for remark in said.get(name, ())]
        codes = {remark.code for remark in own}
        unread = [of_system[code] for code in each.profile.unread if code in of_system and code not in codes]
        yield each, [*own, *unread]


class FleetProfiles:
    """The distinct profiles of one protocol; the number of one is its position in ``known``."""

    def __init__(self, pack: RulePack, where: CheckContext, severity: str, options: Mapping[str, Setting]) -> None:
        """Begin without any; rules below ``severity`` are not asked."""
        self.pack, self.where, self.options = pack, where, options
        self.severities = SEVERITIES[: SEVERITIES.index(severity) + 1]
        self.known = Numbered[KnownProfile]()

    def add(self, rows: Sequence[Mapping[str, str]]) -> list[tuple[int, str | None]]:
        """Resolve rows of texts; return for each the number of its profile, and the name on which its topic matches.

        Args:
            rows: with ``role``, ``topic``, ``participant``, ``version``, and a text by column of a setting; empty: not stated.
        """
        owned_by = ((tuple(settings_of(self.pack, row, owned=True).items()), at) for at, row in enumerate(rows))
        found: dict[int, tuple[int, str | None]] = {}
        for owned, positions in grouped(owned_by).items():
            found |= self._resolve(dict(owned), {at: rows[at] for at in positions})
        return [found[at] for at in range(len(rows))]

    def _resolve(
        self, owned: Mapping[str, str], rows: Mapping[int, Mapping[str, str]]
    ) -> dict[int, tuple[int, str | None]]:
        """Resolve rows whose participants state the same."""
        system = System(protocol=self.pack.id)
        system.options[self.pack.id] = dict(self.options)
        for at, row in rows.items():
            owner = row["participant"]
            system.participants[owner] = Participant(owner, self.pack.id, {n: Setting(t) for n, t in owned.items()})
            system.endpoints.append(endpoint_of(self.pack, row, str(at), row["topic"], owner))
        resolver = Resolver(system, self.where.find_pack, self.pack.id, {}, self.where.known_packs, completed=True)
        ends = remarked(resolver.run())
        return {
            at: (self._number(each, row, said), each.key)
            for (at, row), (each, said) in zip(rows.items(), ends, strict=True)
        }

    def _number(self, each: Resolved, row: Mapping[str, str], said: Sequence[Remark]) -> int:
        remarks = tuple(dict.fromkeys((*said, *self._of_one(each))))
        key = (each.role, id(each.profile), row["version"], remarks, each.external)
        return self.known.number(key, KnownProfile(each, row["version"], remarks, row))

    def _of_one(self, each: Resolved) -> tuple[Remark, ...]:
        """Return what rules say of one endpoint by itself, and of its participant."""
        values = each.profile.values
        spoken = [*judge_endpoint(each.profile, each.role, False)]
        spoken += (said for bound in self.pack.participant_rules if (said := ask(bound, values, values)) is not None)
        return tuple(
            Remark(one.bound.rule.code, one.bound.severity, one.bound.rule.because)
            for one in spoken
            if not one.unknown and one.bound.severity in self.severities
        )
