"""Pairs from plain dictionaries: the verdict at once, what else a report has when it is read.

What one side states is put together once, from what an end that states nothing inherits and the side's own settings. A pair of two such
sides goes straight to its verdict. Everything unusual (faults, presets, needs, values from peers, packs that complete a system) takes the way
of an explanation.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import timedelta
from functools import cached_property, partial
from threading import Lock
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeAlias

from cqos_core.analysis.explanation import ends_alone, explain_ends, explain_in_pipeline
from cqos_core.language.domains import SettingValue, as_text
from cqos_core.matching.pair_outcomes import PairEnd, kind_of, outcome
from cqos_core.matching.pipeline import Pipeline, context
from cqos_core.model.caches import MOST_LETTERS, letters
from cqos_core.model.problems import CqosError
from cqos_core.model.report import PairReport
from cqos_core.model.settings import Setting
from cqos_core.model.suggestions import suggestion
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Endpoint, Participant, ProfileRef, System
from cqos_core.model.system import Topic as StatedTopic
from cqos_core.packs.topic_matching import Naming
from cqos_core.plugins import load_plugins
from cqos_core.resolving.resolved_endpoint import Resolved

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.model.finding import Verdict
    from cqos_core.model.system import Role
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.endpoint_values import EndpointValues
    from cqos_core.resolving.parts import OwnSetting, ProfileParts

Settings: TypeAlias = Mapping[str, SettingValue]
_Texts: TypeAlias = tuple[tuple[str, str], ...]

_MOST_SIDES: Final = 8_192
_MOST_PAIRS: Final = 16
_MOST_REPORTS: Final = 4_096
_HASHED: Final = frozenset((str, int, bool, timedelta))


def _texts(settings: Mapping[str, SettingValue | None]) -> _Texts:
    """Return settings as text; a preset that is None is none."""
    return tuple(
        [
            (name, value if type(value) is str else as_text(value))  # type: ignore[arg-type]
            for name, value in settings.items()
            if name != "profile" or value is not None
        ]
    )


def _letters(stated: _Texts) -> int:
    return sum([len(name) + len(text) for name, text in stated])


class _Side:
    """What one side states; ``end`` and its ``settings`` where nothing is unusual; ``types`` of values that are no text."""

    __slots__ = ("end", "settings", "stated", "types")

    def __init__(self, stated: _Texts) -> None:
        self.stated = stated
        self.end: PairEnd | None = None
        self.settings: tuple[OwnSetting, ...] = ()
        self.types: tuple[tuple[str, type], ...] = ()

    def spelt_alike(self, settings: Settings) -> bool:
        """Whether settings that are equal are of the same types: True equals 1, and is another text."""
        for name, kind in self.types:  # noqa: SIM110 - a loop is twice as fast here
            if type(settings[name]) is not kind:
                return False
        return True


class StatedPairs:
    """Pairs of one protocol under the same assumptions, and the sides of them that were seen before."""

    def __init__(self, protocol: str, around: tuple[_Texts, _Texts, _Texts], packs: Sequence[RulePack]) -> None:
        """Look for the pack; ``around`` are options, facts of the topic and needs."""
        self.protocol = protocol
        self.around = around
        self.plugins = load_plugins()
        self.where = context(packs)
        pack_is_there(protocol, self.where, packs)
        self.offers: dict[tuple[Any, ...], _Side] = {}
        self.requests: dict[tuple[Any, ...], _Side] = {}
        self._turn = Lock()  # what puts a side together collects what is to be said of it

    @cached_property
    def _nothing(self) -> _Nothing | None:
        """Return two ends that state nothing; None where more than values decides about such ends."""
        nothing = _Side(())
        pipeline = self.pipeline(nothing, nothing)
        ends = ends_alone(pipeline, PUBLISHER, SUBSCRIBER)
        if ends is None or ends[1].like.needs:
            return None
        found = {each.role: (each, each.parts) for each in ends if each.parts is not None}
        return _Nothing(pipeline.resolver.values, found) if len(found) == len(ends) else None

    def offer(self, settings: Settings) -> _Side:
        """Return what a publisher states."""
        return _side(self.offers, settings)

    def request(self, settings: Settings) -> _Side:
        """Return what a subscriber states."""
        return _side(self.requests, settings)

    def verdict(self, offer: _Side, request: _Side) -> Verdict:
        """Return the verdict of two sides."""
        if offer.end is None or request.end is None:
            return self.report(offer, request).verdict
        return outcome(offer.end, request.end).verdict

    def report(self, offer: _Side, request: _Side) -> PairReport:
        """Return the report on two sides; of known ones all but the verdict is found out when it is read."""
        if offer.end is None or request.end is None:
            return self._first(offer, request)
        key = (offer, request)
        found = _REPORTS.get(key)
        if found is None:
            if len(_REPORTS) >= _MOST_REPORTS:
                _REPORTS.clear()
            found = _REPORTS[key] = self._lazy(outcome(offer.end, request.end).verdict, offer, request)
        return found

    def _lazy(self, found: Verdict, offer: _Side, request: _Side) -> PairReport:
        return PairReport.unmade(found, partial(self._explained, offer, request))

    def _explained(self, offer: _Side, request: _Side) -> PairReport:
        return explain_ends(self._end(offer, PUBLISHER), self._end(request, SUBSCRIBER))

    def pipeline(self, offer: _Side, request: _Side) -> Pipeline:
        """Return the system of two sides, to be explained."""
        options, topic, needs = map(dict, self.around)
        system = pair_system(self.protocol, dict(offer.stated), dict(request.stated), options, topic, needs)
        return Pipeline(system, self.where)

    def _first(self, offer: _Side, request: _Side) -> PairReport:
        """Report on two sides that may be new; where anything is unusual the pair is explained at once."""
        with self._turn:
            is_known = self._put_together(offer, PUBLISHER) and self._put_together(request, SUBSCRIBER)
        if not is_known:
            return explain_in_pipeline(self.pipeline(offer, request), PUBLISHER, SUBSCRIBER)
        assert offer.end is not None  # noqa: S101 - both are now
        assert request.end is not None  # noqa: S101 - likewise
        return self._lazy(outcome(offer.end, request.end).verdict, offer, request)

    def _put_together(self, side: _Side, role: Role) -> bool:
        """Put a side together; return whether nothing is unusual about it."""
        nothing = self._nothing if side.end is None else None
        if nothing is not None and not any(name == "profile" for name, _ in side.stated):
            like, parts = nothing.ends[role]
            settings = nothing.values.settings(
                parts.inherited, [(*each, "", False) for each in side.stated], like.endpoint
            )
            profile = parts.inherited.profile
            own: ProfileParts | None = None
            if parts.inherited.takes(settings):
                own = parts._replace(settings=settings)
            else:
                laid = nothing.values.laid(parts.inherited, settings)
                profile = laid.profile
                if laid.remarks or profile.from_peers:
                    return False
            side.settings, side.end = settings, PairEnd(kind_of(profile, role, False), profile, own)
        return side.end is not None

    def _end(self, side: _Side, role: Role) -> Resolved:
        """Return the endpoint of a side of which nothing is unusual."""
        assert self._nothing is not None  # noqa: S101 - it was put together
        assert side.end is not None  # noqa: S101 - likewise
        like, parts = self._nothing.ends[role]
        endpoint = pair_end(role, dict(side.stated), like.endpoint.topic or "")
        made = Resolved.of(endpoint, like.participant, Naming(like.key, like.shown), role, role, external=like.external)
        made.parts = side.end.parts
        if made.parts is None:
            with self._turn:
                laid = self._nothing.values.laid(parts.inherited, side.settings)
            made.profile, made.layers = laid.profile, laid.layers + parts.of_topic
        return made


class _Nothing(NamedTuple):
    """Ends that state nothing.

    Attributes:
        values: reads what others state.
        ends: by role, each with the parts of its profile.
    """

    values: EndpointValues
    ends: Mapping[str, tuple[Resolved, ProfileParts]]


def _side(known: dict[tuple[Any, ...], _Side], settings: Settings) -> _Side:
    """Return what is known of settings; types tell apart what text tells apart, so that True is not 1."""
    plain = (*settings, *settings.values())
    try:
        found = known.get(plain)
    except TypeError:  # a list
        return _new_side(known, settings)
    if found is None or (found.types and not found.spelt_alike(settings)):
        return known.get((*plain, *map(type, settings.values()))) or _new_side(known, settings)
    return found


def _new_side(known: dict[tuple[Any, ...], _Side], settings: Settings) -> _Side:
    side = _Side(_texts(settings))
    types = tuple(map(type, settings.values()))
    if not ({*types} <= _HASHED and {*map(type, settings)} <= {str}) or _letters(side.stated) > MOST_LETTERS:
        return side
    if len(known) >= _MOST_SIDES:
        known.clear()
    side.types = tuple((name, kind) for name, kind in zip(settings, types, strict=True) if kind is not str)
    plain = (*settings, *settings.values())
    known[(*plain, *types) if plain in known else plain] = side
    return side


_PAIRS: Final[dict[tuple[Any, ...], StatedPairs]] = {}
_REPORTS: Final[dict[tuple[_Side, _Side], PairReport]] = {}


def stated_pairs(
    protocol: str,
    options: Settings | None = None,
    topic: Settings | None = None,
    packs: Iterable[RulePack] = (),
    needs: Settings | None = None,
) -> StatedPairs:
    """Return what is known of pairs of a protocol under some assumptions.

    Raises:
        CqosError: no installed pack has this id.
    """
    around = (
        _texts(options) if options else (),
        _texts(topic) if topic else (),
        _texts(needs) if needs else (),
    )
    packs = tuple(packs)
    key = (protocol, around, packs)
    found = _PAIRS.get(key)
    if found is None or found.plugins is not load_plugins():
        found = StatedPairs(protocol, around, packs)
        if letters(around) <= MOST_LETTERS:
            if len(_PAIRS) >= _MOST_PAIRS:
                _PAIRS.clear()
            _PAIRS[key] = found
    return found


def check_pair(
    protocol: str,
    offered: Mapping[str, SettingValue] | None = None,
    requested: Mapping[str, SettingValue] | None = None,
    options: Mapping[str, SettingValue] | None = None,
    topic: Mapping[str, SettingValue] | None = None,
    packs: Iterable[RulePack] = (),
    needs: Mapping[str, SettingValue] | None = None,
) -> PairReport:
    """Judge one offer against one request.

    Args:
        protocol: pack id, for instance ``ros2``.
        offered: the publisher's settings by policy name or alias; text in YAML spelling, or int, bool, timedelta,
            `INFINITE`; ``profile`` names a preset. What is not stated takes the protocol's defaults.
        requested: the subscriber's settings, likewise.
        options: assumptions about the deployment: ``{"rmw": "cyclonedds"}``.
        topic: facts about the topic: ``name``, ``period``, ``latched`` and what else the pack knows.
        packs: further rule packs beside the installed ones.
        needs: what the subscriber's application needs: ``{"latest": True, "max_age": "10s"}``.

    Returns:
        The verdict, set by pair rules alone; findings of pair and endpoint rules; and each policy compared.

    Raises:
        CqosError: no installed pack has this id.
    """
    _are_maps({"offered": offered, "requested": requested, "options": options, "topic": topic, "needs": needs})
    pairs = stated_pairs(protocol, options, topic, packs, needs)
    return pairs.report(pairs.offer(offered or {}), pairs.request(requested or {}))


class PairProfile:
    """What one side states, read once: made by `PairJudge.profile`, used in place of a dictionary."""

    __slots__ = ("offer", "pairs", "request")

    def __init__(self, pairs: StatedPairs, settings: Settings) -> None:
        """Read settings; later changes of them are not seen."""
        self.pairs = pairs
        self.offer = pairs.offer(settings)
        self.request = pairs.request(settings)
        pairs.verdict(self.offer, pairs.request({}))
        pairs.verdict(pairs.offer({}), self.request)


class PairJudge:
    """Judges many pairs of one protocol under the same assumptions.

    >>> judge = PairJudge("ros2", {"rmw": "cyclonedds"})
    >>> judge.verdict({"reliability": "best_effort"}, {"reliability": "reliable"})
    <Verdict.INCOMPATIBLE: 'incompatible'>

    Every verdict equals that of `cqos_core.check_pair`. Threads may share a judge.
    """

    def __init__(
        self,
        protocol: str,
        options: Settings | None = None,
        topic: Settings | None = None,
        packs: Iterable[RulePack] = (),
        needs: Settings | None = None,
    ) -> None:
        """Prepare for pairs; arguments are those of `cqos_core.check_pair`.

        Raises:
            CqosError: no installed pack has this id.
        """
        _are_maps({"options": options, "topic": topic, "needs": needs})
        self._pairs = stated_pairs(protocol, options, topic, packs, needs)

    def profile(self, settings: Settings) -> PairProfile:
        """Read what one side states once, for many verdicts of this judge."""
        _are_maps({"settings": settings})
        return PairProfile(self._pairs, settings)

    def verdict(self, offered: Settings | PairProfile, requested: Settings | PairProfile) -> Verdict:
        """Return the verdict of an offer and a request, each a dictionary or a prepared profile.

        Raises:
            TypeError: a value is no setting.
            CqosError: a profile is of another judge.
        """
        pairs = self._pairs
        offer = self._own(offered).offer if isinstance(offered, PairProfile) else _side(pairs.offers, offered)
        request = (
            self._own(requested).request if isinstance(requested, PairProfile) else _side(pairs.requests, requested)
        )
        return pairs.verdict(offer, request)

    def _own(self, profile: PairProfile) -> PairProfile:
        if profile.pairs is not self._pairs:
            raise CqosError("the profile is of another judge: use `profile` of this one")
        return profile


def _are_maps(given: Mapping[str, object]) -> None:
    """Refuse what is no map of settings, and say how a preset is named.

    Raises:
        TypeError: something is no map.
    """
    for name, stated in given.items():
        if stated is None or isinstance(stated, Mapping):
            continue
        message = f"`{name}` must map names of settings to values, found {stated!r}"
        if isinstance(stated, str) and name in {"offered", "requested"}:
            message += f"; a preset is named by {name}={{'profile': {stated!r}}}"
        raise TypeError(message)


def pack_is_there(pack_id: str, where: CheckContext, packs: Iterable[RulePack]) -> None:
    """Refuse the id of a pack that is missing.

    Raises:
        CqosError: with the ids that are near.
    """
    if where.find_pack(pack_id) is None:
        known = {*load_plugins().packs, *(pack.id for pack in packs)}
        raise CqosError(f"there is no rule pack `{pack_id}`; {suggestion(pack_id, known)}")


def pair_system(
    protocol: str,
    offered: Mapping[str, SettingValue],
    requested: Mapping[str, SettingValue],
    options: Mapping[str, SettingValue],
    topic: Mapping[str, SettingValue],
    needs: Mapping[str, SettingValue] = MappingProxyType({}),
) -> System:
    """Make the system of one publisher and one subscriber on one topic; ``profile`` among the settings names a preset."""
    facts = dict(topic)
    name = as_text(facts.pop("name", "topic"))
    system = System(protocol=protocol, options={protocol: {n: Setting(as_text(v)) for n, v in options.items()}})
    system.topics[name] = StatedTopic(name, {n: Setting(as_text(v)) for n, v in facts.items()}, external=True)
    for role, stated in ((PUBLISHER, offered), (SUBSCRIBER, requested)):
        system.participants[role] = Participant(role)
        system.endpoints.append(pair_end(role, stated, name, needs if role == SUBSCRIBER else {}))
    return system


def pair_end(
    role: Role, stated: Mapping[str, SettingValue], topic: str, needs: Mapping[str, SettingValue] = MappingProxyType({})
) -> Endpoint:
    """Make one end of such a pair, whose participant has its role as id."""
    settings = dict(stated)
    profile = settings.pop("profile", None)
    return Endpoint(
        id=role,
        role=role,
        topic=topic,
        participant=role,
        settings={name: Setting(as_text(value)) for name, value in settings.items()},
        profiles=() if profile is None else (ProfileRef(as_text(profile)),),
        needs={name: Setting(as_text(value)) for name, value in needs.items()},
    )
