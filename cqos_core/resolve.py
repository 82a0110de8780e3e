"""From text to values: profiles, presets, defaults, options and dialects, through the pack's policies.

Each endpoint ends as a `QosProfile`, an interned tuple of values that endpoints with equal settings share. Where a
value came from is not stored: `Resolved.origin` finds it again in the layers, for the few values a finding prints.
"""

from __future__ import annotations

from dataclasses import replace
from fnmatch import fnmatchcase
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.codes import CODES
from cqos_core.pack import Dialect, NameContext, nothing_follows
from cqos_core.policy import (
    ENDPOINT,
    NEED,
    Anything,
    Depends,
    OneOf,
    Policy,
    Value,
    is_plain,
    normalise,
)
from cqos_core.problems import InvalidValueError
from cqos_core.reading import (
    can_be_stated,
    depends,
    either,
    fields_of,
    how_written,
    ignored_by,
    read_value,
    spelled,
    word_of,
)
from cqos_core.remarks import core_finding, suggestion
from cqos_core.report import Finding, Severity, Side
from cqos_core.resolved import (
    READ,
    Layer,
    QosProfile,
    Resolved,
    ResolvedParticipant,
    ResolvedSystem,
    Stated,
    Surroundings,
    intern,
)
from cqos_core.system import PUBLISHER, Setting

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from cqos_core.evaluate import Written
    from cqos_core.pack import NameProblem, Naming, Preset, RulePack
    from cqos_core.system import (
        Broker,
        Endpoint,
        Overlay,
        Participant,
        Place,
        Profile,
        ProfileRef,
        Scope,
        Settings,
        System,
    )


# What was read in earlier systems: a modeler sends much the same again and again.
_MAXIMUM_READ: Final = 20_000
_MOST_LETTERS: Final = 4_096
_NAMED: dict[tuple[Any, ...], Naming] = {}
_SURROUNDINGS: dict[tuple[Any, ...], Surroundings] = {}
_NOTHING_STATED: Final = Layer("explicit", {})


def _remember(memory: dict[tuple[Any, ...], Any], key: tuple[Any, ...], value: Any) -> None:
    """Add to a memory, unless the key has more text than people write; a full one forgets all."""
    if _letters(key) > _MOST_LETTERS:
        return
    if len(memory) >= _MAXIMUM_READ:
        memory.clear()
    memory[key] = value


def _letters(key: object) -> int:
    """How much text a key has."""
    if isinstance(key, str):
        return len(key)
    return sum(map(_letters, key)) if isinstance(key, tuple) else 0


class _User(NamedTuple):
    """Who takes values from profiles; ``topic`` is empty where the names of topics do not matter."""

    dialect: str
    role: str
    topic: str


class Resolver:
    """Resolves one system; everything that endpoints can share is resolved once."""

    def __init__(
        self,
        system: System,
        find_pack: Callable[[str], RulePack | None],
        default: str | None,
        asked: Mapping[int, frozenset[int]] | None = None,
    ) -> None:
        """``asked`` has, by id of a pack, further policies of which somebody asks how they were written."""
        self.system = system
        self.find_pack = find_pack
        self.default = default
        self.asked = asked or {}
        self.result = ResolvedSystem(system)
        self.profile_layers: dict[tuple[int, _User, str, Scope], tuple[tuple[Layer, ProfileRef | None], ...]] = {}
        self.by_topic = any(ref.scope.by_topic for profile in system.profiles.values() for ref in profile.base)
        self.own_layers: dict[tuple[int, str, str], Layer] = {}
        self.said: set[tuple[str, str, Place | None]] = set()
        self.remarks = 0  # findings, those too that were there already
        self.topic_layers: dict[tuple[int, str, str], tuple[tuple[Layer, ...], bool]] = {}
        self.shared: dict[tuple[Any, ...], tuple[QosProfile, tuple[Layer, ...]]] = {}
        self.packless: dict[str, list[Endpoint]] = {}
        self.chosen: dict[str | None, RulePack | None] = {}
        self.ignored: dict[tuple[Any, ...], str | None] = {}
        self.option_layers: dict[int, Layer] = {}
        self.surroundings: dict[tuple[Any, ...], Surroundings] = {}
        self.overlay_layers: dict[tuple[int, int], Layer] = {}
        self.overlays_used: set[int] = set()
        self.overlays_laid: set[int] = set()
        self.took_effect: set[tuple[int, int]] = set()
        self.gave_way: dict[tuple[int, int], tuple[str, Stated]] = {}
        self.name_problems: dict[tuple[NameProblem, str, str], list[Endpoint]] = {}
        self.ids: set[str] = set()
        self.clashes = False
        self.broker_layers: dict[tuple[int, str], tuple[Layer, ...]] = {}
        self.brokerless: dict[str, dict[str, Participant]] = {}
        self.participant_facts: dict[str, Settings] = {}
        self.endpoint_facts: dict[int, Settings] = {}
        self.implied: list[Endpoint] = []
        self.completed = False
        self._complete()

    def run(self) -> ResolvedSystem:
        """Resolve every endpoint of the system."""
        for endpoint in (*self.system.endpoints, *self.implied):
            self.stated(endpoint)
        for participant in self.system.participants.values():
            # What a participant states is checked even where it has no endpoint.
            pack = self._pack_of(participant.protocol or self.system.protocol or self.default)
            if pack is not None:
                self._participant(participant, pack)
        self.report_rest()
        return self.result

    def _complete(self) -> None:
        """Ask the packs in use what follows from all that is stated."""
        for protocol in _protocols_in_use(self.system, self.default):
            pack = self._pack_of(protocol)
            if pack is None or pack.complete is nothing_follows:
                continue
            self.completed = True
            stated = [each for each in self.system.endpoints if self._protocol_of(each) == pack.id]
            owners = {each.participant for each in stated}
            participants = [
                each
                for each in self.system.participants.values()
                if each.id in owners or (each.protocol or self.system.protocol or self.default) == pack.id
            ]
            completion = pack.complete(participants, stated, self._brokers(pack))
            self.participant_facts.update(completion.participants)
            self.endpoint_facts.update({id(stated[at]): facts for at, facts in completion.endpoints.items()})
            self.implied += completion.implied

    def _protocol_of(self, endpoint: Endpoint) -> str | None:
        owner = self.system.participants[endpoint.participant]
        return endpoint.protocol or owner.protocol or self.system.protocol or self.default

    def stated(self, endpoint: Endpoint) -> None:
        """Resolve one endpoint as it is stated; it may stand for several."""
        participant = self.system.participants[endpoint.participant]
        protocol = self._protocol_of(endpoint)
        facts = self.endpoint_facts.get(id(endpoint))
        if facts:
            endpoint = replace(endpoint, settings={**endpoint.settings, **facts})
        pack = self._pack_of(protocol)
        if pack is None:
            self.packless.setdefault(protocol or "", []).append(endpoint)
            return
        owner = self._participant(participant, pack)
        for expanded in pack.meeting.expand(endpoint):
            identifier = self._unique(expanded.id)
            self.result.endpoints.append(self._resolved(expanded, owner, identifier, endpoint.id))

    def report_rest(self) -> None:
        """Report what was read but is judged by nobody."""
        self._report_packless()
        self._report_names()
        self._report_needs()
        self._report_overlays()
        self._report_brokerless()

    def _pack_of(self, protocol: str | None) -> RulePack | None:
        if protocol in self.chosen:
            return self.chosen[protocol]
        chosen = self.find_pack(protocol) if protocol is not None else None
        if chosen is not None:
            chosen = choose_variant(chosen, self.system.options.get(chosen.id, {}))
            self.result.packs[chosen.id] = chosen
        self.chosen[protocol] = chosen
        return chosen

    def _report_brokerless(self) -> None:
        for _, participants in sorted(self.brokerless.items()):
            ids = sorted(participants)
            more = f" and {len(ids) - 1} more" if len(ids) > 1 else ""
            verb = "do" if more else "does"
            message = f"`{ids[0]}`{more} {verb} not say which of several brokers {'they connect' if more else 'it connects'} to"
            advice = f"state `broker:` with one of {', '.join(sorted(self.system.brokers))}"
            place = participants[ids[0]].place
            self._add("CQ216", message, place, "participant", ids, advice, Severity.WARNING)

    def _report_overlays(self) -> None:
        """Report overlays, and settings of theirs, that are without effect."""
        for index, overlay in enumerate(self.system.overlays):
            if index not in self.overlays_used:
                message = f"{overlay.name} covers no endpoint: nothing matches {_covering(overlay)}"
                self._add("CQ214", message, overlay.place, "system")
            elif index not in self.overlays_laid:
                message = (
                    f"{overlay.name} covers only endpoints that were observed, and changes nothing of what was seen"
                )
                self._add("CQ214", message, overlay.place, "system", severity=Severity.NOTE)
        for key, (policy, stated) in self.gave_way.items():
            if key not in self.took_effect:
                overlay = self.system.overlays[key[0]]
                message = (
                    f"{overlay.name} sets `{policy}` to {stated.text}, but all endpoints that it covers have their own"
                )
                advice = f"state `{overlay.fills[0]}` where it is to decide"
                self._add("CQ215", message, stated.setting.place or overlay.place, "system", (), advice)

    def _report_names(self) -> None:
        """Report what is wrong with names, each once with all endpoints that use it."""
        for (problem, shown, pack_id), endpoints in self.name_problems.items():
            rule = self.result.packs[pack_id].rule(problem.code)
            core = CODES.get(problem.code)
            first = min(endpoints, key=lambda endpoint: endpoint.id)
            finding = Finding(
                code=problem.code,
                name=rule.name if rule else core.name if core else problem.code.lower(),
                severity=Severity(problem.severity),
                message=problem.message,
                source=pack_id,
                topic=shown,
                sides=(Side(first.role, tuple(sorted(endpoint.id for endpoint in endpoints)), place=first.place),),
                because=rule.because if rule else "",
                clause=rule.clause if rule else "",
                help=problem.help or None,
            )
            self.result.findings.append(finding)

    def _report_packless(self) -> None:
        for protocol, endpoints in self.packless.items():
            endpoints.sort(key=lambda endpoint: endpoint.id)
            ids = [endpoint.id for endpoint in endpoints]
            message = (
                f"no installed pack judges protocol `{protocol}`: {len(ids)} endpoints are left out"
                if protocol
                else f"no protocol is stated for {len(ids)} endpoints, so nothing judges them"
            )
            help_text = None if protocol else "state `protocol:` in the file, or give --protocol ID"
            self._add("CQ201", message, endpoints[0].place, "endpoint", ids, help_text)

    def _report_needs(self) -> None:
        packs = {each.stated_id: each.pack for each in self.result.endpoints}
        needing = sorted(
            (each for each in self.system.endpoints if each.needs and each.id in packs and not packs[each.id].needs),
            key=lambda each: each.id,
        )
        if needing:
            message = f"no installed pack judges `needs`: those of {len(needing)} endpoints were read but not compared"
            place = next(iter(needing[0].needs.values())).place
            self._add("CQ211", message, place, "subscriber", [endpoint.id for endpoint in needing])

    def _add(
        self,
        code: str,
        message: str,
        place: Place | None,
        role: str,
        members: Sequence[str] = (),
        help_text: str | None = None,
        severity: Severity | None = None,
    ) -> None:
        finding = core_finding(
            code, message, place=place, role=role, members=members, help=help_text, severity=severity
        )
        self.remarks += 1
        self.result.findings.append(finding)

    # Participants and options

    def _participant(self, participant: Participant, pack: RulePack) -> ResolvedParticipant:
        key = (participant.id, id(pack))
        found = self.result.participants.get(key)
        if found is None:
            found = self.result.participants[key] = self._make_participant(participant, pack)
        return found

    def _make_participant(self, participant: Participant, pack: RulePack) -> ResolvedParticipant:
        owner = f"participant `{participant.label or participant.id}`"
        settings = participant.settings
        if facts := self.participant_facts.get(participant.id):
            settings = {**settings, **facts}
        stated = _NOTHING_STATED
        if settings:
            levels, spoken = ("participant", "option"), pack.dialects.get("yaml")
            own = self._recognise(pack, levels, settings, spoken, owner, "participant", [participant.id])
            stated = Layer("explicit", own)
        layers: tuple[Layer, ...] = (stated, self._options(pack))
        broker = self._broker_of(stated.settings, participant, pack) if self.system.brokers else None
        key = (pack, broker and broker.id, *map(_texts, layers))
        memory = _SURROUNDINGS if broker is None else self.surroundings
        shared = memory.get(key)
        if shared is None:
            before = self.remarks
            shared = self._surroundings(participant, pack, layers, owner, broker)
            if self.remarks == before:
                _remember(memory, key, shared)
        if broker is not None:
            layers += self._broker_layers(broker, pack)
        return ResolvedParticipant(participant, pack, shared, layers)

    def _options(self, pack: RulePack) -> Layer:
        """The system's options for a pack."""
        layer = self.option_layers.get(id(pack))
        if layer is None:
            stated = self.system.options.get(pack.id, {})
            found = self._recognise(pack, ("option",), stated, None, f"options of `{pack.id}`", "system", [])
            layer = self.option_layers[id(pack)] = Layer("option", found)
        return layer

    def _surroundings(
        self, participant: Participant, pack: RulePack, layers: Sequence[Layer], owner: str, broker: Broker | None
    ) -> Surroundings:
        values: dict[int, Value] = {}
        for index, policy in enumerate(pack.policies):
            if policy.level == "option":
                values[index] = self._option(pack, index, policy, layers, participant)
        for index, policy in enumerate(pack.policies):
            if policy.level == "participant":
                values[index] = self._value(
                    pack, index, policy, PUBLISHER, layers, values, None, owner, participant.place
                )
        values |= self._broker_values(pack, broker, values)
        texts = {
            pack.policies[index].name: stated.text
            for layer in reversed(layers)
            for index, stated in layer.settings.items()
        }
        return Surroundings(values, texts)

    def _option(
        self, pack: RulePack, index: int, policy: Policy, layers: Sequence[Layer], participant: Participant
    ) -> Value:
        for layer in layers:
            stated = layer.settings.get(index)
            if stated is None:
                continue
            meaning = policy.words.get(normalise(stated.text))
            if isinstance(meaning, OneOf):
                return depends(pack, policy, meaning.values)
            try:
                return policy.domain.parse(stated.text)
            except InvalidValueError as problem:
                place = stated.setting.place or participant.place
                if policy.fallback is not None:
                    message = f"option `{policy.name}`: {problem.message}; `{policy.fallback}` stands in"
                    self._add_once("CQ208", message, place, f"expected {problem.expected}")
                    return policy.domain.parse(policy.fallback)
                self._add_once(
                    "CQ203", f"option `{policy.name}`: {problem.message}", place, f"expected {problem.expected}"
                )
                return Anything(f"option {policy.name} has no valid value", told=True)
        if isinstance(policy.default, str):
            return policy.domain.parse(policy.default)
        names = policy.assume or tuple(policy.domain.format(value) for value in policy.domain.candidates())
        if not policy.assume:
            return Anything(f"option {policy.name} is not set")
        return depends(pack, policy, names)

    def _add_once(self, code: str, message: str, place: Place | None, help_text: str = "") -> None:
        self.remarks += 1
        finding = core_finding(code, message, place=place, help=help_text or None)
        if finding not in self.result.findings:
            self.result.findings.append(finding)

    # Settings to policies

    def _recognise(
        self,
        pack: RulePack,
        levels: tuple[str, ...],
        settings: Settings,
        dialect: Dialect | None,
        owner: str,
        role: str,
        members: Sequence[str],
    ) -> dict[int, Stated]:
        found: dict[int, Stated] = {}
        for name, setting in settings.items():
            if dialect is not None and normalise(name) in dialect.ignore:
                continue
            if fields := fields_of(pack, levels, name, setting):
                found.update(fields)
                continue
            index = next((i for level in levels if (i := pack.find(level, name, dialect)) is not None), None)
            if index is None or not can_be_stated(pack.policies[index]):
                known = [
                    policy.name.removeprefix("need.")
                    for policy in pack.policies
                    if policy.level in levels and can_be_stated(policy)
                ]
                self._add(
                    "CQ202",
                    f"{owner} states `{name}`, which {pack.title} does not know",
                    setting.place,
                    role,
                    members,
                    suggestion(name, known),
                )
                continue
            text = spelled(pack.policies[index], setting.text, dialect)
            if text is None:
                continue
            if index in found and found[index].text != text:
                message = f"{owner} states `{pack.policies[index].name}` twice, as {found[index].text} and as {text}"
                self._add("CQ209", message, setting.place, role, members)
            found[index] = Stated(text, setting, name)
        return found

    # Profiles and presets

    def _layers_of(
        self, refs: Sequence[ProfileRef], pack: RulePack, user: _User, participant: ResolvedParticipant
    ) -> Iterator[Layer]:
        """Layers of the profiles that ``refs`` name, nearest first."""
        for ref in reversed(refs):
            for layer, preset in self._profile(ref, pack, user):
                if preset is not None:
                    # What was read once for all is told where it is used.
                    self._check_available(ref if ref.name == preset.name else preset, pack, participant)
                yield layer

    def _profile(self, ref: ProfileRef, pack: RulePack, user: _User) -> tuple[tuple[Layer, ProfileRef | None], ...]:
        """The layers of a profile and of all it is based on, nearest first, each once; presets with where they are named."""
        key = (id(pack), user, ref.name, ref.scope)
        known = self.profile_layers.get(key)
        if known is not None:
            return known
        found: dict[tuple[str, str | None], tuple[Layer, ProfileRef | None]] = {}
        trail: dict[str, None] = {}
        waiting: list[tuple[Iterator[ProfileRef], str | None]] = [(iter((ref,)), None)]
        while waiting:
            refs, part = waiting[-1]
            each = next(refs, None)
            if each is None:
                waiting.pop()
                if trail:
                    trail.popitem()
            elif not each.scope.covers(user.role, user.topic, part):
                continue
            elif each.name in trail:
                names = list(trail)
                self._report_circle(names[names.index(each.name) :])
            elif (each.name, part := part or each.scope.part) not in found:
                own = self.system.profiles.get(each.name)
                layer = self._preset(each, pack) if own is None else self._own_layer(own, pack, user.dialect)
                if layer is not None:
                    found[each.name, part] = (layer, each if own is None else None)
                trail[each.name] = None
                waiting.append((iter(() if own is None else own.base[::-1]), part))
        if found:
            # Where a name is no profile, each place that uses it is told.
            self.profile_layers[key] = tuple(found.values())
        return tuple(found.values())

    def _report_circle(self, names: Sequence[str]) -> None:
        """Print a circle of profiles, from the first of its names on, whoever was met first."""
        start = names.index(min(names))
        circle = [*names[start:], *names[:start], names[start]]
        base = self.system.profiles[circle[0]].base
        place = next(ref.place for ref in base if ref.name == circle[1])
        self._add_once("CQ212", f"profiles are based on each other in a circle: {' → '.join(circle)}", place)

    def _own_layer(self, own: Profile, pack: RulePack, dialect_name: str) -> Layer:
        key = (id(pack), dialect_name, own.name)
        layer = self.own_layers.get(key)
        if layer is None:
            dialect = pack.dialects.get(dialect_name, pack.dialects.get("yaml"))
            owner = f"profile `{own.name}`"
            found = self._recognise(pack, (ENDPOINT,), own.settings, dialect, owner, "profile", [own.name])
            preset_name = pack.preset_names.get(normalise(own.name))
            if preset_name is not None:
                self._shadowing(own.name, preset_name, found, pack, own.place)
            layer = self.own_layers[key] = Layer(f"profile {own.name}", found)
        return layer

    def _shadowing(
        self, name: str, preset_name: str, found: Mapping[int, Stated], pack: RulePack, place: Place | None
    ) -> None:
        preset = pack.presets[preset_name].settings
        differing = [
            pack.policies[index].name
            for index, stated in found.items()
            if normalise(stated.text) != normalise(preset.get(pack.policies[index].name, stated.text))
        ]
        if differing:
            message = (
                f"profile `{name}` has the name of a {pack.title} preset but other values of {', '.join(differing)}"
            )
            self._add_once("CQ206", message, place, "")

    def _preset(self, ref: ProfileRef, pack: RulePack) -> Layer | None:
        name = pack.preset_names.get(normalise(ref.name))
        if name is None or pack.presets[name].level != ENDPOINT:
            parts = {each.name for own in self.system.profiles.values() for each in own.base if each.scope.part}
            presets = (name for name, each in pack.presets.items() if each.level == ENDPOINT)
            known = (*(name for name in self.system.profiles if name not in parts), *presets)
            message = f"profile `{ref.name}` is neither defined nor a preset of {pack.title}"
            self._add_once("CQ204", message, ref.place, suggestion(ref.name, known))
            return None
        return Layer(f"preset {name}", self._preset_settings(name, pack), counts_as_stated=False)

    def _check_available(self, ref: ProfileRef, pack: RulePack, participant: ResolvedParticipant) -> None:
        name = pack.preset_names[normalise(ref.name)]
        if not _available(pack.presets[name], pack, participant):
            option, least = pack.presets[name].needs or ("", "")
            actual = participant.texts.get(option, "")
            message = f"preset `{name}` exists from {option} {least} on, this participant has {option} {actual}"
            self._add_once("CQ207", message, ref.place)

    def _preset_settings(self, name: str, pack: RulePack) -> dict[int, Stated]:
        return {
            pack.vocabulary.indices[pack.presets[name].level, policy]: Stated(text, Setting(text))
            for policy, text in pack.presets[name].settings.items()
        }

    # Topics

    def _name(self, endpoint: Endpoint, participant: ResolvedParticipant) -> Naming | None:
        if endpoint.topic is None:
            return None
        pack, owner = participant.pack, participant.participant
        key = (
            *(pack, participant.surroundings, owner.id, owner.label, tuple(owner.remap.items())),
            *(endpoint.topic, endpoint.kind, endpoint.dialect, endpoint.role),
        )
        naming = _NAMED.get(key)
        if naming is None:
            context = NameContext(
                owner.id,
                owner.label,
                participant.texts,
                owner.remap,
                endpoint.kind,
                endpoint.dialect,
                endpoint.role,
            )
            naming = pack.meeting.resolve(endpoint.topic, context)
            _remember(_NAMED, key, naming)
        for problem in naming.problems:
            self.name_problems.setdefault((problem, naming.shown, pack.id), []).append(endpoint)
        return naming

    def _topic(self, written: str, naming: Naming, pack: RulePack) -> tuple[tuple[Layer, ...], bool]:
        """Topic-level layers, nearest first, and whether the topic is external."""
        key = (id(pack), naming.key or "", written)
        found = self.topic_layers.get(key)
        if found is not None:
            return found
        layers: list[Layer] = []
        conventions = _conventions if _letters(naming.key) <= _MOST_LETTERS else _conventions.__wrapped__
        conventional, external = conventions(pack, naming.key)
        for name in dict.fromkeys((written, naming.shown, naming.key)) if self.system.topics else ():
            stated = self.system.topics.get(name) if name is not None else None
            if stated is not None and stated.protocol in {None, pack.id}:
                settings = self._recognise(
                    pack,
                    ("topic",),
                    stated.settings,
                    pack.dialects.get("yaml"),
                    f"topic `{stated.name}`",
                    "topic",
                    [stated.name],
                )
                layers.append(Layer("topic", settings))
                external = external or stated.external
        found = self.topic_layers[key] = ((*layers, *conventional), external)
        return found

    # Endpoints

    def resolved(
        self, endpoint: Endpoint, owner: Participant, pack: RulePack, identifier: str, stated_id: str
    ) -> Resolved:
        """Resolve one endpoint with one pack, under the given id; see `Resolved` for the two ids."""
        return self._resolved(endpoint, self._participant(owner, pack), identifier, stated_id)

    def _resolved(
        self, endpoint: Endpoint, participant: ResolvedParticipant, identifier: str, stated_id: str
    ) -> Resolved:
        pack, owner = participant.pack, participant.participant
        naming = self._name(endpoint, participant)
        written = endpoint.topic or ""
        topic_layers, topic_external = self._topic(written, naming, pack) if naming is not None else ((), False)
        overlays = tuple(self._overlays(endpoint, naming, participant)) if self.system.overlays else ()
        profile, layers = self._profile_of(endpoint, participant, naming, topic_layers, overlays, identifier)
        return Resolved(
            endpoint,
            identifier,
            stated_id,
            pack,
            naming.key if naming is not None else None,
            naming.shown if naming is not None else "",
            profile,
            layers,
            participant,
            endpoint.external or owner.external or topic_external,
        )

    def _profile_of(
        self,
        endpoint: Endpoint,
        participant: ResolvedParticipant,
        naming: Naming | None,
        topic_layers: tuple[Layer, ...],
        overlays: tuple[int, ...],
        identifier: str,
    ) -> tuple[QosProfile, tuple[Layer, ...]]:
        """The values of an endpoint and their layers; those of an equal one, if nothing had to be said of it."""
        stated = (
            *(participant.pack, participant.surroundings),
            *(endpoint.role, endpoint.dialect, endpoint.observed, endpoint.type),
            tuple([(name, setting.text) for name, setting in endpoint.settings.items()]),
            tuple([(name, setting.text) for name, setting in endpoint.overlay.items()]),
            tuple([(layer.counts_as_stated, _texts(layer)) for layer in topic_layers]),
        )
        alone = not (endpoint.profiles or endpoint.needs or overlays or self.asked or self.by_topic)
        if alone:
            # Nothing of it stands elsewhere in its system, so it has the values of an equal one in any other.
            read = READ.get(stated)
            if read is not None:
                return read[0], read[1] + topic_layers
        by_topic = self.by_topic or any(ref.scope.by_topic for ref in endpoint.profiles)
        user = _User(endpoint.dialect, endpoint.role, naming.shown if naming is not None and by_topic else "")
        signature = (
            *stated,
            *(overlays, id(topic_layers), user),
            tuple([(ref.name, ref.scope) for ref in endpoint.profiles]),
            tuple([(name, setting.text) for name, setting in endpoint.needs.items()]),
        )
        shared = self.shared.get(signature)
        if shared is None:
            before = self.remarks
            own = self._resolve(endpoint, identifier, participant, user, topic_layers, overlays)
            shared = own[0], own[1] + topic_layers
            if self.remarks == before:
                self.shared[signature] = shared
                if alone:
                    _remember(READ, stated, own)
        return shared

    def _overlays(self, endpoint: Endpoint, naming: Naming | None, participant: ResolvedParticipant) -> Iterator[int]:
        """Yield the indices of the overlays that cover an endpoint; what was observed is so, whatever files say."""
        pack = participant.pack
        covers = pack.meeting.covers
        addresses = (pack.meeting.address(endpoint.participant, participant.texts), endpoint.participant)
        topics = (naming.key or naming.shown, naming.shown) if naming is not None else ()
        for index, overlay in enumerate(self.system.overlays):
            if (
                overlay.protocol in {None, pack.id}
                and overlay.role in {None, endpoint.role}
                and any(fnmatchcase(name, overlay.topic) for name in topics)
                and any(covers(overlay.participant, address) for address in addresses)
                and (overlay.entity is None or overlay.entity == endpoint.id)
                and self._holds(overlay, participant) is not False
            ):
                self.overlays_used.add(index)
                if not endpoint.observed:
                    self.overlays_laid.add(index)
                    yield index

    def _holds(self, overlay: Overlay, participant: ResolvedParticipant) -> bool | None:
        """Whether the option under which an overlay holds has its value; None where that is not known."""
        if overlay.when is None:
            return True
        option, wanted = overlay.when
        pack = participant.pack
        index = pack.vocabulary.indices.get(("option", option))
        if index is None:
            return False
        value, expected = participant.values[index], pack.policies[index].domain.parse(wanted)
        if isinstance(value, Depends):
            return None if any(case == expected for _, case in value.cases) else False
        return value == expected if is_plain(value) else None

    def _lay_over(
        self, layers: Sequence[Layer], overlays: Sequence[int], participant: ResolvedParticipant
    ) -> tuple[list[Layer], dict[tuple[str, str], list[Layer]]]:
        """Return ``layers`` with the overlays that hold, and those that hold under a value of an option not known."""
        own, *beneath = layers
        covering = [(index, self.system.overlays[index]) for index in overlays]
        over = [
            self._overlay_layer(index, participant.pack)
            for index, overlay in reversed(covering)
            if not overlay.fills and self._holds(overlay, participant)
        ]
        stated = [own, *over, *beneath]
        certain = list(stated)
        possible: dict[tuple[str, str], list[Layer]] = {}
        for index, overlay in covering:
            layer = self._overlay_layer(index, participant.pack)
            if overlay.fills:
                layer = self._filling(index, layer, stated, participant.pack)
            if not self._holds(overlay, participant):
                possible.setdefault(overlay.when or ("", ""), []).insert(0, layer)
            elif overlay.fills:
                certain.insert(0, layer)
        return certain, possible

    def _filling(self, overlay: int, layer: Layer, stated: Sequence[Layer], pack: RulePack) -> Layer:
        """Return what an overlay sets where ``stated`` leaves it to others; to all else it gives way."""
        fills = self.system.overlays[overlay].fills
        taken = {}
        for index, setting in layer.settings.items():
            policy = pack.policies[index]
            found = next((one.settings[index].text for one in stated if index in one.settings), None)
            if found is None or word_of(policy, found) in fills:
                taken[index] = setting
                self.took_effect.add((overlay, index))
            elif policy.word(found) != policy.word(setting.text):
                self.gave_way.setdefault((overlay, index), (policy.name, setting))
        return replace(layer, settings=taken)

    def _unique(self, identifier: str) -> str:
        """Return ``identifier``, with a number where an endpoint of another source already has it."""
        unique, number = identifier, 2
        self.clashes = self.clashes or identifier in self.ids
        while unique in self.ids:
            unique, number = f"{identifier}~{number}", number + 1
        self.ids.add(unique)
        return unique

    def _resolve(
        self,
        endpoint: Endpoint,
        identifier: str,
        participant: ResolvedParticipant,
        user: _User,
        topic_layers: tuple[Layer, ...],
        overlays: tuple[int, ...],
    ) -> tuple[QosProfile, tuple[Layer, ...]]:
        pack = participant.pack
        dialect = pack.dialects.get(endpoint.dialect, pack.dialects.get("yaml"))
        owner = f"{endpoint.role} `{identifier}`"
        overlay = self._recognise(
            pack, (ENDPOINT,), endpoint.overlay, dialect, f"overlay of {owner}", endpoint.role, [identifier]
        )
        explicit = self._recognise(pack, (ENDPOINT,), endpoint.settings, dialect, owner, endpoint.role, [identifier])
        type_index = pack.find(ENDPOINT, "type")
        if endpoint.type is not None and type_index is not None:
            explicit.setdefault(type_index, Stated(endpoint.type, Setting(endpoint.type, endpoint.place)))
        written = Layer("explicit", explicit, here=True)
        layers = [
            Layer("overlay", overlay, here=True),
            written,
            *self._layers_of(endpoint.profiles, pack, user, participant),
        ]
        if pack.base_preset is not None and not endpoint.observed:
            settings = self._preset_settings(pack.base_preset, pack)
            origin = f"preset {pack.base_preset}"
            layers.append(Layer(origin, settings, counts_as_stated=False, assumed=True))
        layers, possible = self._lay_over(layers, overlays, participant)
        needs = self._needs(endpoint, pack, owner, identifier)
        values: list[Any] = []
        words: list[Written | None] = []
        asked = pack.asked | self.asked.get(id(pack), frozenset())
        for index, policy in enumerate(pack.policies):
            words.append(None)
            if policy.level == ENDPOINT:
                if endpoint.role not in policy.roles:
                    self._without_effect(policy, index, written, owner, endpoint, identifier)
                value = self._own_value(index, layers, endpoint, participant, identifier)
                for when, extra in possible.items():
                    if any(index in layer.settings for layer in extra):
                        then = self._own_value(index, [*extra, *layers], endpoint, participant, identifier)
                        value = either(participant, when, then, value)
                values.append(value)
                if index in asked:
                    words[index] = how_written(policy, index, layers)
            elif policy.level == NEED:
                where = endpoint.place
                values.append(
                    self._value(pack, index, policy, endpoint.role, (needs,), {}, None, owner, where, member=identifier)
                )
            elif policy.level == "topic":
                values.append(
                    self._value(
                        pack,
                        index,
                        policy,
                        endpoint.role,
                        topic_layers,
                        participant.values,
                        None,
                        f"topic `{endpoint.topic}`",
                        None,
                    )
                )
            else:
                values.append(participant.values[index])
        beside = (replace(layer, overlay="may_hold") for extra in possible.values() for layer in extra)
        return intern(pack, (*values, *words)), (*beside, *layers, needs)

    def _needs(self, endpoint: Endpoint, pack: RulePack, owner: str, identifier: str) -> Layer:
        """What the application of an endpoint needs, as far as the pack gives such guarantees."""
        if not pack.needs:
            return Layer("explicit", {})
        found = self._recognise(pack, (NEED,), endpoint.needs, None, f"`needs` of {owner}", endpoint.role, [identifier])
        for index, stated in found.items():
            word = next((name for name, (at, _) in pack.needs.items() if at == index), None)
            if word is not None and word not in pack.guaranteed:
                message = f"{owner} needs {word}, of which {pack.title} says nothing: it was not compared"
                self._add("CQ211", message, stated.setting.place, endpoint.role, [identifier])
        return Layer("explicit", found)

    def _own_value(
        self,
        index: int,
        layers: Sequence[Layer],
        endpoint: Endpoint,
        participant: ResolvedParticipant,
        identifier: str,
    ) -> Value:
        """Read a value of an endpoint from the nearest of ``layers`` that states it."""
        pack = participant.pack
        return self._value(
            pack,
            index,
            pack.policies[index],
            endpoint.role,
            layers,
            participant.values,
            pack.dialects.get(endpoint.dialect, pack.dialects.get("yaml")),
            f"{endpoint.role} `{identifier}`",
            endpoint.place,
            observed=endpoint.observed,
            member=identifier,
        )

    def _overlay_layer(self, index: int, pack: RulePack) -> Layer:
        overlay = self.system.overlays[index]
        layer = self.overlay_layers.get((id(pack), index))
        if layer is None:
            dialect = pack.dialects.get(overlay.dialect, pack.dialects.get("yaml"))
            found = self._recognise(pack, (ENDPOINT,), overlay.settings, dialect, overlay.name, "system", [])
            layer = self.overlay_layers[id(pack), index] = Layer(overlay.name, found, overlay="holds")
        return layer

    def _without_effect(
        self, policy: Policy, index: int, explicit: Layer, owner: str, endpoint: Endpoint, identifier: str
    ) -> None:
        stated = explicit.settings.get(index)
        if stated is not None:
            roles = " and ".join(policy.roles) or "no endpoint"
            message = f"{owner} states `{policy.name}`, which only a {roles} has"
            self._add("CQ210", message, stated.setting.place, endpoint.role, [identifier])

    # Brokers

    def _broker_values(self, pack: RulePack, broker: Broker | None, options: Mapping[int, Value]) -> dict[int, Value]:
        layers = self._broker_layers(broker, pack)
        owner, place = ("broker", None) if broker is None else (f"broker `{broker.id}`", broker.place)
        return {
            index: self._value(pack, index, policy, PUBLISHER, layers, options, None, owner, place)
            for index, policy in enumerate(pack.policies)
            if policy.level == "broker"
        }

    def _broker_layers(self, broker: Broker | None, pack: RulePack) -> tuple[Layer, ...]:
        """What is stated of a broker, nearest first: itself, then its profiles and presets."""
        if broker is None:
            return ()
        known = self.broker_layers.get((id(pack), broker.id))
        if known is None:
            owner = f"broker `{broker.id}`"
            own = self._recognise(pack, ("broker",), broker.settings, None, owner, "broker", [broker.id])
            known = (Layer("explicit", own), *self._profiles_of_broker(broker.profiles, pack, {broker.id}))
            self.broker_layers[id(pack), broker.id] = known
        return known

    def _profiles_of_broker(self, refs: Sequence[ProfileRef], pack: RulePack, trail: set[str]) -> Iterator[Layer]:
        for ref in reversed(refs):
            own = self.system.profiles.get(ref.name)
            preset = pack.preset_names.get(normalise(ref.name))
            if own is not None and own.name not in trail:
                owner = f"profile `{own.name}`"
                found = self._recognise(pack, ("broker",), own.settings, None, owner, "profile", [own.name])
                yield Layer(f"profile {own.name}", found)
                yield from self._profiles_of_broker(own.base, pack, {*trail, own.name})
            elif own is None and preset is not None and pack.presets[preset].level == "broker":
                yield Layer(f"preset {preset}", self._preset_settings(preset, pack), counts_as_stated=False)
            elif own is None:
                known = (
                    *self.system.profiles,
                    *(name for name, each in pack.presets.items() if each.level == "broker"),
                )
                message = f"profile `{ref.name}` is neither defined nor a preset of a broker of {pack.title}"
                self._add_once("CQ204", message, ref.place, suggestion(ref.name, known))

    def _brokers(self, pack: RulePack) -> dict[str, Broker]:
        default = self.system.protocol or pack.id
        return {name: each for name, each in self.system.brokers.items() if (each.protocol or default) == pack.id}

    def _broker_of(self, own: Mapping[int, Stated], participant: Participant, pack: RulePack) -> Broker | None:
        """The broker that a participant names, else the only one there is."""
        brokers = self._brokers(pack)
        index = next((i for level in ("participant", "option") if (i := pack.find(level, "broker")) is not None), None)
        if index is None or not brokers:
            return None
        stated = own.get(index) or self._options(pack).settings.get(index)
        if stated is not None:
            if stated.text not in brokers:
                message = f"there is no broker `{stated.text}` in the system"
                place = stated.setting.place or participant.place
                self._add_once("CQ216", message, place, suggestion(stated.text, brokers))
            return brokers.get(stated.text)
        if len(brokers) > 1:
            self.brokerless.setdefault(pack.id, {})[participant.id] = participant
            return None
        return next(iter(brokers.values()))

    # Values

    def _value(
        self,
        pack: RulePack,
        index: int,
        policy: Policy,
        role: str,
        layers: Sequence[Layer],
        options: Mapping[int, Value],
        dialect: Dialect | None,
        owner: str,
        place: Place | None,
        *,
        observed: bool = False,
        member: str | None = None,
    ) -> Value:
        stated = next((layer.settings[index] for layer in layers if index in layer.settings), None)
        ignoring = self._ignoring(pack, policy, options)
        if stated is not None and ignoring is not None:
            told = next(layer for layer in layers if index in layer.settings)
            if told.counts_as_stated and not self._is_default(pack, policy, stated.text, role, options, dialect):
                message = f"{owner} states `{policy.name}`, which {ignoring} ignores"
                self._add("CQ205", message, stated.setting.place or place, role, [member] if member else [])
        text = stated.text if stated is not None and ignoring is None else None
        if text is None:
            text = policy.default_for(role)
            if text is None:
                return Anything(f"{policy.name} is not stated")
            if observed and ignoring is None:
                return Anything(f"discovery did not report {policy.name}")
            # A default stands in the spelling of the policy itself.
            dialect = None
        try:
            return read_value(pack, policy, text, role, options, dialect)
        except InvalidValueError as problem:
            where = stated.setting.place if stated is not None and stated.setting.place is not None else place
            message = f"{owner}: `{policy.name}` {problem.message}"
            expected = problem.expected if problem.expected != policy.domain.expected() else policy.expected()
            self.remarks += 1
            if ("CQ203", message, where) not in self.said:
                self.said.add(("CQ203", message, where))
                about, members = (role, [member]) if member else (policy.level, [])
                self._add("CQ203", message, where, about, members, f"expected {expected}")
            return Anything(f"{policy.name} has no valid value", told=True)

    def _is_default(
        self,
        pack: RulePack,
        policy: Policy,
        text: str,
        role: str,
        options: Mapping[int, Value],
        dialect: Dialect | None,
    ) -> bool:
        """Whether a stated text only says what holds anyway."""
        default = policy.default_for(role)
        try:
            return default is not None and read_value(pack, policy, text, role, options, dialect) == read_value(
                pack, policy, default, role, options, None
            )
        except InvalidValueError:
            return False

    def _ignoring(self, pack: RulePack, policy: Policy, options: Mapping[int, Value]) -> str | None:
        """``rmw zenoh`` where the chosen middleware ignores the policy, else None."""
        if not policy.enforced:
            return None
        key = (id(pack), policy.name, tuple(options.get(pack.vocabulary.indices["option", o]) for o in policy.enforced))
        if key not in self.ignored:
            self.ignored[key] = ignored_by(pack, policy, options)
        return self.ignored[key]


def _texts(layer: Layer) -> tuple[tuple[int, str], ...]:
    """What a layer sets, without where."""
    return tuple([(index, stated.text) for index, stated in layer.settings.items()])


@lru_cache(maxsize=_MAXIMUM_READ)
def _conventions(pack: RulePack, key: str | None) -> tuple[tuple[Layer, ...], bool]:
    """What a pack's conventions say of a topic, and whether by them its partners may be elsewhere."""
    layers = []
    external = False
    for convention in pack.conventions:
        if key is not None and fnmatchcase(key, convention.pattern):
            settings = {
                pack.vocabulary.indices["topic", name]: Stated(text, Setting(text))
                for name, text in convention.settings.items()
            }
            layers.append(Layer(f"convention of {convention.pattern}", settings, counts_as_stated=False))
            external = external or convention.external
    return tuple(layers), external


def _covering(overlay: Overlay) -> str:
    """What an overlay is meant for, in words."""
    parts = [f"participant `{overlay.participant}`", f"topic `{overlay.topic}`"]
    if overlay.role is not None:
        parts.append(f"role {overlay.role}")
    if overlay.entity is not None:
        parts.append(f"entity `{overlay.entity}`")
    if overlay.when is not None:
        parts.append(f"{overlay.when[0]} {overlay.when[1]}")
    return ", ".join(parts)


def _available(preset: Preset, pack: RulePack, participant: ResolvedParticipant) -> bool:
    if preset.needs is None:
        return True
    option, least = preset.needs
    index = pack.vocabulary.indices["option", option]
    value = participant.values[index]
    return not isinstance(value, int) or value >= pack.policies[index].domain.parse(least)  # type: ignore[operator]


def choose_variant(pack: RulePack, options: Settings) -> RulePack:
    """Return the variant of ``pack`` that the system's options ask for, or the pack itself."""
    for (option, value), variant in pack.variants.items():
        setting = options.get(option)
        if setting is not None and normalise(setting.text) == value:
            return variant
    return pack


def packs_in_use(
    system: System, find_pack: Callable[[str], RulePack | None], default_protocol: str | None
) -> list[RulePack]:
    """The packs that judge what the system states, by id."""
    found = map(find_pack, _protocols_in_use(system, default_protocol))
    return [choose_variant(pack, system.options.get(pack.id, {})) for pack in found if pack is not None]


def _protocols_in_use(system: System, default: str | None) -> list[str]:
    stated = {each.protocol for each in system.participants.values()}
    stated |= {each.protocol for each in system.endpoints if each.protocol}
    return sorted(filter(None, {protocol or system.protocol or default for protocol in stated}))


def resolve(
    system: System, find_pack: Callable[[str], RulePack | None], default_protocol: str | None = None
) -> ResolvedSystem:
    """Resolve every endpoint of ``system``.

    Args:
        system: as an importer made it.
        find_pack: returns the installed pack of an id, or None.
        default_protocol: judges endpoints for which the system states none.

    Returns:
        The endpoints with values, and findings for unknown settings, values that are none, and the like.
    """
    return Resolver(system, find_pack, default_protocol).run()
