"""Converts any system to one that the YAML form can express: settings in its words, overlays applied, unique ids.

An importer may read settings in a dialect (integer codes, bare seconds, names in free text) or from another
file (overlays). This module converts them to settings of a system file, and notes what the form cannot express.
"""

from __future__ import annotations

from dataclasses import field, replace
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.files.export import ExportEndpoint, export_input, unique_name
from cqos_core.language.domains import Choice
from cqos_core.language.policy import ENDPOINT
from cqos_core.language.values import normalise
from cqos_core.model.dataclass import dataclass
from cqos_core.model.grouping import grouped
from cqos_core.model.settings import Cases, Setting
from cqos_core.model.system import EVERYBODY, PUBLISHER, SUBSCRIBER, Profile, ProfileRef, System
from cqos_core.packs.topic_matching import NameContext
from cqos_core.resolving.reader import spelled

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cqos_core.language.policy import Policy
    from cqos_core.model.settings import Settings
    from cqos_core.model.system import Acceptance, Endpoint, Participant, Role, TeamRule, Topic
    from cqos_core.packs.export import ExportContext
    from cqos_core.packs.pack import RulePack
    from cqos_core.packs.presets import Dialect
    from cqos_core.resolving.layers import Stated
    from cqos_core.resolving.resolved_endpoint import Resolved

KINDS: Final = frozenset({"message", "service_server", "service_client", "action_server", "action_client"})
YAML: Final = "yaml"
_SHARING: Final = 2
_SHARED: Final = 2
"""So many endpoints, at the least, share so many settings, at the least, by a profile of their own."""


@dataclass(slots=True)
class Design:
    """A system in the words of the YAML form.

    Attributes:
        comments: by the id of an endpoint, where its overlaid values come from.
        notes: what the form cannot express and was left out.
    """

    system: System
    comments: dict[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def with_shared_profiles(design: Design) -> Design:
    """Return the design with a profile for settings that several endpoints state alike."""
    system = design.system
    profiles = dict(system.profiles)
    taken = set(profiles)
    alike = grouped(
        (tuple(sorted((name, setting.text) for name, setting in endpoint.settings.items())), endpoint)
        for endpoint in system.endpoints
        if not endpoint.profiles and endpoint.id not in design.comments
    )
    shared: dict[str, ProfileRef] = {}
    for key, endpoints in alike.items():
        if len(endpoints) >= _SHARING and len(key) >= _SHARED:
            number = sum(name.startswith("shared_") for name in taken) + 1
            name = unique_name(f"shared_{number}", taken)
            profiles[name] = Profile(name, endpoints[0].settings)
            shared |= {endpoint.id: ProfileRef(name) for endpoint in endpoints}
    changed = [
        replace(each, settings={}, profiles=(shared[each.id],)) if each.id in shared else each
        for each in system.endpoints
    ]
    return replace(design, system=replace(system, profiles=profiles, endpoints=changed))


def design_of(system: System, context: ExportContext) -> Design:
    """Return ``system`` as a design; nothing in ``system`` is changed."""
    return _Designer(system, context).run()


def is_not_known(setting: Setting) -> bool:
    """Whether the value of a setting is unknown, so that its text has no meaning."""
    return bool(setting.unknown) and isinstance(setting.unknown, str)


@dataclass(frozen=True, slots=True)
class _Spelling:
    """The spelling of some settings: the dialect of a pack, or None for the spelling of the form itself."""

    pack: RulePack | None
    dialect: Dialect | None
    name: str

    @property
    def foreign(self) -> bool:
        """Whether settings have to be translated."""
        return self.pack is not None and self.dialect is not None and self.name != YAML

    def translated(self, settings: Settings) -> Settings:
        """Return settings in the words of the form; unknown settings keep their text."""
        pack = self.pack
        if pack is None:
            return dict(settings)
        found: Settings = {}
        for name, setting in settings.items():
            index = pack.find(ENDPOINT, name, self.dialect)
            if index is None:
                if self.dialect is None or normalise(name) not in self.dialect.ignore:
                    found[name] = setting
                continue
            if is_not_known(setting):
                found[name] = setting
                continue
            policy = pack.policies[index]
            text = spelled(policy, setting.text, self.dialect)
            if isinstance(setting.unknown, Cases) and (open_value := self._open(policy, setting, setting.unknown)):
                found[policy.name if self.foreign else name] = open_value
            elif text is not None:
                found[policy.name if self.foreign else name] = Setting(self._plain(policy, text), setting.place)
        return found

    def _open(self, policy: Policy, setting: Setting, cases: Cases) -> Setting | None:
        """Return an unknown value for one that depends on an assumption; None if all cases have the same value."""
        default = policy.default if isinstance(policy.default, str) else ""
        texts = {
            when: (spelled(policy, text, self.dialect) if text else None) or default for when, text in cases.values
        }
        words = {when: self._plain(policy, text) for when, text in texts.items()}
        if len(set(words.values())) == 1:
            return None
        listed = " or ".join(f"{word} if {when}" for when, word in words.items())
        return Setting("", setting.place, unknown=f"it depends on {cases.assumption}: {listed}")

    def _plain(self, policy: Policy, text: str) -> str:
        """Return a value as the form spells it: ``KEEP_LAST`` as ``keep_last``, a duration in fields with its unit."""
        word = policy.domain.word(text)
        if word in policy.words:
            return word
        if not (self.foreign or isinstance(policy.domain, Choice) or text.startswith("{")):
            return text
        value = policy.domain.read(text)
        is_a_word = value == 0 and policy.zero is not None
        return text if value is None or is_a_word else policy.domain.format(value)


class _Designer:
    """Builds the design of one system."""

    def __init__(self, system: System, context: ExportContext) -> None:
        self.system = system
        judgement = export_input(system, context)
        self.endpoints = judgement.endpoints
        parts = [part.participant for each in self.endpoints for part in each.parts]
        self.participants = grouped((each.participant.id, each) for each in {id(each): each for each in parts}.values())
        self.idle = judgement.idle
        self.profiles = _Profiles(system)
        self.names: dict[str, str] = {}
        self.kept_names: set[str] = set()
        self.comments: dict[str, str] = {}
        self.notes: dict[str, None] = {}

    def run(self) -> Design:
        """Return the design."""
        endpoints = [made for each in self.endpoints if (made := self._endpoint(each)) is not None]
        for overlay in self.idle:
            self.notes[f"{overlay.name}{_at(overlay)} covers no endpoint"] = None
        templates = {each.endpoint.template for each in self.endpoints} - {None}
        if templates:
            self.notes[f"`instances` are written out: {len(templates)} templates as single endpoints"] = None
        system = replace(
            self.system,
            profiles=self.profiles.made(),
            topics=self._topics(),
            endpoints=endpoints,
            overlays=[],
            participants={name: self._participant(each) for name, each in self.system.participants.items()},
            checks=[self._check(each) for each in self.system.checks],
            accept=[self._acceptance(each) for each in self.system.accept],
            notes=[],
        )
        return Design(system, self.comments, (*self.notes, *self.profiles.notes))

    # Endpoints

    def _endpoint(self, each: ExportEndpoint) -> Endpoint | None:
        endpoint = each.endpoint
        if not endpoint.topic:
            self.notes[f"endpoint `{each.id}` names no topic, so there is no place for it"] = None
            return None
        if endpoint.kind not in KINDS:
            self.notes[f"endpoint `{each.id}` is a {endpoint.kind}, for which the form has no key"] = None
            return None
        spelling = _spelling(each)
        settings = spelling.translated(endpoint.settings)
        self._lay_over(each, spelling, settings)
        if endpoint.needs and endpoint.role == PUBLISHER:
            self.notes[f"endpoint `{each.id}` publishes, and only subscribers have needs: its needs are left out"] = (
                None
            )
        return replace(
            endpoint,
            id=each.id,
            topic=self._topic_name(each, spelling),
            settings=settings,
            profiles=self.profiles.used(endpoint.profiles, spelling, _user(each)),
            overlay={},
            needs={} if endpoint.role == PUBLISHER else endpoint.needs,
            type=endpoint.type or None,
            dialect=YAML,
            topic_is_guess=False,
            template=None,
            alternative=False,
            protocol=self._own_protocol(endpoint),
            label=None if endpoint.label == each.id else endpoint.label,
        )

    def _own_protocol(self, endpoint: Endpoint) -> str | None:
        """Return the protocol of an endpoint if it differs from that of its participant, else None."""
        inherited = self.system.participants[endpoint.participant].protocol or self.system.protocol
        return None if endpoint.protocol == inherited else endpoint.protocol

    def _participant(self, participant: Participant) -> Participant:
        protocol = None if participant.protocol == self.system.protocol else participant.protocol
        label = None if participant.label == participant.id else participant.label
        settings = {**participant.settings, **self._laid_over_participant(participant.id)}
        return replace(participant, template=None, protocol=protocol, label=label, settings=settings)

    def _laid_over_participant(self, participant: str) -> Settings:
        """Return what overlays set of a participant, as each pack that judges an endpoint of it reads them."""
        found: Settings = {}
        for resolved in self.participants.get(participant, ()):
            for layer in resolved.layers:
                if layer.overlay == "no":
                    continue
                for index, stated in layer.settings.items():
                    policy, value = resolved.pack.policies[index], resolved.values[index]
                    found[policy.name] = (
                        Setting(policy.domain.format(value), stated.setting.place)
                        if isinstance(value, (int, str, tuple))
                        else Setting("", stated.setting.place, unknown=f"{layer.origin} may set it")
                    )
        return found

    def _lay_over(self, each: ExportEndpoint, spelling: _Spelling, settings: Settings) -> None:
        """Move overlaid values of an endpoint into its own settings, with a comment on their origin."""
        laid = _laid_over(each)
        for name, setting in spelling.translated(each.endpoint.overlay).items():
            laid[name] = ("", setting)
        if any(layer.overlay == "may_hold" for part in each.parts for layer in part.layers):
            self.notes[f"endpoint `{each.id}`: overlays under an option that is not set are left out"] = None
        for name, (_, setting) in laid.items():
            for other in [other for other in settings if _same_policy(spelling.pack, other, name)]:
                del settings[other]
            settings[name] = setting
        if laid:
            said = (f"{name} from {_origin(origin, setting)}" for name, (origin, setting) in laid.items())
            self.comments[each.id] = ", ".join(said)

    def _topic_name(self, each: ExportEndpoint, spelling: _Spelling) -> str:
        """Return a name that resolves to the topic of the endpoint in a system file."""
        written = each.endpoint.topic or ""
        if not spelling.foreign:
            self._keep_name(each, written)
            return written
        meant = [part.key for part in each.parts]
        names = [written, each.parts[0].key] if each.whole is not None else [written]
        for name in names:
            if name and [_key(part, name) for part in each.parts] == meant:
                if name == written:
                    self._keep_name(each, written)
                else:
                    self.names |= dict.fromkeys((written, each.parts[0].shown), name)
                return name
        self.notes[f"endpoint `{each.id}`: `{written}` means another topic in a system file"] = None
        return written

    def _keep_name(self, each: ExportEndpoint, written: str) -> None:
        self.kept_names |= {written, *(part.shown for part in each.parts)}

    # Statements that name topics

    def _topics(self) -> dict[str, Topic]:
        """Return the stated topics under their new names."""
        found: dict[str, Topic] = {}
        for name, topic in self.system.topics.items():
            renamed = self.names.get(name)
            if renamed is not None:
                known = self.system.topics.get(renamed) or found.get(renamed)
                merged = {**known.settings, **topic.settings} if known is not None else dict(topic.settings)
                external = topic.external or (known is not None and known.external)
                found[renamed] = replace(topic, name=renamed, settings=merged, external=external)
            if renamed is None or name in self.kept_names:
                found.setdefault(name, topic)
        return found

    def _check(self, check: TeamRule) -> TeamRule:
        where = tuple((key, self._pattern(text) if key == "topic" else text) for key, text in check.where)
        return replace(check, where=where)

    def _acceptance(self, acceptance: Acceptance) -> Acceptance:
        return replace(acceptance, topic=None if acceptance.topic is None else self._pattern(acceptance.topic))

    def _pattern(self, text: str) -> str:
        """Return a pattern over topics; the former name of a topic becomes its new name."""
        return self.names.get(text, text)


def _spelling(each: ExportEndpoint) -> _Spelling:
    if not each.parts:
        return _Spelling(None, None, each.endpoint.dialect)
    pack = each.parts[0].pack
    return _Spelling(pack, pack.dialects.get(each.endpoint.dialect), each.endpoint.dialect)


def _laid_over(each: ExportEndpoint) -> dict[str, tuple[str, Setting]]:
    """Return overlay and value of each policy whose value an overlay gives to all parts of the endpoint."""
    first, *others = map(_overlaid, each.parts) if each.parts else [{}]
    return {name: given for name, given in first.items() if all(other.get(name) == given for other in others)}


def _overlaid(part: Resolved) -> dict[str, tuple[str, Setting]]:
    """Return overlay and value of each policy whose value an overlay gives."""
    found: dict[str, tuple[str, Setting] | None] = {}
    for layer in (each for each in part.layers if each.overlay != "may_hold"):  # the nearest first
        for index, stated in layer.settings.items():
            given = (layer.origin, _overlay_setting(stated)) if layer.overlay == "holds" else None
            found.setdefault(part.pack.policies[index].name, given)
    return {name: given for name, given in found.items() if given is not None}


def _overlay_setting(stated: Stated) -> Setting:
    """Return a setting of an overlay; if its value is not known, with the cause."""
    unknown = stated.setting.unknown
    cause = f"it depends on {unknown.assumption}" if isinstance(unknown, Cases) else unknown
    return Setting("" if cause else stated.text, stated.setting.place, unknown=cause)


def _key(part: Resolved, name: str) -> str | None:
    """Return the topic to which ``name`` resolves in a system file, at the participant of ``part``."""
    owner = part.participant
    stated = owner.participant
    kind = part.endpoint.kind
    context = NameContext(stated.id, stated.label, owner.texts, stated.remap, kind, YAML)
    return part.pack.topic_matching.resolve(name, context).key


def _same_policy(pack: RulePack | None, one: str, other: str) -> bool:
    if pack is None:
        return one == other
    index = pack.find(ENDPOINT, one)
    return index is not None and index == pack.find(ENDPOINT, other)


def _origin(overlay: str, setting: Setting) -> str:
    if not overlay:
        return "an overlay" if setting.place is None else str(setting.place)
    return overlay + _at(setting)


def _at(stated: object) -> str:
    place = getattr(stated, "place", None)
    return "" if place is None else f" ({place})"


class _User(NamedTuple):
    """Role and topic of an endpoint, which decide the parts of a profile that it uses."""

    role: Role
    topic: str


_ANY_USER: Final = _User(PUBLISHER, "")


def _user(each: ExportEndpoint) -> _User:
    return _User(each.endpoint.role, each.parts[0].shown if each.parts else each.endpoint.topic or "")


class _Profiles:
    """The profiles of a system in the form: each has the same settings for all its users.

    One that is used in several dialects, or with different parts, becomes one for each way in which it
    reads.
    """

    def __init__(self, system: System) -> None:
        self.stated = system.profiles
        self.scoped = any(ref.scope != EVERYBODY for profile in system.profiles.values() for ref in profile.base)
        self.forms: dict[str, dict[tuple[tuple[str, str], ...], str]] = {}
        self.made_of: dict[str, Profile] = {}
        self.names: dict[tuple[str, str | None, int, str, _User], str] = {}
        self.taken = set(system.profiles)
        self.notes: dict[str, None] = {}

    def used(self, refs: Iterable[ProfileRef], spelling: _Spelling, user: _User) -> tuple[ProfileRef, ...]:
        """Return references to the profiles in ``spelling``, with the parts that ``user`` uses."""
        covering = [ref for ref in refs if ref.scope.covers(user.role, user.topic)]
        user = user if self.scoped else _ANY_USER
        return tuple(
            ProfileRef(self._name(ref.name, ref.scope.part, spelling, user, ()), ref.place) for ref in covering
        )

    def _name(self, name: str, part: str | None, spelling: _Spelling, user: _User, above: tuple[str, ...]) -> str:
        key = (name, part, id(spelling.pack), spelling.name, user)
        known = self.names.get(key)
        if known is not None:
            return known
        profile = self.stated.get(name)
        if profile is None or name in above or self._only_named(profile):
            return name
        base = tuple(
            ProfileRef(self._name(ref.name, part or ref.scope.part, spelling, user, (*above, name)), ref.place)
            for ref in profile.base
            if ref.scope.covers(user.role, user.topic, part)
        )
        made = replace(profile, settings=spelling.translated(profile.settings), base=base)
        form = (*((key, setting.text) for key, setting in made.settings.items()), *(("", ref.name) for ref in base))
        forms = self.forms.setdefault(name, {})
        if form not in forms:
            forms[form] = self._free(name, part, spelling, user, first=not forms)
            self.made_of[forms[form]] = replace(made, name=forms[form])
        self.names[key] = forms[form]
        return forms[form]

    def _only_named(self, profile: Profile) -> bool:
        """Whether all settings of a profile are unknown, so that its name alone has the same effect."""
        nothing = bool(profile.settings) and not profile.base and all(map(is_not_known, profile.settings.values()))
        if nothing:
            self.notes[f"profile `{profile.name}` is named and not written, because what it sets is not known"] = None
        return nothing

    def _free(self, name: str, part: str | None, spelling: _Spelling, user: _User, *, first: bool) -> str:
        """Return a free name for one variant of a profile; if roles use different parts, each role has its variant."""
        if self._takes_sides(name):
            return unique_name(f"{name}-{user.role}", self.taken)
        return name if first else unique_name(f"{name}-{part or spelling.name}", self.taken)

    def _takes_sides(self, name: str) -> bool:
        """Whether publishers and subscribers may use different parts of a profile."""
        seen, waiting = {name}, [name]
        while waiting:
            profile = self.stated.get(waiting.pop())
            for ref in profile.base if profile is not None else ():
                if ref.scope.role is not None:
                    return True
                if ref.name not in seen:
                    seen.add(ref.name)
                    waiting.append(ref.name)
        return False

    def made(self) -> dict[str, Profile]:
        """Return all profiles; unused ones are unchanged."""
        if self.scoped:
            self._make_unused()
            return dict(self.made_of)
        return {**self.stated, **self.made_of}

    def _make_unused(self) -> None:
        """Add the variants of unused profiles for both roles, except for profiles that are parts of others."""
        parts = {ref.name for each in self.stated.values() for ref in each.base if ref.scope.part is not None}
        plain = _Spelling(None, None, YAML)
        for name in self.stated:
            if name not in parts and name not in self.forms:
                for role in (PUBLISHER, SUBSCRIBER):
                    self._name(name, None, plain, _User(role, ""), ())
