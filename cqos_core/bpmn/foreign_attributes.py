"""QoS that no reader takes, in another namespace or in the wrong place: the value that it would set is unknown."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from cqos_core.bpmn.document import EXTENSIONS, split
from cqos_core.bpmn.names import POLICIES, POLICY_NAMES, key, shown
from cqos_core.model.excerpt import NAMESPACES
from cqos_core.model.settings import EVERY_OTHER, Setting
from cqos_core.packs.qos_keys import looks_like_qos

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator

    from cqos_core.bpmn.document import Document
    from cqos_core.bpmn.element import Element
    from cqos_core.bpmn.extensions import Child
    from cqos_core.model.settings import Place, Settings

Unknown: TypeAlias = "tuple[str, Setting]"
"""The name of a policy, or ``*``, and a setting that is not known."""

_NAMESPACE = f'declare `xmlns:qos="{NAMESPACES["qos"]}"`, and write `qos:` before the name'
_MEANT = re.compile(r"\W*(?:https?|urn)?\W*(?:www\.)?qos\W*", re.IGNORECASE)
_READ = frozenset(NAMESPACES.values()) - {NAMESPACES["qos"]}
_ABOUT_NO_VALUE = frozenset({"external", "type", "accept", "check", "value", "id"})
"""Words that set no value of a policy."""


class _Word(NamedTuple):
    """One word that nothing reads.

    Attributes:
        policy: the one that its name tells; empty where it sets none, ``*`` where it may set any.
        element: the element that it is, or on which it stands.
        attribute: as it is written; None where it is an element.
        cause: why it is not read, in words that all such words of one file share.
        ours: its prefix or namespace says that it was meant for C-QoS.
    """

    policy: str
    element: Element
    attribute: str | None
    cause: str
    ours: bool


class LostWords:
    """Finds words in other namespaces than ``http://qos``, and collects why they and misplaced ones are not read.

    Attributes:
        causes: each with the first place and with advice.
    """

    def __init__(self, document: Document) -> None:
        """Begin without having seen any."""
        self._document = document
        self._meant: dict[str, bool] = {}
        self.causes: dict[str, tuple[Place, str | None]] = {}

    def settings(self, element: Element, owner: Element | None = None, *, ours: bool = False) -> list[Unknown]:
        """Return what lost words on ``element`` and in its extensions were to set, as settings that are not known.

        Args:
            element: a BPMN element.
            owner: the element with the id, where that is another one.
            ours: leave out words that only have the name of a policy: they mean something else on such elements.
        """
        owner = element if owner is None else owner
        found = []
        for word in self._on(element):
            if ours and not word.ours:
                continue
            path = f"@{word.attribute}" if word.attribute and word.element is owner else None
            place = self._document.place(word.element, path, owner)
            self.causes.setdefault(word.cause, (place, _NAMESPACE))
            if word.policy:
                text = word.element.get(word.attribute) if word.attribute else ""
                found.append((word.policy, Setting(text or "", place, unknown=word.cause, reported="CQ040")))
        return found

    def misplaced(self, settings: Settings, cause: str) -> list[Unknown]:
        """Return settings that were read where they mean nothing, as not known."""
        for setting in settings.values():
            if setting.place is not None:
                self.causes.setdefault(cause, (setting.place, None))
        return [(name, replace(setting, unknown=cause, reported="CQ040")) for name, setting in settings.items()]

    def children(self, children: Iterable[Child], words: Iterable[str]) -> list[Unknown]:
        """Return what ``qos:`` elements were to set that are none of ``qos_namespace`` at this place; CQ041 reports them."""
        found: list[Unknown] = []
        for child in children:
            if child.prefix == "qos" and child.word not in words and child.word not in _ABOUT_NO_VALUE:
                cause = f"`qos:{shown(child.word)}` is not read at this place"
                names = [split(name)[1] for name in child.element.attrib] if child.word == "policy" else []
                policies = [name for name in names if key(name) in POLICIES] or [EVERY_OTHER]
                place = self._document.place(child.element, child.path, child.owner)
                found += [(policy, Setting("", place, unknown=cause, reported="CQ041")) for policy in policies]
        return found

    def _on(self, element: Element) -> Iterator[_Word]:
        yield from self._attributes(element)
        for extensions in element.having(EXTENSIONS):
            for child in extensions.children:
                namespace, local = split(child.tag)
                if namespace == NAMESPACES["qos"]:
                    continue
                if namespace not in _READ and self._is_meant(child, namespace):
                    yield from self._element(child, local, _cause(namespace))
                elif local == "properties":
                    for each in child.children:
                        yield from self._property(each, namespace)
                elif namespace not in _READ:
                    yield from self._attributes(child)

    def _attributes(self, element: Element) -> Iterator[_Word]:
        for name in element.attrib:
            namespace, local = split(name)
            if namespace == NAMESPACES["qos"]:
                continue
            ours = self._is_meant(element, namespace)
            like = looks_like_qos(local, POLICY_NAMES)
            if ours or like:
                yield _Word(_policy(local, like), element, name, _cause(namespace), ours)

    def _element(self, child: Element, local: str, cause: str) -> Iterator[_Word]:
        """Yield what an element sets whose namespace was meant to be ours."""
        if key(local) != "policy":
            yield _Word(_policy(local, None), child, None, cause, ours=True)
            return
        for name in child.attrib:
            word = split(name)[1]
            if key(word) not in _ABOUT_NO_VALUE:
                yield _Word(_policy(word, looks_like_qos(word, POLICY_NAMES)), child, name, cause, ours=True)

    def _property(self, child: Element, namespace: str) -> Iterator[_Word]:
        """Yield a property of an engine, unless it is read: its name is misspelt, or the engine is not known here."""
        name = child.get("name") or ""
        like = looks_like_qos(name, POLICY_NAMES)
        if like and key(name) != key(like):
            cause = f"the property `{shown(name)}` is not read; did you mean `{like}`?"
            yield _Word(like, child, None, cause, ours=False)
        elif like and namespace not in _READ:
            yield _Word(like, child, None, _cause(namespace), ours=False)

    def _is_meant(self, element: Element, namespace: str) -> bool:
        """Say whether a namespace was meant to be ``http://qos``: by its name, or by the prefix ``qos``."""
        if not namespace:
            return False
        if namespace not in self._meant:
            self._meant[namespace] = _is_meant(namespace, [element.namespaces.get("qos")])
        return self._meant[namespace]


def is_lost(attribute: str, called_qos: Collection[str]) -> bool:
    """Say whether an attribute looks like QoS that nothing reads there; some namespaces are ``called_qos`` by a prefix."""
    namespace, local = split(attribute)
    if namespace == NAMESPACES["qos"]:
        return False
    return bool(namespace and _is_meant(namespace, called_qos)) or looks_like_qos(local, POLICY_NAMES) is not None


def _is_meant(namespace: str, called_qos: Collection[str | None]) -> bool:
    return namespace in called_qos or _MEANT.fullmatch(namespace) is not None


def laid_under(settings: Settings, lost: Iterable[Unknown]) -> Settings:
    """Return ``settings`` of an endpoint and, for policies that they do not state, what is ``foreign_attributes``."""
    stated = {key(name) for name in settings}
    return {name: setting for name, setting in lost if key(name) not in stated} | settings


def _policy(local: str, like: str | None) -> str:
    return "" if key(local) in _ABOUT_NO_VALUE else like or EVERY_OTHER


def _cause(namespace: str) -> str:
    if not namespace:
        return f"QoS without a prefix is not read; it stands in the namespace `{NAMESPACES['qos']}`"
    return f"QoS in the namespace `{shown(namespace)}` is not read; it stands in `{NAMESPACES['qos']}`"
