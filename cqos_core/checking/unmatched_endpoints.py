"""Findings about endpoints without any partner, and about topics whose names nearly agree."""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING, Final

from cqos_core.matching.topic_groups import bridges_of
from cqos_core.model.codes import CODES
from cqos_core.model.core_findings import core_finding
from cqos_core.model.finding import Finding, Severity, Side
from cqos_core.model.grouping import grouped
from cqos_core.model.spelling import typing_errors
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
    found = reported_alone(lonely, packs, kinds, busy, partial=system.partial)
    return [finding for findings in found.values() for finding in findings], unmatched


def read_of_topic(result: TopicResult | None) -> tuple[object, ...]:
    """Return everything that `unmatched_endpoints` reads of a topic."""
    if result is None:
        return ()
    met = frozenset(chain.from_iterable((*each.publishers, *each.subscribers) for each in result.groups))
    alternatives = [
        (each.id, each.representative.template or "") for each in result.endpoints if each.representative.alternative
    ]
    return result.lonely, met, sorted(alternatives), result.topic.shown


def reported_alone(
    lonely: Mapping[TopicKey, Sequence[Resolved]],
    packs: Mapping[str, RulePack],
    kinds: Mapping[str, str],
    busy: Iterable[tuple[TopicKey, str]],
    *,
    partial: bool,
) -> dict[TopicKey, list[Finding]]:
    """Return by topic the findings about endpoints without partner.

    Args:
        lonely: by topic the endpoints without partner.
        packs: by protocol.
        kinds: by id of a stated endpoint its kind, where that is no message.
        busy: topics on which others match, with how these write them; one of them may be meant.
        partial: the system is a part.
    """
    near, silenced = near_misses(lonely, packs)
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
                found.setdefault(key, []).append(_alone(code, role, alone, kinds, meant(key)))
    return found


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


def _alone(code: str, role: str, alone: Sequence[Resolved], kinds: Mapping[str, str], meant: str | None) -> Finding:
    """Return the finding about endpoints of one topic without partner; a service or action is named as it was stated."""
    ids = sorted(endpoint.id for endpoint in alone)
    first = next(endpoint for endpoint in alone if endpoint.id == ids[0])
    does = _DOES.get(kinds.get(first.stated_id, "").partition("_")[2])
    who, what = (first.id, first.shown) if does is None else (first.stated_id, first.endpoint.topic)
    one, several, other = does or _DOES[role]
    more = f" and {len(ids) - 1} more" if len(ids) > 1 else ""
    message = f"`{who}`{more} {several if more else one} `{what}`, which no endpoint in the system {other}"
    place = first.endpoint.place
    return core_finding(code, message, place=place, role=role, members=ids, topic=first.shown, help=meant)


def near_misses(
    lonely: Mapping[TopicKey, Sequence[Resolved]], packs: Mapping[str, RulePack]
) -> tuple[dict[TopicKey, Finding], set[TopicKey]]:
    """Return findings about topics of subscribers and of publishers whose names nearly agree, by the former; and all topics concerned."""
    findings: dict[TopicKey, Finding] = {}
    silenced: set[TopicKey] = set()
    for pack_id, pack in sorted(packs.items()):
        offering = [k for k, v in sorted(lonely.items()) if k[0] == pack_id and v[0].role == PUBLISHER]
        subscribed = [k for k, v in sorted(lonely.items()) if k[0] == pack_id and v[0].role == SUBSCRIBER]
        missing = [key for key in subscribed if not all(each.external for each in lonely[key])]
        for words, fold in pack.topic_matching.folds:
            folded: dict[str, list[TopicKey]] = {}
            for key in offering:
                folded.setdefault(fold(key[1]), []).append(key)
            matched = _matched(pack, folded, {fold(key[1]) for key in missing})
            for key in missing:
                near = (fold(key[1]), *matched.get(fold(key[1]), ()))
                candidates = [
                    c
                    for each in near
                    for c in folded.get(each, ())
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
            candidates = [
                c
                for c in (offered[other] for other in misspelt)
                if c not in silenced and _may_be_meant(lonely[key], lonely[c])
            ]
            if len(candidates) == 1:
                silenced |= {key, candidates[0]}
                words = f"differ by a typing error; did you mean `{lonely[candidates[0]][0].shown}`?"
                findings[key] = _near_miss(lonely[key], lonely[candidates[0]], words)
    return findings, silenced


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
