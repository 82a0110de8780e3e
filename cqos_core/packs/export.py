"""Input and output of exporters."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Protocol

from cqos_core.model.codes import find_code
from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cqos_core.model.code_info import CodeInfo
    from cqos_core.model.system import System
    from cqos_core.packs.pack import RulePack
    from cqos_core.packs.rule import Rule


@dataclass(frozen=True, slots=True)
class ExportContext:
    """Everything that a writer may use beside the system.

    Attributes:
        find_pack: returns the rule pack of an id, or None.
        default_protocol: judges endpoints for which the system states none.
        settings: of the exporter, by name; each has a value that the exporter allows.
        find_rule: returns the rule of a code, or what is known of the code of a note; None if no pack and not the core has it.
        changed: ids of endpoints and policies that fixes changed; the system has the changes already. An exporter of
            settings writes nothing else then. None: it writes everything.
    """

    find_pack: Callable[[str], RulePack | None]
    default_protocol: str | None = None
    settings: Mapping[str, str] = field(default_factory=dict)
    changed: frozenset[tuple[str, str]] | None = None
    find_rule: Callable[[str], Rule | CodeInfo | None] = find_code

    def wants(self, endpoint_id: str, policy: str | None = None) -> bool:
        """Return whether to write an endpoint, or one policy of it."""
        if self.changed is None:
            return True
        return any(endpoint == endpoint_id and policy in {None, name} for endpoint, name in self.changed)


@dataclass(frozen=True, slots=True)
class Exported:
    """The output of a writer.

    Attributes:
        text: the whole file.
        expressed: how many endpoints, or topics, are in it; 0: nothing of the system could be expressed.
        notes: what the form cannot say and was left out, one sentence each.
        files: the files of a form that is a folder, by their paths in it; ``text`` then shows them one after the other.
    """

    text: str
    expressed: int
    notes: tuple[str, ...] = ()
    files: Mapping[str, str] = field(default_factory=dict)


class Writer(Protocol):
    """Writes a system down in one form."""

    def __call__(self, system: System, context: ExportContext) -> Exported:
        """Return the file; neither ``system`` nor anything in it is changed."""
