"""Writes any system as a system file that a person can continue to edit."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from cqos_core.files.yaml_design import design_of, is_not_known, with_shared_profiles
from cqos_core.files.yaml_text import Block, Raw, document, scalar, value
from cqos_core.importers.yaml_form import BROKER, ENDPOINT, PARTICIPANT, PROFILE_FORM, ROUTE_SIDE, TOPIC, VERSION
from cqos_core.model.grouping import grouped
from cqos_core.model.system import EVERYBODY, MESSAGE, endpoint_id
from cqos_core.packs.export import Exported
from cqos_core.packs.unread import totals_of, unread_parts

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from cqos_core.files.yaml_design import Design
    from cqos_core.files.yaml_text import Node
    from cqos_core.importers.document_form import Form
    from cqos_core.model.chains import Chain, StatedLink
    from cqos_core.model.settings import Setting, Settings
    from cqos_core.model.system import (
        Acceptance,
        Bound,
        Bridge,
        Broker,
        Endpoint,
        Participant,
        Profile,
        ProfileRef,
        Route,
        System,
        TeamRule,
        Topic,
    )
    from cqos_core.packs.export import ExportContext

_TRUE: Final = Raw("true")
_SHOWN_SOURCES: Final = 10
_KEYS: Final = {
    "publisher": "publishes",
    "subscriber": "subscribes",
    "service_server": "serves",
    "service_client": "calls",
    "action_server": "action_servers",
    "action_client": "action_clients",
}


def write(system: System, context: ExportContext) -> Exported:
    """Write ``system`` in the YAML form; reading it again gives the same verdicts and findings.

    The setting ``profiles=shared`` makes profiles of settings that several endpoints have in common.
    """
    design = design_of(system, context)
    if context.settings.get("profiles") == "shared":
        design = with_shared_profiles(design)
    form = _SystemFile(design, [*_unread(system, context)])
    text = document(form.document(), _head(system))
    expressed = len(design.system.endpoints) or len(design.system.profiles)
    drawn = sum(len(flow.nodes) for flow in system.flows)
    flows = [_NO_FLOWS.format(drawn)] if drawn else []
    return Exported(text, expressed, (*design.notes, *form.notes, *_unsaid(system), *flows))


_NO_FLOWS: Final = "control flow is left out, {} nodes: a system file has no form for it, so a check of it finds nothing about behaviour"


def _unsaid(system: System) -> list[str]:
    """Return notes on scopes of profiles that are lost: without endpoints, a profile cannot name its users."""
    scoped = any(ref.scope != EVERYBODY for each in system.profiles.values() for ref in each.base)
    if system.endpoints or not scoped:
        return []
    patterns = {ref.scope.topic for each in system.profiles.values() for ref in each.base if ref.scope.by_topic} - {"*"}
    left_out = (
        [f"what profiles have for some topics only ({', '.join(sorted(patterns))}) is left out"] if patterns else []
    )
    said = "which endpoints a part of a profile is meant for cannot be said, so each part is a profile of its own"
    return [said, *left_out]


def _head(system: System) -> list[str]:
    sources = list(system.sources)
    more = f" and {len(sources) - _SHOWN_SOURCES} more" if len(sources) > _SHOWN_SOURCES else ""
    return [f"From {', '.join(sources[:_SHOWN_SOURCES])}{more}"] if sources else []


class _SystemFile:
    """Builds the document of one design; `notes` has what the form cannot express."""

    def __init__(self, design: Design, unread: list[Node]) -> None:
        self.system = design.system
        self.unread = unread
        self.comments = design.comments
        self.notes: dict[str, None] = {}
        self.ids = _given_ids(design.system)
        endpoints = design.system.endpoints
        self.observed = bool(endpoints) and all(endpoint.observed for endpoint in endpoints)

    def document(self) -> Block:
        """Return the whole document."""
        system = self.system
        head = _stated(
            {
                "cqos": Raw(str(VERSION)),
                "system": _optional(self._only("the name of the system", system.name), scalar),
                "protocol": _optional(self._only("the protocol", system.protocol or ""), scalar),
                "observed": _flag(self.observed),
                "part": _flag(system.partial),
                "options": self._options() or None,
            }
        )
        parts: dict[str, dict[str, Node]] = {
            "profiles": {name: _profile(each) for name, each in system.profiles.items()},
            "topics": {name: _topic(each) for name, each in system.topics.items()},
            "participants": self._participants(),
            "brokers": {name: _broker(each) for name, each in system.brokers.items()},
            "bridges": {name: _bridge(each) for name, each in system.bridges.items()},
            "chains": {name: _chain(each) for name, each in system.chains.items()},
            "links": {name: _link(each) for name, each in system.links.items()},
        }
        document = Block(head, apart=True)
        document.entries |= {
            name: Block({_escaped(key): node for key, node in part.items()}) for name, part in parts.items() if part
        }
        checks = [node for each in system.checks if (node := self._check(each)) is not None]
        document.entries |= _stated(
            {
                "checks": checks or None,
                "accept": [_acceptance(each) for each in system.accept] or None,
                "severities": {name: value(level) for name, level in system.severities.items()} or None,
                "unread": self.unread or None,
            }
        )
        return document

    def _only(self, what: str, text: str) -> str:
        """Return a text without variables, which a system file cannot have here."""
        if "${" in text:
            self.notes[f"{what} `{text}` loses its `$`, which would begin a variable"] = None
            text = text.replace("${", "{")
        return text

    def _option(self, name: str, setting: Setting) -> Raw:
        if is_not_known(setting):
            return _said(replace(setting, unknown=self._only(f"option `{name}`", str(setting.unknown))))
        return value(self._only(f"option `{name}`", setting.text))

    def _options(self) -> dict[str, Node]:
        return {
            pack: {name: self._option(name, each) for name, each in settings.items()}
            for pack, settings in self.system.options.items()
            if settings
        }

    # Participants and endpoints

    def _participants(self) -> dict[str, Node]:
        of = grouped((endpoint.participant, endpoint) for endpoint in self.system.endpoints)
        return {name: self._participant(each, of.get(name, ())) for name, each in self.system.participants.items()}

    def _participant(self, participant: Participant, endpoints: Sequence[Endpoint]) -> Node:
        own = _stated(
            {
                "label": _optional(participant.label),
                "protocol": _optional(participant.protocol),
                "external": _flag(participant.external),
                "starts_after": _texts(participant.starts_after),
            }
        )
        client: dict[str, Node] = {}
        for name, setting in participant.settings.items():
            # Maps, and settings named like a key of the form, go below `client`, which holds settings only.
            node = _said(setting)
            (client if name in (*PARTICIPANT.keys, *PARTICIPANT.never) or node.text.startswith("{") else own)[
                _escaped(name)
            ] = node
        remap: dict[str, Node] = {_escaped(old): _text(new) for old, new in participant.remap.items()}
        own |= _stated({"client": client or None, "remap": remap or None})
        return own if not endpoints else Block({**own, **self._endpoints(endpoints)})

    def _endpoints(self, endpoints: Iterable[Endpoint]) -> dict[str, Node]:
        by_word = grouped((_word(endpoint), endpoint) for endpoint in endpoints)
        return {key: self._by_topic(by_word[word]) for word, key in _KEYS.items() if word in by_word}

    def _by_topic(self, endpoints: Iterable[Endpoint]) -> Block:
        block = Block({})
        for topic, members in grouped((_escaped(each.topic or ""), each) for each in endpoints).items():
            nodes = [self._endpoint(each) for each in members]
            block.entries[topic] = nodes[0] if len(nodes) == 1 else nodes
            if said := [self.comments[each.id] for each in members if each.id in self.comments]:
                block.comments[topic] = "; ".join(said)
        return block

    def _endpoint(self, endpoint: Endpoint) -> Node:
        own = _stated(
            {
                "id": _text(endpoint.id) if endpoint.id in self.ids else None,
                "label": _optional(endpoint.label),
                "protocol": _optional(endpoint.protocol),
                "profile": _refs(endpoint.profiles),
                "type": _optional(endpoint.type),
                **_own_settings(endpoint.settings, ENDPOINT),
                "needs": _settings(endpoint.needs) or None,
                "external": _flag(endpoint.external),
                "starts_after": _texts(endpoint.starts_after),
                "observed": _flag(endpoint.observed and not self.observed),
            }
        )
        return own["profile"] if list(own) == ["profile"] and isinstance(own["profile"], Raw) else own

    # The team's rules

    def _check(self, check: TeamRule) -> Node | None:
        require = self._bounds(check)
        if not (check.where or require or check.sentence) or (check.require and not require):
            self.notes[f"check `{check.name}` requires nothing"] = None
            return None
        return _stated(
            {
                "name": _text(check.name),
                "where": {key: _text(pattern) for key, pattern in check.where} or None,
                "require": require or None,
                "sentence": _optional(check.sentence),
                "severity": _text(check.severity) if check.severity != "error" else None,
                "because": _text(check.because),
            }
        )

    def _bounds(self, check: TeamRule) -> dict[str, Node]:
        by_policy: dict[str, dict[str, Bound]] = {}
        for bound in check.require:
            relations = by_policy.setdefault(bound.policy, {})
            if bound.relation in relations:
                self.notes[f"check `{check.name}`: only the first `{bound.relation}` of `{bound.policy}` is kept"] = (
                    None
                )
            relations.setdefault(bound.relation, bound)
        return {_escaped(policy): _relations(relations) for policy, relations in by_policy.items()}


def _relations(relations: Mapping[str, Bound]) -> Node:
    exactly = relations.get("exactly")
    if exactly is not None and len(relations) == 1 and not exactly.values[0].startswith("{"):
        return _value(exactly.values[0])
    return {name: _bound(bound) for name, bound in relations.items()}


def _bound(bound: Bound) -> Node:
    values: list[Node] = [_value(text) for text in bound.values]
    return values[0] if len(values) == 1 and bound.relation != "one_of" else values


def _acceptance(acceptance: Acceptance) -> Node:
    return {
        name: _text(text)
        for name in ("rule", "topic", "endpoint", "until", "because")
        if (text := getattr(acceptance, name)) is not None
    }


def _unread(system: System, context: ExportContext) -> Iterator[Node]:
    """Yield an entry for each part that the inputs have and the system has not; the first of a kind says how many there are."""
    totals = totals_of(system.notes)
    for part in unread_parts(system.notes, context.find_rule):
        yield _stated(
            {
                "kind": _text(part.kind),
                "name": _optional(part.name),
                "cause": _optional(part.cause),
                "endpoints": Raw(str(part.endpoints)) if part.endpoints != 1 else None,
                "total": Raw(str(total)) if (total := totals.pop(part.kind, 0)) else None,
            }
        )


# Named parts


def _profile(profile: Profile) -> Node:
    return _stated({"profile": _refs(profile.base), **_own_settings(profile.settings, PROFILE_FORM)})


def _topic(topic: Topic) -> Node:
    own = _stated(
        {
            **_own_settings(topic.settings, TOPIC),
            "external": _flag(topic.external),
            "protocol": _optional(topic.protocol),
        }
    )
    return own["type"] if list(own) == ["type"] else own


def _bridge(bridge: Bridge) -> Node:
    return _stated({"routes": [_route(each) for each in bridge.routes], "carries": _listed(bridge.carries)})


def _chain(chain: Chain) -> Node:
    steps: list[Node] = [
        _stated({"at": _text(each.at), "topic": _optional(each.topic), **_settings(each.settings)})
        if each.topic or each.settings
        else _text(each.at)
        for each in chain.steps
    ]
    return {"steps": steps, **_settings(chain.settings)}


def _link(link: StatedLink) -> Node:
    members = {"participants": _texts(link.participants), "topics": _listed(link.topics)}
    return _stated({**members, **_settings(link.settings)})


def _route(route: Route) -> Node:
    kind = route.source.kind
    return _stated(
        {
            "from": _route_side(route.source),
            "to": _route_side(route.target),
            "kind": _text(kind.partition("_")[0]) if kind != MESSAGE else None,
            "only": _listed(route.only),
            "but": _listed(route.but),
        }
    )


def _route_side(side: Endpoint) -> Node:
    return _stated(
        {
            "participant": _text(side.participant),
            "topic": _optional(side.topic),
            "id": _optional(side.id),
            "label": _optional(side.label),
            "type": _optional(side.type),
            "profile": _refs(side.profiles),
            "external": _flag(side.external),
            **_own_settings(side.settings, ROUTE_SIDE),
        }
    )


def _broker(broker: Broker) -> Node:
    return _stated(
        {
            "protocol": _optional(broker.protocol),
            "profile": _refs(broker.profiles),
            **_own_settings(broker.settings, BROKER),
        }
    )


def _own_settings(settings: Settings, form: Form) -> dict[str, Node]:
    """Return settings beside the keys of a form; one named like a key gets a capital letter.

    Names of settings ignore case, keys do not.
    """
    taken = {*form.keys, *form.never}
    return {_escaped(name.title() if name in taken else name): _said(each) for name, each in settings.items()}


def _settings(settings: Settings) -> dict[str, Node]:
    return {_escaped(name): _said(each) for name, each in settings.items()}


def _said(setting: Setting) -> Raw:
    """Return a value; an unknown one is a map with the cause."""
    if is_not_known(setting):
        return Raw(_escaped(f"{{unknown: {json.dumps(setting.unknown)}}}"))
    return value(_escaped(setting.text))


def _word(endpoint: Endpoint) -> str:
    """Return the word for an endpoint in generated ids."""
    return endpoint.role if endpoint.kind == "message" else endpoint.kind


# Texts


def _escaped(text: str) -> str:
    """Return a text in which `${` does not begin a variable."""
    return text.replace("${", "$${")


def _text(text: str) -> Raw:
    return scalar(_escaped(text))


def _optional(text: str | None, written: Callable[[str], Raw] = _text) -> Raw | None:
    return written(text) if text else None


def _flag(holds: bool) -> Raw | None:  # noqa: FBT001 - a value
    return _TRUE if holds else None


def _listed(texts: Iterable[str]) -> Node | None:
    return [_text(text) for text in texts] or None


def _texts(texts: Sequence[str]) -> Node | None:
    return _text(texts[0]) if len(texts) == 1 else _listed(texts)


def _refs(refs: Sequence[ProfileRef]) -> Node | None:
    return _texts([ref.name for ref in refs])


def _stated(entries: Mapping[str, Node | None]) -> dict[str, Node]:
    """Return the entries that are not None."""
    return {name: node for name, node in entries.items() if node is not None}


def _value(text: str) -> Raw:
    return value(_escaped(text))


# Ids


def _given_ids(system: System) -> frozenset[str]:
    """Return the ids to write, because the reader would generate other ones.

    An endpoint without an id is called ``participant/role/topic``, further ones of that name ``…#2``, ``…#3``.
    """
    given: set[str] = set()
    made_up = grouped((endpoint_id(each.participant, _word(each), each.topic or ""), each) for each in system.endpoints)
    for name, endpoints in made_up.items():
        numbered = [name, *(f"{name}#{number}" for number in range(2, len(endpoints) + 1))]
        slots = {(each.participant, _word(each), each.topic) for each in endpoints}
        if len(slots) > 1 or [each.id for each in endpoints] != numbered:
            given.update(each.id for each in endpoints)
    return frozenset(given)
