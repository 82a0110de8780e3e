"""Rule packs: the policies, rules, presets, dialects and meeting of one protocol, as one value."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

from cqos_core.language.binding import bind
from cqos_core.language.expression import definitions, in_, option, unfolded
from cqos_core.language.policy import BOTH, ENDPOINT, LEVELS, NEED, Policy
from cqos_core.language.values import Anything, is_plain, normalise
from cqos_core.language.vocabulary import Function, Vocabulary, role_of, scope_of
from cqos_core.model.problems import ConditionError, PackError
from cqos_core.model.system import Setting
from cqos_core.packs.guarantee import WORDS, unstated
from cqos_core.packs.rule import SEVERITIES
from cqos_core.packs.validation import Mistake, mistakes, rule_mistakes

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence

    from cqos_core.language.evaluate import BoundCondition
    from cqos_core.language.expression import Node, Operand
    from cqos_core.language.values import Plain, Value
    from cqos_core.language.vocabulary import Use
    from cqos_core.model.codes import CodeInfo
    from cqos_core.model.logs import About, Misfit
    from cqos_core.model.system import Endpoint, Place, Settings
    from cqos_core.packs.guarantee import Proof, Unaffected
    from cqos_core.packs.rule import Rule, SeverityName


@dataclass(frozen=True, slots=True)
class Preset:
    """A named bundle of values that comes with the pack.

    Attributes:
        settings: policy name to text; policies not named keep their defaults.
        level: whose policies these are: ``endpoint`` or ``broker``.
        needs: option and the least value of it that has this preset, for instance ``("distro", "iron")``; None: always.
        aliases: other spellings; compared normalised.
    """

    settings: Mapping[str, str]
    doc: str = ""
    needs: tuple[str, str] | None = None
    aliases: tuple[str, ...] = ()
    level: Literal["endpoint", "broker"] = ENDPOINT


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """A participant, an endpoint or a broker as `RulePack.complete` sees it: with resolved values, never with their text.

    Attributes:
        id, place, template, external: as stated.
        read: returns the value of a policy and its place, or None where nothing states it.
        find_needs: returns the guarantees that an endpoint needs.
        role, topic, participant, kind: of an endpoint.
    """

    id: str
    read: Callable[[Policy], tuple[Value, Place | None] | None] = field(repr=False)
    find_needs: Callable[[], Collection[str]] = field(repr=False, default=tuple)
    place: Place | None = None
    template: str | None = None
    external: bool = False
    role: str = ""
    topic: str | None = None
    participant: str = ""
    kind: str = ""

    @property
    def needs(self) -> Collection[str]:
        """The guarantees that an endpoint needs, in the words of `cqos_core.packs.guarantee`."""
        return self.find_needs()

    def value(self, policy: Policy) -> Value | None:
        """Return what is stated of a policy, in the settings, a profile, a preset or an overlay; None where nothing is."""
        found = self.read(policy)
        return None if found is None else found[0]

    def setting(self, policy: Policy) -> Setting | None:
        """Return the same as a setting in its one spelling; it is unknown where the value is not plain."""
        found = self.read(policy)
        if found is None:
            return None
        value, place = found
        if is_plain(value):
            return Setting(policy.domain.format(value), place)  # type: ignore[arg-type]
        code = value.code if isinstance(value, Anything) else ""
        return Setting("", place, unknown=policy.format(value), reported=code)


@dataclass(frozen=True, slots=True)
class Completion:
    """What follows from all that a system states together, and nothing in it states alone.

    Attributes:
        participants: settings by id of the participant.
        endpoints: settings by position of the endpoint.
        implied: endpoints that participants have by their own settings, such as the message that a connection leaves behind.
    """

    participants: Mapping[str, Settings] = field(default_factory=dict)
    endpoints: Mapping[int, Settings] = field(default_factory=dict)
    implied: tuple[Endpoint, ...] = ()


@dataclass(frozen=True, slots=True)
class Dialect:
    """How one kind of file writes the pack's settings.

    Attributes:
        names: attribute name (normalised) to policy name, beside the policies' own aliases.
        codes: policy name to its integer codes: ``{"history": {"0": "keep_last"}}``.
        bare_unit: unit of a duration without one (``s``, ``ns``); None refuses it.
        zero_is_unset: a numeric zero of a count or duration means that nobody stated it.
        ignore: attribute names (normalised) that are no settings of this pack.
    """

    names: Mapping[str, str] = field(default_factory=dict)
    codes: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    bare_unit: str | None = None
    zero_is_unset: bool = False
    ignore: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True)
class Convention:
    """What users of a protocol agree on about some topics: facts that hold unless stated otherwise.

    Attributes:
        pattern: shell pattern over the resolved topic name.
        settings: topic-level settings: ``{"latched": "true"}``.
        external: the other side is usually part of no design (a log collector, say), so a missing partner is no finding.
    """

    pattern: str
    settings: Mapping[str, str] = field(default_factory=dict)
    external: bool = False
    doc: str = ""


@dataclass(frozen=True, slots=True)
class Derivation:
    """What a pair amounts to in a value that neither end states: the QoS with which a message arrives.

    Attributes:
        name: for people, such as ``arrives with QoS``.
        operand: over the policies of both ends, with few values.
        policy: the policy whose values it has.
        doc: how it comes about, in a few words.
    """

    name: str
    operand: Operand
    policy: Policy
    doc: str = ""


class NameProblem(NamedTuple):
    """What is wrong with a name: a core or pack code, severity, message, and what to do."""

    code: str
    severity: str
    message: str
    help: str = ""


class Naming(NamedTuple):
    """A topic name put into the form endpoints meet on.

    ``key`` is that form (None: it names no topic), ``shown`` is what messages print.
    """

    key: str | None
    shown: str
    problems: tuple[NameProblem, ...] = ()


@dataclass(frozen=True, slots=True)
class NameContext:
    """What a topic name is resolved with; ``role`` is empty where it is asked for a topic, not for one of its endpoints."""

    participant: str
    label: str | None
    settings: Mapping[str, str]
    remap: Mapping[str, str]
    kind: str
    dialect: str
    role: str = ""


def plain_name(written: str, context: NameContext) -> Naming:  # noqa: ARG001 - the signature of all naming functions
    """Take names as they are written."""
    return Naming(written, written)


def plain_address(participant: str, settings: Mapping[str, str]) -> str:  # noqa: ARG001 - the signature of all
    """Take participants by their id."""
    return participant


def shell_pattern(pattern: str, address: str) -> bool:
    """Read patterns over addresses as the shell reads those over file names."""
    return fnmatchcase(address, pattern)


def no_misfits(line: str) -> tuple[Misfit, ...]:  # noqa: ARG001 - the signature of all that read output
    """Read nothing from the output of programs."""
    return ()


def nothing_follows(
    participants: Sequence[Known],  # noqa: ARG001 - the signature of all
    endpoints: Sequence[Known],  # noqa: ARG001
    brokers: Mapping[str, Known],  # noqa: ARG001
) -> Completion:
    """Add nothing to what a system states."""
    return Completion()


def nothing_summed(endpoints: Sequence[Any]) -> Mapping[int, Mapping[str, Value]]:  # noqa: ARG001 - as above
    """Add nothing to the values of endpoints."""
    return {}


def only_itself(endpoint: Endpoint) -> tuple[Endpoint, ...]:
    """Every endpoint stands for itself."""
    return (endpoint,)


@dataclass(frozen=True, slots=True)
class Meeting:
    """Who meets whom.

    Attributes:
        resolve: puts a written name into the form endpoints meet on.
        address: how files that lay settings over a participant's endpoints name it, from its id and its settings
            (a ROS node's name with its namespace).
        covers: whether a pattern of such a file covers an address; ``*`` covers all.
        expand: what an endpoint stands for: a service server is one subscriber and one publisher.
        folds: functions from a key to a coarser one; two lonely keys with an equal fold are a near miss.
            Each comes with the words that say how they differ.
        match: where equal keys are not all that meets (a filter and the names it matches): from the keys of publishers and of
            subscribers all pairs of different ones that meet.
        overlapping: the flag of an endpoint that says that its participant has another subscriber, with another key, on the
            same topic; set where that is so.
        one_way: values of a subscriber, by policy, under which several ways to it bring nothing twice, because it takes what
            comes over one of them (exclusive ownership) or another one gets the rest (a shared subscription).
        described: one sentence for docs and packs listings.
    """

    resolve: Callable[[str, NameContext], Naming] = plain_name
    expand: Callable[[Endpoint], tuple[Endpoint, ...]] = only_itself
    address: Callable[[str, Mapping[str, str]], str] = plain_address
    covers: Callable[[str, str], bool] = shell_pattern
    folds: tuple[tuple[str, Callable[[str], str]], ...] = (
        ("differ only in upper and lower case", str.casefold),
        ("differ only in slashes at the ends", lambda key: key.strip("/")),
    )
    match: Callable[[Collection[str], Collection[str]], Iterable[tuple[str, str]]] | None = None
    overlapping: str = ""
    one_way: Mapping[str, str] = field(default_factory=dict)
    described: str = "endpoints on the same topic name"


@dataclass(frozen=True, slots=True)
class Wire:
    """How endpoints of a protocol look to the protocol that carries them, so that endpoints of both can meet.

    A pair of one endpoint of each is judged by the wire's pack on wire values. Nothing here needs that pack installed.

    Attributes:
        protocol: id of the wire's pack.
        topic: from a topic key and the endpoint's plain values by policy name, the topic on the wire; None where the endpoint
            is not on that wire.
        policies: own endpoint policy to the wire policy, or the several, that it sets; wire policies that none stands for
            keep their defaults.
        options: own option to the wire's option or participant setting.
        facts: what is known of a topic, or of the network as an option, to the wire's policy for the same; where the wire's
            endpoints on the topic state nothing, they know it too.
        words: own value to wire value, where the two spell it differently.
        fixed: wire policies that endpoints of this protocol always have, with their values.
        type: from a type name to the one on the wire.
    """

    protocol: str
    topic: Callable[[str, Mapping[str, str]], str | None]
    policies: Mapping[str, str | tuple[str, ...]]
    options: Mapping[str, str] = field(default_factory=dict)
    facts: Mapping[str, str] = field(default_factory=dict)
    words: Mapping[str, str] = field(default_factory=dict)
    fixed: Mapping[str, str] = field(default_factory=dict)
    type: Callable[[str], str] = str

    def translations(self) -> Iterator[tuple[str, str]]:
        """Yield each own policy with each wire policy that it sets."""
        for own, on_wire in self.policies.items():
            for name in (on_wire,) if isinstance(on_wire, str) else on_wire:
                yield own, name


@dataclass(frozen=True, slots=True)
class BoundRule:
    """A rule with its sentence bound to the pack's policies, and the scope that follows from its terms.

    ``absent``: by role, the policies that it reads of an endpoint itself and that endpoints of the role do not have.
    """

    rule: Rule
    bound: BoundCondition
    scope: str
    role: str | None
    absent: Mapping[str, tuple[int, ...]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Note which policies are absent."""
        policies = self.bound.vocabulary.policies
        own = [
            use.index for use in self.bound.uses if use.term.scope == "own" and policies[use.index].level == ENDPOINT
        ]
        absent = {role: tuple(index for index in own if role not in policies[index].roles) for role in BOTH}
        object.__setattr__(self, "absent", absent)

    @property
    def severities(self) -> dict[str, SeverityName]:
        """By value of the option that it depends on, the severity; a plain severity stands alone under an empty value."""
        by = self.rule.severity
        if isinstance(by, str):
            return {"": by}
        listed, domain = dict(by.meanings), self.option.domain
        found = {text: listed.get(text, by.otherwise) for text in map(domain.format, domain.candidates())}
        return {text: severity for text, severity in found.items() if severity is not None}  # type: ignore[misc]

    @property
    def option(self) -> Policy:
        """The option on which the severity depends."""
        vocabulary = self.bound.vocabulary
        return vocabulary.policies[vocabulary.indices["option", self.rule.severity.option]]  # type: ignore[union-attr]

    @property
    def severity(self) -> SeverityName:
        """The severity by default: that of the option's default, or the worst where the rule is not checked then."""
        found = self.severities
        usual = None if "" in found else found.get(str(self.option.default))
        return min(found.values(), key=SEVERITIES.index) if usual is None else usual

    def by_severity(self) -> Iterator[BoundRule]:
        """Yield the rule once for each severity, limited to the values of the option that give it."""
        if isinstance(self.rule.severity, str):
            yield self
            return
        found, condition = self.severities, self.rule.condition
        for severity in dict.fromkeys(found.values()):
            here = in_(option(self.option), *(value for value, each in found.items() if each == severity))
            limited = condition & here if self.rule.kind == "forbids" else condition | ~here
            rule = replace(self.rule, condition=limited, severity=severity)
            yield BoundRule(rule, bind(limited, self.bound.vocabulary), self.scope, self.role)


def _bound(rule: Rule, vocabulary: Vocabulary, found: list[Mistake]) -> list[BoundRule]:
    """Bind a rule, and add what is wrong with it to ``found``."""
    at = ("rules", rule.code)
    try:
        judged = bind(rule.condition, vocabulary)
    except ConditionError as error:
        found.append(Mistake(at, f"rule {rule.code} `{rule.condition}`: {error}"))
        return []
    # A guarantee is one of pairs, even where it rests on one side alone.
    scope = "pair" if rule.guarantee else scope_of(rule.condition)
    bound = BoundRule(rule, judged, scope, rule.role or role_of(rule.condition))
    found += (Mistake(at, f"rule {rule.code}: {message}") for message in rule_mistakes(bound))
    return [bound]


@dataclass(frozen=True, eq=False)
class RulePack:
    """Everything C-QoS knows about one protocol.

    Attributes:
        id: what systems name it by: ``ros2``.
        title: for people: ``ROS 2``.
        policies: of all levels; their order is the order of display.
        rules: judging rules and meeting conditions.
        presets: by canonical name.
        base_preset: what unset policies take their values from, before policy defaults; None for none.
        dialects: by name; ``yaml`` is used where an importer's dialect is not listed.
        conventions: facts about well-known topics.
        functions: named functions its sentences use.
        meeting: how names are resolved and endpoints expanded.
        complete: adds what follows from all participants, endpoints and brokers of the protocol together.
        sum_up: from all endpoints of the protocol (`cqos_core.resolving.resolved.Resolved`), by position of an endpoint the values of its derived
            policies that follow from the others, such as what all topics of a client bring together.
        wire: the protocol underneath, where endpoints of this one meet endpoints of that one.
        variants: ``(option, value)`` to the pack that judges when the system's option has that value.
        not_checked: what no QoS check of this protocol can see, for the report.
        codes: what the importers that come with the pack report.
        read_log: yields what one line of a program's output says of endpoints that do not fit.
        provers: by name of an implementation, the ``"module:object"`` of what runs pairs on it, a `cqos_core.analysis.proving.Prover`; the
            first is used where the system names none.
        unaffected: guarantees that faults leave as they are; a fault with neither this nor a rule leaves a guarantee open.
        derivations: values of a pair that no end states; `cqos explain` shows them.
        proofs: which guarantees were seen under which faults on a running implementation.
        implementation_option: the option, or the policy of brokers, whose value `proofs` name; empty without proofs.
        groups: words under which participants may group endpoints that share settings: ``publishers``, ``subscribers``.
        source: where the facts come from.
    """

    id: str
    title: str
    policies: tuple[Policy, ...]
    rules: tuple[Rule, ...]
    summary: str = ""
    presets: Mapping[str, Preset] = field(default_factory=dict)
    base_preset: str | None = None
    dialects: Mapping[str, Dialect] = field(default_factory=dict)
    conventions: tuple[Convention, ...] = ()
    functions: tuple[Function, ...] = ()
    meeting: Meeting = field(default_factory=Meeting)
    complete: Callable[[Sequence[Known], Sequence[Known], Mapping[str, Known]], Completion] = nothing_follows
    sum_up: Callable[[Sequence[Any]], Mapping[int, Mapping[str, Value]]] = nothing_summed
    wire: Wire | None = None
    variants: Mapping[tuple[str, str], RulePack] = field(default_factory=dict)
    not_checked: tuple[str, ...] = ()
    codes: tuple[CodeInfo, ...] = ()
    read_log: Callable[[str], Iterable[Misfit | About]] = no_misfits
    provers: Mapping[str, str] = field(default_factory=dict)
    unaffected: tuple[Unaffected, ...] = ()
    derivations: tuple[Derivation, ...] = ()
    proofs: tuple[Proof, ...] = ()
    implementation_option: str = ""
    groups: tuple[str, ...] = ()
    source: str = ""

    def __post_init__(self) -> None:
        """Bind every rule and read every default, so that a mistake shows when the pack is loaded.

        Raises:
            PackError: naming every mistake found.
        """
        found = list(mistakes(self))
        bound = []
        try:
            for rule in sorted(self.rules, key=lambda rule: rule.code):
                bound += _bound(rule, self.vocabulary, found)
        except PackError as error:  # without policies told apart no sentence can be read
            found.append(Mistake(("policies",), str(error)))
        if found:
            listed = "\n  ".join(mistake.message for mistake in found)
            raise PackError(f"rule pack `{self.id}` is not well formed:\n  {listed}", found)
        object.__setattr__(self, "bound_rules", tuple(bound))

    bound_rules: tuple[BoundRule, ...] = field(init=False, repr=False, default=())

    @cached_property
    def judging_rules(self) -> tuple[BoundRule, ...]:
        """The rules by severity, and those that leave a guarantee open under a fault that the pack does not cover."""
        found: list[Mistake] = []
        derived = (_bound(rule, self.vocabulary, found) for rule in unstated(self.rules, self.unaffected))
        stated = (each for bound in self.bound_rules for each in bound.by_severity())
        return (*stated, *(bound for rules in derived for bound in rules))

    @cached_property
    def vocabulary(self) -> Vocabulary:
        """The policies by index."""
        return Vocabulary(self.policies, self.functions)

    @cached_property
    def asked(self) -> frozenset[int]:
        """Indices of the policies of which a rule asks how they were written."""
        return frozenset(index for each in self.bound_rules for index in each.bound.asked)

    @cached_property
    def derived(self) -> tuple[tuple[Derivation, tuple[tuple[str, BoundCondition], ...]], ...]:
        """By derivation, each value that it may have, with the sentence that it has it."""
        return tuple(
            (
                each,
                tuple(
                    (text, bind(each.operand == text, self.vocabulary))
                    for text in (each.policy.domain.format(value) for value in each.policy.domain.candidates())
                ),
            )
            for each in self.derivations
        )

    @cached_property
    def by_scope(self) -> Mapping[str, tuple[BoundRule, ...]]:
        """Rules by scope; meeting conditions under ``meets``. Guarantees come last: they are of pairs that fit."""
        found: dict[str, list[BoundRule]] = {"meets": []}
        for bound in sorted(self.judging_rules, key=lambda bound: bool(bound.rule.guarantee)):
            found.setdefault("meets" if bound.rule.kind == "meets" else bound.scope, []).append(bound)
        return {scope: tuple(rules) for scope, rules in found.items()}

    @cached_property
    def beyond_topics(self) -> tuple[BoundRule, ...]:
        """The rules over participants, brokers and options, which no single topic can answer."""
        return tuple(bound for scope in ("participant", "broker", "system") for bound in self.by_scope.get(scope, ()))

    @cached_property
    def one_way(self) -> tuple[tuple[int, Plain], ...]:
        """`Meeting.one_way` as values by index."""
        return tuple(
            (self.vocabulary.indices[ENDPOINT, name], self.policy(name).domain.parse(text))
            for name, text in self.meeting.one_way.items()
        )

    @cached_property
    def spellings(self) -> Mapping[str, Mapping[str, int]]:
        """Per level: normalised name or alias → index."""
        found: dict[str, dict[str, int]] = {level: {} for level in LEVELS}
        for index, policy in enumerate(self.policies):
            for spelling in policy.spellings:
                found[policy.level][spelling] = index
        return found

    @cached_property
    def preset_names(self) -> Mapping[str, str]:
        """Normalised preset name or alias → canonical name."""
        return {
            normalise(spelling): name for name, preset in self.presets.items() for spelling in (name, *preset.aliases)
        }

    @cached_property
    def needs(self) -> Mapping[str, tuple[int, Plain]]:
        """By word of `cqos_core.packs.guarantee`, where its need stands among the values, and the value of nobody needing it."""
        found = {}
        for index, policy in enumerate(self.policies):
            if policy.level == NEED and (word := WORDS.get(policy.aliases[0] if policy.aliases else "")):
                found[word.name] = (index, word.nothing)
        return found

    @cached_property
    def guaranteed(self) -> Mapping[str, tuple[BoundRule, ...]]:
        """By word of `cqos_core.packs.guarantee`, the rules on which its guarantee rests."""
        found: dict[str, list[BoundRule]] = {}
        for bound in self.judging_rules:
            if bound.rule.guarantee:
                found.setdefault(bound.rule.guarantee, []).append(bound)
        return {word: tuple(rules) for word, rules in found.items()}

    @cached_property
    def definitions(self) -> Mapping[str, Node]:
        """The definitions that its conditions use, by name: what `cqos_core.language.expression.parse` reads them with."""
        return definitions(*(bound.rule.condition for bound in self.bound_rules))

    def find(self, level: str, name: str, dialect: Dialect | None = None) -> int | None:
        """Index of the policy that ``name`` spells at ``level``, or None."""
        word = normalise(name)
        if dialect is not None and word in dialect.names:
            word = normalise(dialect.names[word])
        return self.spellings[level].get(word)

    def policy(self, name: str, level: str = ENDPOINT) -> Policy:
        """Return the policy of that name or alias.

        Raises:
            KeyError: there is none.
        """
        index = self.find(level, name)
        if index is None:
            raise KeyError(name)
        return self.policies[index]

    def rule(self, code_or_name: str) -> Rule | None:
        """Return the rule with that code, name or alias, or None."""
        return self._by_spelling.get(code_or_name.lower(), (None, None))[0]

    def code(self, code_or_name: str) -> CodeInfo | None:
        """Return what an importer of the pack reports under that code, name or alias, or None."""
        return self._by_spelling.get(code_or_name.lower(), (None, None))[1]

    @cached_property
    def _by_spelling(self) -> Mapping[str, tuple[Rule | None, CodeInfo | None]]:
        """By code, name and alias in lower case: the rule, or what an importer of the pack reports."""
        found: dict[str, tuple[Rule | None, CodeInfo | None]] = {}
        for info in reversed(self.codes):
            found.update(dict.fromkeys(info.spellings, (None, info)))
        for rule in reversed(self.rules):
            for spelling in (rule.code.lower(), rule.name, *(alias.lower() for alias in rule.aliases)):
                found[spelling] = (rule, found.get(spelling, (None, None))[1])
        return found

    def describe(self) -> dict[str, Any]:
        """Describe the pack for machines: enough to draw a property panel for a protocol never seen before."""
        return {
            "id": self.id,
            "title": self.title,
            "summary": self.summary,
            "source": self.source,
            "meeting": self.meeting.described,
            "policies": [describe_policy(policy) for policy in self.policies],
            "presets": {name: dict(preset.settings) for name, preset in self.presets.items()},
            "base_preset": self.base_preset,
            "rules": [describe_rule(bound) for bound in self.bound_rules],
            "functions": [{"name": f.name, "doc": f.doc, "column_form": f.column} for f in self.functions],
            "conventions": [
                {"pattern": c.pattern, "settings": dict(c.settings), "external": c.external, "doc": c.doc}
                for c in self.conventions
            ],
            "codes": [describe_code(info) for info in self.codes],
            "not_checked": list(self.not_checked),
        }


def describe_policy(policy: Policy) -> dict[str, Any]:
    """Describe a policy for machines: kind, values in order, unit, default per side, docs."""
    return {
        "name": policy.name,
        "level": policy.level,
        **policy.domain.describe(),
        "default": policy.default
        if policy.default is None or isinstance(policy.default, str)
        else dict(policy.default),
        "words": list(policy.words),
        "roles": list(policy.roles),
        "aliases": list(policy.aliases),
        "enforced": {option: dict(by_value) for option, by_value in policy.enforced.items()},
        "fact": policy.default is None,
        "entities": list(policy.entities),
        "changeable": policy.changeable,
        "stronger": policy.stronger,
        "derived": policy.derived,
        "doc": policy.doc,
        "clause": policy.clause,
    }


def describe_rule(bound: BoundRule) -> dict[str, Any]:
    """Describe a rule for machines: its sentence in text form, scope, table and texts."""
    rule = bound.rule
    return {
        "code": rule.code,
        "name": rule.name,
        "kind": rule.kind,
        "scope": bound.scope,
        "role": bound.role,
        "sentence": str(unfolded(rule.condition)),
        "condition": str(rule.condition),
        "definitions": {name: node.text() for name, node in definitions(rule.condition).items()},
        "severity": bound.severity,
        "severity_by": {"option": bound.option.name, "severities": bound.severities}
        if "" not in bound.severities
        else None,
        "because": rule.because,
        "clause": rule.clause,
        "help": rule.help,
        "aliases": list(rule.aliases),
        "guarantee": rule.guarantee or None,
        "survives": rule.survives if rule.guarantee else None,
        "table": rule_table(bound),
        "column_form": column_form(bound),
    }


def describe_code(info: CodeInfo) -> dict[str, Any]:
    """Describe for machines what is reported under a code."""
    return {
        "code": info.code,
        "name": info.name,
        "severity": info.severity,
        "summary": info.summary,
        "reason": info.reason,
        "help": info.help or None,
    }


def column_form(bound: BoundRule) -> bool:
    """Whether every named function of the rule has a form over columns, as an engine of columns needs it; C-QoS has none yet."""
    functions = bound.bound.vocabulary.functions
    used = (getattr(node, "name", "") for node in bound.rule.condition.walk())
    return all(functions[name].column for name in used if name in functions)


_TABLE_LIMIT: Final = 64
_SAMPLES: Final = {"duration": ("1s", "2s", "infinite"), "count": ("1", "2")}


def rule_table(bound: BoundRule) -> list[dict[str, str]]:
    """Derive the table of a pair rule: every combination of its values (samples for durations and counts), and the answer.

    Each row maps ``offered NAME`` / ``requested NAME`` to a value, and ``compatible`` to Yes or No, options at their defaults.
    Rules over other scopes, and over values that cannot be enumerated, have no table.
    """
    from itertools import product

    vocabulary = bound.bound.vocabulary
    compared = [use for use in bound.bound.uses if use.term.scope in {"offered", "requested"}]
    assumed = assumed_options(bound)
    if bound.scope != "pair" or not compared or len(compared) + len(assumed) < len(bound.bound.uses):
        return []
    columns = []
    for use in sorted(compared, key=lambda use: use.second):
        domain = vocabulary.policies[use.index].domain
        values = domain.candidates() or tuple(domain.parse(text) for text in _SAMPLES.get(domain.kind, ()))
        columns.append([(use, value, domain.format(value)) for value in values])
    size = 1
    for column in columns:
        size *= len(column)
    if not 0 < size <= _TABLE_LIMIT:
        return []
    rows = []
    for chosen in product(*columns):
        sides: list[list[Any]] = [[0] * vocabulary.size + [None] * vocabulary.size for _ in range(2)]
        row = {}
        for use, value in assumed:
            sides[use.second][use.index] = value
        for use, value, text in chosen:
            sides[use.second][use.index] = value
            row[f"{use.term.scope} {use.term.name}"] = text
        holds = bound.bound.judge(tuple(sides[0]), tuple(sides[1])).result
        fits = holds if bound.rule.kind != "forbids" else not holds
        rows.append({**row, "compatible": "Yes" if fits else "No"})
    return rows


def assumed_options(bound: BoundRule) -> list[tuple[Use, Plain]]:
    """Options that a rule reads, with the defaults they have."""
    policies = bound.bound.vocabulary.policies
    return [
        (use, policies[use.index].domain.parse(default))
        for use in bound.bound.uses
        if policies[use.index].level == "option" and isinstance(default := policies[use.index].default, str)
    ]
