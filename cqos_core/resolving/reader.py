"""What one system states, as policies and values of a pack; what is wrong with it is reported."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.language.domains import Count, Duration, flow
from cqos_core.language.policy import ENDPOINT, NO, ByOption, Meaning, PerRole, Policy
from cqos_core.language.values import (
    UNREAD,
    Anything,
    Depends,
    FromPeers,
    OneOf,
    Value,
    WrittenValue,
    is_plain,
    normalise,
)
from cqos_core.model.caches import LONGEST_REMEMBERED
from cqos_core.model.core_findings import core_finding
from cqos_core.model.dataclass import dataclass
from cqos_core.model.problems import InvalidValueError
from cqos_core.model.settings import Cases, Setting
from cqos_core.resolving.endpoint_remarks import OwnPlace, filled
from cqos_core.resolving.layers import Stated
from cqos_core.resolving.qos_profile import treated
from cqos_core.resolving.unknown_names import (
    can_be_stated,
    elsewhere,
    every_policy,
    may_be_any,
    may_be_meant,
    meant_by,
    misquoted,
    near_policies,
    with_unclear,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cqos_core.language.domains import Domain
    from cqos_core.language.values import Plain
    from cqos_core.model.finding import Finding, Severity
    from cqos_core.model.settings import Place, Settings
    from cqos_core.model.system import Endpoint
    from cqos_core.packs.pack import RulePack
    from cqos_core.packs.presets import Dialect
    from cqos_core.resolving.endpoint_remarks import Remark
    from cqos_core.resolving.layers import Layer


@dataclass(frozen=True, slots=True)
class ValueSource:
    """Whose values are read, from what.

    Attributes:
        layers: what is stated, nearest first.
        options: values of options, on which the meaning of a text may rest.
        owner, place: what messages call whom it is stated of, and where that stands.
        observed: it was seen to run, so that a default is no fact.
        member: the id of the endpoint; None for what is no endpoint.
    """

    role: str
    layers: Sequence[Layer]
    options: Mapping[int, Value]
    dialect: Dialect | None
    owner: str
    place: Place | None = None
    observed: bool = False
    member: str | None = None

    def place_of(self, stated: Stated | None) -> Place | None:
        """Return where a setting stands, or of one that has no place of whom it is stated."""
        place = None if stated is None else stated.setting.place
        return replace(place, line=None) if isinstance(place, OwnPlace) else place or self.place

    def about(self, policy: Policy) -> tuple[str, Sequence[str]]:
        """Return what a finding about a policy is about, and of whom."""
        return (self.role, [self.member]) if self.member else (policy.level, [])


class Whose(NamedTuple):
    """Whose names of settings are read, and what they may spell.

    Attributes:
        owner, role, members: what findings call whom the settings are of.
    """

    pack: RulePack
    levels: tuple[str, ...]
    dialect: Dialect | None
    owner: str
    role: str
    members: Sequence[str]


class Recognised(NamedTuple):
    """What the name of a setting spells.

    Attributes:
        found: what it states, by index of the policy.
        misread: names that spell no policy, each with those that it may have been meant for.
        refused: it is one that cannot be stated.
        may_be_any: what it sets is not known.
    """

    setting: Setting
    found: Mapping[int, Stated]
    misread: Mapping[str, set[int]] = MappingProxyType({})
    refused: bool = False
    may_be_any: bool = False


class SettingsReader:
    """Reads what one system states.

    Attributes:
        findings: where reports go.
        remarks: how often something was to be reported, also where it was said already.
    """

    def __init__(self, findings: list[Finding]) -> None:
        """Report to ``findings``."""
        self.findings = findings
        self.remarks = 0
        self._causes: dict[tuple[object, ...], tuple[int, dict[str, None]]] = {}
        self._ignored: dict[tuple[Any, ...], str | None] = {}

    def without_effect(self, policy: Policy, stated: Stated | None, owner: str, role: str, member: str) -> None:
        """Report a policy that is stated for an endpoint of a role that has none."""
        if stated is not None and not stated.setting.unknown:
            from cqos_core.model.excerpt import key_of

            roles = " and ".join(policy.roles) or "no endpoint"
            message = f"{owner} states `{policy.name}`, which only a {roles} has"
            self.say("CQ210", message, key_of(stated.setting.place, stated.name), role, [member])

    def say(
        self,
        code: str,
        message: str,
        place: Place | None,
        role: str,
        members: Sequence[str] = (),
        help_text: str | None = None,
        severity: Severity | None = None,
    ) -> None:
        """Report under a code of the core."""
        finding = core_finding(
            code, message, place=place, role=role, members=members, help=help_text, severity=severity
        )
        self.remarks += 1
        self.findings.append(finding)

    def say_once(self, code: str, message: str, place: Place | None, help_text: str = "") -> None:
        """Report, unless the same is reported already."""
        finding = core_finding(code, message, place=place, help=help_text or None)
        self.say_cause((code, message, place, help_text), finding, ())

    def say_cause(self, cause: tuple[object, ...], finding: Finding, members: Iterable[str]) -> None:
        """Report a cause once, and of whom all it is the cause; `finish` adds them to the finding."""
        self.remarks += 1
        if cause not in self._causes:
            self._causes[cause] = (len(self.findings), {})
            self.findings.append(finding)
        position, concerned = self._causes[cause]
        concerned.update(dict.fromkeys(members))
        self.findings[position] = min(self.findings[position], finding, key=by_place)

    def repeat(self, remarks: Iterable[Remark], endpoint: Endpoint, identifier: str) -> None:
        """Report what was kept, of an endpoint that goes by an id."""
        for remark in remarks:
            cause, finding = filled(remark, endpoint, identifier)
            if cause is None:
                self.remarks += 1
                self.findings.append(finding)
            else:
                self.say_cause(cause, finding, finding.sides[0].members)

    def taken(self) -> list[Remark]:
        """Return what was reported, each with the cause that others may share, and forget it."""
        self.finish()
        causes = {position: cause for cause, (position, _) in self._causes.items()}
        found = [(causes.get(position), finding) for position, finding in enumerate(self.findings)]
        self.findings.clear()
        self._causes.clear()
        return found

    def finish(self) -> None:
        """Put whom a cause concerns into its finding."""
        for position, members in self._causes.values():
            finding = self.findings[position]
            if len(members) > len(finding.sides[0].members):
                side = replace(finding.sides[0], members=tuple(sorted(members)))
                self.findings[position] = replace(finding, sides=(side,))

    def recognise(self, whose: Whose, settings: Settings) -> tuple[dict[int, Stated], tuple[str, ...]]:
        """Read the names of settings; report those that spell no policy.

        Returns the settings by index of the policy that each name spells, and codes of the errors in them.
        """
        return self.together(whose, [self.name(whose, name, settings) for name in settings])

    def name(self, whose: Whose, name: str, settings: Settings) -> Recognised:
        """Read the name of one of several settings; report it if it spells no policy."""
        pack, levels, dialect, owner, role, members = whose
        setting = settings[name]
        if setting.unknown and may_be_any(pack, levels, name, dialect):
            return Recognised(setting, {}, may_be_any=True)
        if dialect is not None and normalise(name) in dialect.ignore:
            return Recognised(setting, {})
        fields, others = fields_of(pack, levels, name, setting)
        if fields and not others:
            return Recognised(setting, fields)
        index = next((i for level in levels if (i := pack.find(level, name, dialect)) is not None), None)
        if index is not None and pack.policies[index].derived and not setting.derived:
            message = f"{owner} states `{name}`, which cannot be stated. {pack.policies[index].doc}"
            self.say("CQ202", message, setting.place, role, members, "remove it")
            return Recognised(setting, fields, refused=True)
        if index is None or not can_be_stated(pack.policies[index]):
            # Of a map some fields may be known; or all are those of a group of policies whose name is misspelt.
            from cqos_core.model.excerpt import key_of

            wrong = [each for each in others if fields or near_policies(pack, levels, each)]
            shown = {each: each for each in wrong} if fields else {name: wrong[0] if wrong else name}
            may_be = may_be_meant(pack, levels, grouped=bool(wrong))
            for written, near in shown.items():
                message = f"{owner} states `{written}`, which {pack.title} does not know"
                advice = elsewhere(pack, levels, written, setting, settings) or meant_by(near, may_be)
                self.say("CQ202", message, key_of(setting.place, name), role, members, advice)
            misread = {each: near_policies(pack, levels, each) for each in wrong or (name,)}
            return Recognised(setting, fields, misread)
        text = setting.text if setting.unknown else spelled(pack.policies[index], setting.text, dialect)
        if text is None:
            return Recognised(setting, fields)
        return Recognised(setting, {**fields, index: Stated(text, setting, name)})

    def together(self, whose: Whose, recognised: Iterable[Recognised]) -> tuple[dict[int, Stated], tuple[str, ...]]:
        """Put together what the names of all settings spell, as `recognise` returns it; report what is stated twice."""
        pack, levels, _, owner, role, members = whose
        found: dict[int, Stated] = {}
        misread: dict[str, tuple[Setting, set[int]]] = {}
        may_be_any = []
        refused = False
        for each in recognised:
            for index, stated in each.found.items():
                before = found.get(index, stated)
                if before.text != stated.text and not stated.field and not stated.setting.unknown:
                    name, text = stated.name, stated.text
                    message = f"{owner} states `{pack.policies[index].name}` twice, as {before.text} and as {text}"
                    spelt = f"`{before.name}: {before.setting.text}` or `{name}: {stated.setting.text}`"
                    keep = f"keep {spelt}" if before.name and normalise(before.name) != normalise(name) else None
                    self.say("CQ209", message, stated.setting.place, role, members, keep)
                found[index] = stated
            misread |= {name: (each.setting, near) for name, near in each.misread.items()}
            refused = refused or each.refused
            if each.may_be_any:
                may_be_any.append(each.setting)
        found = with_unclear(found, misread, pack, levels)
        for setting in may_be_any:
            found = {**every_policy(pack, levels, setting), **found}
        return found, ("CQ202",) if misread or refused else ()

    def value(self, pack: RulePack, index: int, reading: ValueSource) -> Value:
        """Return the value of a policy that the nearest layer states, else its default; report what is no value."""
        policy, role, member = pack.policies[index], reading.role, reading.member
        layer = next((layer for layer in reading.layers if index in layer.settings), None)
        stated = layer.settings[index] if layer is not None else None
        ignoring = self._ignoring(pack, policy, reading.options)
        if (
            layer is not None
            and stated is not None
            and ignoring is not None
            and layer.counts_as_stated
            and not stated.setting.unknown
            and not _is_default(pack, policy, stated.text, reading)
        ):
            message = f"{reading.owner} states `{policy.name}`, which {ignoring} ignores"
            self.say("CQ205", message, reading.place_of(stated), role, [member] if member else [])
        if stated is not None and stated.setting.unknown and ignoring is None:
            return self.not_known(pack, policy, stated, reading)
        text = stated.text if stated is not None and ignoring is None else None
        dialect = reading.dialect
        if text is None:
            text = policy.default_for(role)
            if text is None:
                return Anything(f"{policy.name} is not stated")
            if reading.observed and ignoring is None and not (policy.derived or policy.unseen):
                return Anything(f"discovery did not report {policy.name}")
            # A default stands in the spelling of the policy itself.
            dialect = None
        try:
            return read_value(pack, policy, text, role, reading.options, dialect)
        except InvalidValueError as problem:
            kind, _, name = layer.origin.partition(" ") if layer is not None else ("", "", "")
            owner = f"profile `{name}`" if kind == "profile" else reading.owner
            name_of = policy.name.removeprefix("need.")
            from cqos_core.resolving.common_mistakes import meant_instead, settings_of_call, value_within

            meant = meant_instead(pack, f"{name_of}: {text}") or settings_of_call(pack, text, of=policy.name)[1:-1]
            if meant := meant or ("" if problem.near else value_within(policy, text)):
                problem = InvalidValueError(problem.message, problem.expected, meant)
            elif not problem.near and (others := _policies_with(pack, text)):
                problem = InvalidValueError(f"{problem.message}; it is a value of {others}", problem.expected)
            elif remark := misquoted(pack, policy, text):
                problem = InvalidValueError(f"{problem.message}; {remark}", problem.expected, problem.near)
            return self._invalid(policy, problem, owner, stated, reading)

    def _invalid(
        self, policy: Policy, problem: InvalidValueError, owner: str, stated: Stated | None, reading: ValueSource
    ) -> Value:
        """Report that ``owner`` states what is no value of a policy, which is not known then."""
        where = reading.place_of(stated)
        message = f"{owner}: `{policy.name.removeprefix('need.')}` {problem.message}"
        expected = problem.expected if problem.expected != policy.domain.expected() else policy.expected()
        about, members = reading.about(policy)
        finding = core_finding("CQ203", message, place=where, role=about, help=problem.advice(expected))
        self.say_cause(("CQ203", message, where), finding, members)
        return Anything(f"{policy.name} has no valid value", "CQ203")

    def not_known(self, pack: RulePack, policy: Policy, stated: Stated, reading: ValueSource) -> Value:
        """Return the value of a setting that was not understood, and report why, unless that is done."""
        unknown = stated.setting.unknown
        if isinstance(unknown, Cases):
            spelt = ((when, spelled(policy, text, reading.dialect) if text else None) for when, text in unknown.values)
            default = policy.default_for(reading.role) or ""
            try:
                cases = tuple(
                    (when, read_value(pack, policy, text or default, reading.role, reading.options, None))
                    for when, text in spelt
                )
            except InvalidValueError as problem:
                return self._invalid(policy, problem, reading.owner, stated, reading)
            return cases[0][1] if len({value for _, value in cases}) == 1 else Depends(unknown.assumption, cases)
        code = stated.code or stated.setting.reported
        if not code:
            about, members = reading.about(policy)
            what = f"`{policy.name}`" if stated.name else "what it does not state"
            message = f"{reading.owner}: {what} is not known: {unknown}"
            finding = core_finding("CQ217", message, place=stated.setting.place, role=about)
            self.say_cause(("CQ217", unknown), finding, members)
        return Anything(unknown, code or "CQ217")

    def _ignoring(self, pack: RulePack, policy: Policy, options: Mapping[int, Value]) -> str | None:
        """The option and its value under which the middleware ignores the policy; None where it does not."""
        if not policy.enforced:
            return None
        key = (id(pack), policy.name, tuple(options.get(pack.vocabulary.indices["option", o]) for o in policy.enforced))
        if key not in self._ignored:
            self._ignored[key] = ignored_by(pack, policy, options)
        return self._ignored[key]


def read_value(
    pack: RulePack,
    policy: Policy,
    text: str,
    role: str,
    options: Mapping[int, Value],
    dialect: Dialect | None,
) -> Value:
    """Return the value that a text in a dialect stands for.

    Raises:
        InvalidValueError: the policy has no such value.
    """
    # A text may be a whole list of access control, and each of its clients reads it.
    meaning = policy.words.get(policy.domain.word(text)) if policy.words else None
    if meaning is None:
        unit = dialect.bare_unit if dialect else None
        read = _plain_remembered if len(text) <= LONGEST_REMEMBERED else _plain
        plain = read(policy.domain, text, unit)
        if plain != 0 or policy.zero is None:
            return plain
        meaning = policy.words[policy.zero]
    return _meaning(pack, policy, meaning, role, options)


def _meaning(pack: RulePack, policy: Policy, meaning: Meaning, role: str, options: Mapping[int, Value]) -> Value:
    match meaning:
        case str():
            return read_value(pack, policy, meaning, role, options, None)
        case PerRole():
            return _meaning(pack, policy, getattr(meaning, role), role, options)
        case ByOption():
            return _by_option(pack, policy, meaning, role, options)
        case OneOf(values):
            return Anything(f"it is one of {', '.join(values)}")
    return meaning


def _by_option(pack: RulePack, policy: Policy, meaning: ByOption, role: str, options: Mapping[int, Value]) -> Value:
    index = pack.vocabulary.indices["option", meaning.option]
    listed = dict(meaning.meanings)
    domain = pack.policies[index].domain

    def under(value: Value) -> Value:
        if isinstance(value, Depends):
            cases = tuple((name, under(case)) for name, case in value.cases)
            return cases[0][1] if len({case for _, case in cases}) == 1 else Depends(value.on, cases)
        if not is_plain(value):
            return Anything(f"option {meaning.option} is not known")
        chosen = listed.get(domain.format(value), meaning.otherwise)  # type: ignore[arg-type]
        if chosen is None:
            return Anything(f"it is not known for {meaning.option} {domain.format(value)}")  # type: ignore[arg-type]
        return _meaning(pack, policy, chosen, role, options)

    return under(options[index])


def ignored_by(pack: RulePack, policy: Policy, options: Mapping[int, Value]) -> str | None:
    """The option and its value under which the middleware ignores the policy; None where it does not."""
    for option, by_value in policy.enforced.items():
        index = pack.vocabulary.indices["option", option]
        value = options.get(index)
        if value is not None and treated(by_value, pack.policies[index], value) == NO:
            values = [case for _, case in value.cases] if isinstance(value, Depends) else [value]
            return f"{option} {' or '.join(map(pack.policies[index].format, values))}"
    return None


def _plain(domain: Domain, text: str, unit: str | None) -> Plain:
    """Read a text as a plain value; ``unit`` is that of numbers without one."""
    return domain.parse(domain.with_unit(text, unit))


# Few texts make up most systems, and they are read alike every time.
_plain_remembered = lru_cache(maxsize=16_384)(_plain)
_ZEROS: Final = frozenset(("0", "0s"))


def depends(pack: RulePack, option: Policy, names: Iterable[str]) -> Depends:
    """The value of an option that may have any of these values."""
    return Depends(f"{pack.id}.{option.name}", tuple((name, option.domain.parse(name)) for name in names))


def word_of(policy: Policy, text: str) -> str:
    """The word that ``text`` is, or that its zero stands for."""
    word = policy.word(text)
    return policy.zero if policy.zero is not None and word in _ZEROS else word


def either(pack: RulePack, options: Mapping[int, Value], when: tuple[str, str], then: Value, otherwise: Value) -> Value:
    """The value ``then`` under a value of an option that is not known, else ``otherwise``."""
    if then == otherwise:
        return then
    index = pack.vocabulary.indices["option", when[0]]
    option = options[index]
    if not isinstance(option, Depends) or isinstance(otherwise, FromPeers):
        return Anything(f"it depends on option {when[0]}", code=getattr(option, "code", ""))
    expected = meant_by_option(pack.policies[index], when[1])
    cases = ((name, then if case in expected else otherwise) for name, case in option.cases)
    return Depends(
        option.on,
        tuple(
            (name, dict(value.cases)[name] if isinstance(value, Depends) and value.on == option.on else value)
            for name, value in cases
        ),
    )


def meant_by_option(policy: Policy, text: str) -> tuple[Value, ...]:
    """Return the values of an option that a text stands for: a vendor's name stands for all its versions."""
    meaning = policy.words.get(normalise(text))
    return tuple(map(policy.domain.parse, meaning.values if isinstance(meaning, OneOf) else (text,)))


def how_written(policy: Policy, index: int, layers: Sequence[Layer]) -> WrittenValue | None:
    """How the nearest of ``layers`` states a policy; None if none of them does, or a preset."""
    for layer in layers:
        stated = layer.settings.get(index)
        if stated is not None:
            if isinstance(stated.setting.unknown, str) and stated.setting.unknown:
                return UNREAD
            return WrittenValue(policy.word(stated.text), here=bool(layer.here)) if layer.counts_as_stated else None
    return None


def spelled(policy: Policy, text: str, dialect: Dialect | None) -> str | None:
    """Return a dialect's text in the spelling of the YAML form: integer codes in words, durations with their unit.

    None if a zero of the dialect means "not stated".
    """
    if dialect is None:
        return text
    stripped = text.strip()
    codes = dialect.codes.get(policy.name)
    if codes is not None and stripped in codes:
        return codes[stripped]
    zero = dialect.zero_is_unset and "0" in stripped and set(stripped) <= {*"0.+"}
    if zero and isinstance(policy.domain, (Duration, Count)):
        return None
    return policy.domain.with_unit(text, dialect.bare_unit)


def fields_of(
    pack: RulePack, levels: tuple[str, ...], name: str, setting: Setting
) -> tuple[dict[int, Stated], tuple[str, ...]]:
    """Read a map whose keys are the fields of a policy: ``will: {topic: x}`` states ``will.topic``.

    Returns:
        The settings by index, and what the keys that are no fields would be called; two times nothing for what is no map.
    """
    found: dict[int, Stated] = {}
    others = []
    if not setting.text.lstrip().startswith("{"):
        return found, ()
    import json

    try:
        fields = flow(setting.text)
    except InvalidValueError:
        return found, ()
    for key, value in fields.items() if isinstance(fields, dict) else ():
        index = next((i for level in levels if (i := pack.find(level, f"{name}.{key}")) is not None), None)
        if index is None:
            others.append(f"{name}.{key}")
            continue
        text = value if isinstance(value, str) else json.dumps(value)
        found[index] = Stated(text, Setting(text, setting.place), name, field=key)
    return found, tuple(others)


def _is_default(pack: RulePack, policy: Policy, text: str, reading: ValueSource) -> bool:
    """Whether a stated text only says what holds anyway."""
    default = policy.default_for(reading.role)
    try:
        return default is not None and read_value(
            pack, policy, text, reading.role, reading.options, reading.dialect
        ) == read_value(pack, policy, default, reading.role, reading.options, None)
    except InvalidValueError:
        return False


def by_place(finding: Finding) -> tuple[object, ...]:
    """The order of findings of one cause; the first is reported."""
    place = finding.place
    at = ("", 0, 0) if place is None else (place.source, place.line or 0, place.column or 0)
    return (*at, finding.message)


def _policies_with(pack: RulePack, text: str) -> str:
    """Name the policies of endpoints that have a value of this name."""
    word = normalise(text)
    names = [
        each.name for each in pack.policies if each.level == ENDPOINT and word in getattr(each.domain, "names", ())
    ]
    return " and ".join(f"`{name}`" for name in names)
