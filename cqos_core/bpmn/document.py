"""A BPMN document with its elements by kind and id, found in one walk through the tree."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, TypeVar

from cqos_core.bpmn.names import shown
from cqos_core.model.excerpt import NAMESPACES
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.settings import Place
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from cqos_core.bpmn.diagram_rows import Parts
    from cqos_core.bpmn.element import Element
    from cqos_core.importers.xml_source import StartTags
    from cqos_core.model.source import Source
    from cqos_core.model.system import Role

_Found = TypeVar("_Found")
BPMN = f"{{{NAMESPACES['bpmn']}}}"
DEFINITIONS = f"{BPMN}definitions"
COLLABORATION = f"{BPMN}collaboration"
PARTICIPANT = f"{BPMN}participant"
PROCESS = f"{BPMN}process"
SIGNAL = f"{BPMN}signal"
MESSAGE = f"{BPMN}message"
ITEM_DEFINITION = f"{BPMN}itemDefinition"
MESSAGE_FLOW = f"{BPMN}messageFlow"
IMPORT = f"{BPMN}import"
SIGNAL_DEFINITION = f"{BPMN}signalEventDefinition"
MESSAGE_DEFINITION = f"{BPMN}messageEventDefinition"
DEFINITION_REFERENCE = f"{BPMN}eventDefinitionRef"
CALL_ACTIVITY = f"{BPMN}callActivity"
EXTENSIONS = f"{BPMN}extensionElements"

EVENT_ROLES: dict[str, Role] = {
    f"{BPMN}startEvent": SUBSCRIBER,
    f"{BPMN}intermediateCatchEvent": SUBSCRIBER,
    f"{BPMN}boundaryEvent": SUBSCRIBER,
    f"{BPMN}intermediateThrowEvent": PUBLISHER,
    f"{BPMN}endEvent": PUBLISHER,
}
TASK_ROLES: dict[str, Role] = {f"{BPMN}receiveTask": SUBSCRIBER, f"{BPMN}sendTask": PUBLISHER}
ROLES = EVENT_ROLES | TASK_ROLES
"""By tag, the role of an event or task: an element that throws is a publisher, one that catches a subscriber."""
SILENT = frozenset(
    f"{BPMN}{name}"
    for name in (
        *("task", "userTask", "manualTask", "serviceTask", "scriptTask", "businessRuleTask", "callActivity"),
        *("subProcess", "adHocSubProcess", "transaction"),
        *("exclusiveGateway", "inclusiveGateway", "parallelGateway", "complexGateway", "eventBasedGateway"),
    )
)
"""Elements that neither throw nor catch a signal; QoS on them is reported."""

_INDEXED = (
    *(COLLABORATION, PARTICIPANT, PROCESS, SIGNAL, MESSAGE, ITEM_DEFINITION, MESSAGE_FLOW, IMPORT),
    CALL_ACTIVITY,
)
ZEEBE_CALL = f"{{{NAMESPACES['zeebe']}}}calledElement"


def require_bpmn(root: Element, source: Source, tags: StartTags) -> None:
    """Raise `InputError` unless ``root`` is the root of a BPMN 2.0 model."""
    if root.tag == DEFINITIONS:
        return
    namespace, local = split(root.tag)
    where = f"in the namespace `{shown(namespace)}`" if namespace else "in no namespace"
    message = f"this is not BPMN 2.0 (20100524): the first element is `{shown(local)}` {where}"
    advice = f"expected `definitions` in `{NAMESPACES['bpmn']}`; save the model as BPMN 2.0"
    raise InputError([Problem("CQ030", message, Place(source.name, tags.line(0)), advice)])


def split(tag: str) -> tuple[str, str]:
    """Return namespace URI and local name of ``{uri}local``."""
    namespace, brace, local = tag.rpartition("}")
    return (namespace[1:], local) if brace else ("", tag)


def identity(element: Element) -> str | None:
    """Return the id of an element; an empty one is none."""
    return element.get("id") or None


class Document:
    """The elements of a BPMN model that matter here, in the order of the document.

    Attributes:
        root: the ``definitions``.
        name: the name of the source.
        nodes: every event and task that can throw or catch, wherever it is nested; their tags are those of `ROLES`. One stands for
            all events of a run of rows.
        parts: rows of events, and signals that are not in the tree: they are not among `all`.
        definitions: event definitions at root level, by id, to which events may refer.
    """

    def __init__(self, parts: Parts, name: str, tags: StartTags, *, lines: bool = True) -> None:
        """Walk once through the tree.

        Without ``lines``, places that name an element have none.
        """
        self.root = root = parts.root
        self.name = name
        self.parts = parts
        self._tags = tags
        self._with_lines = lines
        self.nodes: list[Element] = []
        self._elements: dict[str, list[Element]] = {tag: [] for tag in _INDEXED}
        self._walk(root)
        self._by_id = {tag: _first_by_id(elements) for tag, elements in self._elements.items()}
        for signal in parts.signals.keys() & self._by_id[SIGNAL].keys():
            del self._by_id[SIGNAL][signal]  # one that is not in the tree is the first of its id
        self.definitions = _first_by_id(child for child in of_bpmn(root) if child.tag.endswith("EventDefinition"))

    def _walk(self, root: Element) -> None:
        waiting = [root]
        while waiting:
            element = waiting.pop()
            if element.tag == EXTENSIONS:
                continue  # whatever is in it belongs to its tools: events are none of the model
            if element.tag in self._elements:
                self._elements[element.tag].append(element)
            elif element.tag in ROLES:
                self.nodes.append(element)
            waiting += reversed(element.children)

    @cached_property
    def _process_of(self) -> dict[Element, Element]:
        return {element: process for process in self.all(PROCESS) for element in process.walk()}

    def all(self, tag: str) -> list[Element]:
        """Return every element with one of the indexed tags."""
        return self._elements[tag]

    def find(self, tag: str, reference: str, at: Element) -> Element | None:
        """Return the element that a QName refers to, where it stands at ``at``; see `look_up`."""
        return self.look_up(self._by_id[tag], reference, at)

    def look_up(self, elements: Mapping[str, _Found], reference: str, at: Element) -> _Found | None:
        """Return the element of this file that a QName at ``at`` refers to.

        Ids may hold a colon themselves. A prefix that is bound to another namespace than that of the file means another file;
        many files write a prefix that is bound to nothing, and mean their own elements.
        """
        reference = reference.strip()
        found = elements.get(reference)
        if found is not None or ":" not in reference:
            return found
        prefix, _, local = reference.rpartition(":")
        own, meant = self.root.get("targetNamespace"), at.namespaces.get(prefix) if prefix else None
        return elements.get(local) if own is None or meant in {None, own, NAMESPACES["bpmn"]} else None

    def called_by(self, activity: Element) -> Element | None:
        """Return the process of this file that a call activity runs, None where it runs something else."""
        stated = [activity.get("calledElement")]
        for extensions in activity.having(EXTENSIONS):
            stated += [each.get("processId") for each in extensions.having(ZEEBE_CALL)]
        found = (self.find(PROCESS, reference, activity) for reference in stated if reference)
        return next((process for process in found if process is not None), None)

    def process_of(self, element: Element) -> Element | None:
        """Return the process around ``element``, None if it stands outside of all of them."""
        return self._process_of.get(element)

    def event_definitions(self, event: Element, tag: str) -> list[Element]:
        """Return the event definitions of one kind, its own and those at root level that it refers to."""
        children = event.having(tag, DEFINITION_REFERENCE)
        found = (child if child.tag == tag else self.look_up(self.definitions, child.text, child) for child in children)
        return [definition for definition in found if definition is not None and definition.tag == tag]

    def place(self, element: Element, path: str | None = None, owner: Element | None = None) -> Place:
        """Return where ``element`` is; ``owner`` is the element with the id, ``path`` starts at it."""
        name = identity(element if owner is None else owner)
        line = self._tags.line(element.number) if self._with_lines or name is None else None
        return Place(self.name, line, None, name, path)


def of_bpmn(above: Element) -> list[Element]:
    """Return the elements of the standard directly in another one."""
    return [child for child in above.children if child.tag.startswith(BPMN)]


def nth(element: Element, above: Element) -> int:
    """Return the one-based number of ``element`` among the elements in the one ``above`` that have the same tag."""
    return 1 + [*above.having(element.tag)].index(element)


def _first_by_id(elements: Iterable[Element]) -> dict[str, Element]:
    found: dict[str, Element] = {}
    for element in elements:
        if name := identity(element):
            found.setdefault(name, element)
    return found
