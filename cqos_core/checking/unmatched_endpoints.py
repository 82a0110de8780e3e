"""Findings about endpoints without any partner, and about topics whose names nearly agree."""

from __future__ import annotations

from itertools import chain
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from cqos_core.matching.topic_groups import bridges_of
from cqos_core.model.codes import CODES
from cqos_core.model.core_findings import core_finding
from cqos_core.model.finding import Finding, Severity, Side
from cqos_core.model.grouping import grouped
from cqos_core.model.spelling import folded, typing_errors
from cqos_core.model.system import MESSAGE, PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cqos_core.checking.topic_check import TopicResult
    from cqos_core.matching.topic_groups import TopicKey
    from cqos_core.model.system import System
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.resolved_endpoint import Resolved


def unmatched_endpoints(
    system: System,
    results: Mapping[TopicKey, TopicResult],
    packs: Mapping[str, RulePack],
    endpoints: Iterable[Resolved],
) -> tuple[list[Finding], int]:
    """Report endpoints without any partner, and topics whose names nearly agree; of a part, only count the first.

    Of profiles that are tried, nothing: their topics have made-up names.
    """
    if system.hypothetical or not any(result.lonely for result in results.values()):
        return [], 0
    kinds = {each.id: each.kind for each in system.endpoints if each.kind != MESSAGE}
    # An endpoint without a partner of its own protocol may have one on the wire.
    met = {
        each
        for result in results.values()
        for group in result.groups
        for each in (*group.publishers, *group.subscribers)
    }
    # Of alternatives, one is enough.
    met_for = {e.endpoint.template for e in endpoints if e.endpoint.alternative and e.id in met}
    lonely = {
        key: [
            e
            for e in result.lonely
            if e.id not in met and not (e.endpoint.alternative and e.endpoint.template in met_for)
        ]
        for key, result in results.items()
    }
    lonely = {key: endpoints for key, endpoints in lonely.items() if endpoints}
    unmatched = sum(map(len, lonely.values())) if system.partial else 0
    busy = ((key, result.groups[0].topic) for key, result in results.items() if result.groups)
    elsewhere = _in_other_protocols(lonely, results, packs)
    found = reported_alone(lonely, packs, kinds, busy, elsewhere, partial=system.partial)
    return [finding for findings in found.values() for finding in findings], unmatched


def read_of_topic(result: TopicResult | None) -> tuple[object, ...]:
    """Return everything that `unmatched_endpoints` reads of a topic."""
    if result is None:
        return ()
    met = frozenset(chain.from_iterable((*each.publishers, *each.subscribers) for each in result.groups))
    alternatives = [
        (each.id, each.representative.template or "") for each in result.endpoints if each.representative.alternative
    ]
    ends = frozenset((each.role, each.id) for each in result.endpoints)
    return result.lonely, met, sorted(alternatives), result.topic.shown, ends


def reported_alone(
    lonely: Mapping[TopicKey, Sequence[Resolved]],
    packs: Mapping[str, RulePack],
    kinds: Mapping[str, str],
    busy: Iterable[tuple[TopicKey, str]],
    elsewhere: Mapping[tuple[TopicKey, str], str] = MappingProxyType({}),
    *,
    partial: bool,
) -> dict[TopicKey, list[Finding]]:
    """Return by topic the findings about endpoints without partner.

    Args:
        lonely: by topic the endpoints without partner.
        packs: by protocol.
        kinds: by id of a stated endpoint its kind, where that is no message.
        busy: topics on which others match, with how these write them; one of them may be meant.
        elsewhere: by topic and role what to do where an endpoint of another protocol has the missing role on that name.
        partial: the system is a part.
    """
    near, silenced, of_other_type = near_misses(lonely, packs)
    found = {key: [finding] for key, finding in near.items()}
    if partial:
        return found
    loud = [key for key in sorted(lonely) if key not in silenced]
    meant = _BusyTopics(busy if loud else (), packs, loud).meant
    reported = {e.endpoint.template for key in silenced for e in lonely[key] if e.endpoint.alternative}
    for key in loud:
        for role, code in ((SUBSCRIBER, "CQ401"), (PUBLISHER, "CQ402")):
            alone = [
                e
                for e in lonely[key]
                if e.role == role
                and not e.external
                and not (e.endpoint.alternative and e.endpoint.template in reported)
            ]
            if alone:
                reported |= {e.endpoint.template for e in alone if e.endpoint.alternative}
                hint = meant(key) or of_other_type.get(key) or elsewhere.get((key, role))
                found.setdefault(key, []).append(_alone(code, role, alone, kinds, hint))
    return found


def _in_other_protocols(
    lonely: Iterable[TopicKey], results: Mapping[TopicKey, TopicResult], packs: Mapping[str, RulePack]
) -> dict[tuple[TopicKey, str], str]:
    """Return by topic and role a hint where only an endpoint of another protocol has the missing role on the same name."""
    names = grouped((name.strip("/"), (pack_id, name)) for pack_id, name in sorted(results))
    found: dict[tuple[TopicKey, str], str] = {}
    for key in lonely:
        for other in names[key[1].strip("/")]:
            # Protocols on one wire meet there, under names of their own.
            if other[0] == key[0] or _share_wire(packs[key[0]], packs[other[0]]):
                continue
            for role, partner, verb in ((SUBSCRIBER, PUBLISHER, "publishes"), (PUBLISHER, SUBSCRIBER, "subscribes to")):
                end = min((each.id for each in results[other].endpoints if each.role == partner), default=None)
                if end is not None:
                    where = f"`{end}` {verb} the same name by {packs[other[0]].title}, and protocols never meet by themselves"
                    found.setdefault((key, role), f"{where}; state a bridge in `bridges:`, or use one protocol")
    return found


def _share_wire(one: RulePack, other: RulePack) -> bool:
    wires = [{pack.id, *([pack.wire.protocol] if pack.wire is not None else [])} for pack in (one, other)]
    return not wires[0].isdisjoint(wires[1])


class _BusyTopics:
    """Topics on which endpoints match, to be suggested for names that nearly agree."""

    def __init__(
        self, shown: Iterable[tuple[TopicKey, str]], packs: Mapping[str, RulePack], lonely: Iterable[TopicKey]
    ) -> None:
        """Take how these endpoints write their topics, and the topics in question."""
        self._packs = packs
        self._folded: dict[tuple[str, str, str], str] = {}  # by protocol, words of the fold, and folded name
        self._misspelt: dict[TopicKey, str] = {}
        matched: dict[str, dict[str, str]] = {}
        for (pack_id, name), topic in sorted(shown):
            matched.setdefault(pack_id, {})[name] = topic
            for words, fold in packs[pack_id].topic_matching.folds:
                self._folded.setdefault((pack_id, words, fold(name)), topic)
        asked = grouped(lonely)
        for pack_id, topics in matched.items():
            for name, near in typing_errors(asked.get(pack_id, ()), topics).items():
                self._misspelt[pack_id, name] = topics[near[0]]

    def meant(self, key: TopicKey) -> str | None:
        """Say which of the topics has nearly the same name."""
        pack_id, name = key
        for words, fold in self._packs[pack_id].topic_matching.folds:
            topic = self._folded.get((pack_id, words, fold(name)))
            if topic is not None:
                return f"did you mean `{topic}`? the names {words}"
        topic = self._misspelt.get(key)
        return None if topic is None else f"did you mean `{topic}`?"


# The verb of an endpoint: one of them, several, and the missing verb of the other side.
_DOES: Final = {
    SUBSCRIBER: ("subscribes to", "subscribe to", "publishes"),
    PUBLISHER: ("publishes", "publish", "subscribes to"),
    "client": ("calls", "call", "serves"),
    "server": ("serves", "serve", "calls"),
}


def _alone(code: str, role: str, alone: Sequence[Resolved], kinds: Mapping[str, str], hint: str | None) -> Finding:
    """Return the finding about endpoints of one topic without partner; a service or action is named as it was stated."""
    ids = sorted(endpoint.id for endpoint in alone)
    first = next(endpoint for endpoint in alone if endpoint.id == ids[0])
    does = _DOES.get(kinds.get(first.stated_id, "").partition("_")[2])
    who, what = (first.id, first.shown) if does is None else (first.stated_id, first.endpoint.topic)
    one, several, other = does or _DOES[role]
    more = f" and {len(ids) - 1} more" if len(ids) > 1 else ""
    message = f"`{who}`{more} {several if more else one} `{what}`, which no endpoint in the system {other}"
    place = first.endpoint.place
    return core_finding(code, message, place=place, role=role, members=ids, topic=first.shown, help=hint)


def near_misses(
    lonely: Mapping[TopicKey, Sequence[Resolved]], packs: Mapping[str, RulePack]
) -> tuple[dict[TopicKey, Finding], set[TopicKey], dict[TopicKey, str]]:
    """Compare topics of subscribers and of publishers.

    Returns:
        Findings about those whose names nearly agree, by the topic of the subscribers; all topics concerned; and hints for others whose
        names nearly agree, but not their types.
    """
    findings: dict[TopicKey, Finding] = {}
    silenced: set[TopicKey] = set()
    hints: dict[TopicKey, str] = {}

    def keep_hints(key: TopicKey, near: Iterable[TopicKey]) -> None:
        for other in near:
            if not _of_one_relay(lonely[key], lonely[other]) and not _of_one_type(lonely[key], lonely[other]):
                for one, meant in ((key, other), (other, key)):
                    hints.setdefault(one, f"did you mean `{lonely[meant][0].shown}`, although the types differ?")

    for pack_id, pack in sorted(packs.items()):
        offering = [k for k, v in sorted(lonely.items()) if k[0] == pack_id and v[0].role == PUBLISHER]
        subscribed = [k for k, v in sorted(lonely.items()) if k[0] == pack_id and v[0].role == SUBSCRIBER]
        missing = [key for key in subscribed if not all(each.external for each in lonely[key])]
        for words, fold in pack.topic_matching.folds:
            folded_names: dict[str, list[TopicKey]] = {}
            for key in offering:
                folded_names.setdefault(fold(key[1]), []).append(key)
            matched = _matched(pack, folded_names, {fold(key[1]) for key in missing})
            for key in missing:
                near = (fold(key[1]), *matched.get(fold(key[1]), ()))
                keep_hints(key, (c for c in folded_names.get(near[0], ()) if folded(c[1]) == folded(key[1])))
                candidates = [
                    c
                    for each in near
                    for c in folded_names.get(each, ())
                    if c not in silenced and _may_be_meant(lonely[key], lonely[c])
                ]
                if not candidates or key in silenced or (len(candidates) > 1 and not matched):
                    continue
                silenced |= {key, *candidates}
                findings[key] = _near_miss(lonely[key], [each for c in candidates for each in lonely[c]], words)
        offered = {key[1]: key for key in offering if key not in silenced}
        # A partner from outside, too, is on a topic of the right name.
        for name, misspelt in typing_errors([key[1] for key in subscribed if key not in silenced], offered).items():
            key = (pack_id, name)
            keep_hints(key, (offered[other] for other in misspelt))
            candidates = [
                c
                for c in (offered[other] for other in misspelt)
                if c not in silenced and _may_be_meant(lonely[key], lonely[c])
            ]
            if len(candidates) == 1:
                silenced |= {key, candidates[0]}
                words = f"differ by a typing error; did you mean `{lonely[candidates[0]][0].shown}`?"
                findings[key] = _near_miss(lonely[key], lonely[candidates[0]], words)
    return findings, silenced, hints


def _may_be_meant(missing: Sequence[Resolved], offering: Sequence[Resolved]) -> bool:
    return not _of_one_relay(missing, offering) and _of_one_type(missing, offering)


def _of_one_relay(missing: Sequence[Resolved], offering: Sequence[Resolved]) -> bool:
    """Whether all of them are ends of one bridge, or of one participant, which may rename what it carries."""
    bridges = bridges_of((*missing, *offering))
    owners = {each.endpoint.participant for each in (*missing, *offering)}
    return len(owners) == 1 or (len(bridges) == 1 and None not in bridges)


def _of_one_type(missing: Sequence[Resolved], offering: Sequence[Resolved]) -> bool:
    """Whether any of them may have the type of one on the other side."""
    types = [{each.endpoint.type for each in side} for side in (missing, offering)]
    return any(None in side for side in types) or not types[0].isdisjoint(types[1])


def _matched(pack: RulePack, offering: Iterable[str], missing: set[str]) -> Mapping[str, Sequence[str]]:
    """By key of subscribers the other keys of publishers that it would meet, both folded."""
    found: dict[str, list[str]] = {}
    match = pack.topic_matching.match
    for publisher, subscriber in match(list(offering), missing) if match is not None else ():
        found.setdefault(subscriber, []).append(publisher)
    return found


_WILDCARDS: Final = frozenset("*?+#")


def _near_miss(missing: Sequence[Resolved], offering: Sequence[Resolved], words: str) -> Finding:
    subscriber = min(missing, key=lambda endpoint: endpoint.id)
    publisher = min(offering, key=lambda endpoint: endpoint.id)
    info = CODES["CQ403"]
    return Finding(
        code="CQ403",
        name=info.name,
        severity=Severity(info.severity),
        message=(
            f"subscriber `{subscriber.id}` on `{subscriber.shown}` and publisher `{publisher.id}` on `{publisher.shown}` "
            f"never meet: the names {words}"
        ),
        topic=subscriber.shown,
        sides=(
            Side(
                SUBSCRIBER,
                tuple(sorted(e.id for e in missing)),
                "subscribed here",
                (),
                subscriber.endpoint.place,
            ),
            Side(
                PUBLISHER,
                tuple(sorted(e.id for e in offering)),
                "published here",
                (),
                publisher.endpoint.place,
            ),
        ),
        because=info.reason,
        help=f"if one topic is meant, subscribe to `{publisher.shown}`, or publish on `{subscriber.shown}`"
        if subscriber.shown != publisher.shown and not set(subscriber.shown) & _WILDCARDS
        else info.help,
    )
