"""Module paths from before modules moved into rooms; they work until the first release.

Nothing imports this module unless an old path is asked for.
"""

from __future__ import annotations

import importlib
from functools import partial
from importlib.abc import Loader
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Final

ROOMS: Final = {
    "model": "system report report_form problems codes remarks spelling pattern encoding excerpt memory",
    "language": "evaluate relation solve name_index",
    "packs": "logs guarantee pack_file rule_docs",
    "resolving": "resolve overlays participants profiles reader resolved rewrites",
    "matching": "judge pairing wire routes bridging hops",
    "checking": "fixes findings team topic acceptance checker session trial",
    "analysis": "baseline differences explanation proving planning",
    "behaviour": "paths",
    "files": "applying builtin edits ignoring loading merging schema unread",
    "remote": "client messages tls",
}
"""Modules that kept their names, by room."""

ROOMS_BEFORE: Final = {
    "analysis": ("files", "applying edits"),
    "exporters": ("files", "design editing schema yaml_text"),
    "inputs": ("files", "builtin ignoring loading merging reading unread"),
    "paths": (
        "behaviour.paths",
        "bridge_findings bridge_reachability budget_findings budgets chain_findings chains delivery_paths link_facts time_ranges",
    ),
    "planning": ("analysis.planning", "constraints model search slots suggestion"),
}
"""Modules that changed their room, by the room before."""

RENAMED: Final = {
    **dict.fromkeys(("expression", "pack", "policy", "rule"), "packs"),
    "arrivals": "behaviour.paths.delivery_paths",
    "assumed": "checking.assumptions",
    "exporters": "files",
    "exporters.bpmn_form": "files.bpmn_writer",
    "exporters.contract": "files.exporting",
    "exporters.yaml_form": "files.yaml_writer",
    "inputs": "files",
    "inputs.files": "files.opening",
    "detours": "behaviour.paths.bridge_reachability",
    "given": "matching.derived_guarantees",
    "importers.editing": "files.editing",
    "importers.source": "model.source",
    "matching.bridge_findings": "behaviour.paths.bridge_findings",
    "matching.bridge_reachability": "behaviour.paths.bridge_reachability",
    "matching.delivery_paths": "behaviour.paths.delivery_paths",
    "formatters.style": "model.style",
    "importers.documents": "packs.documents",
    "importers.drawn": "packs.drawn",
    "importers.foreign": "packs.foreign",
    "importers.qos_keys": "packs.qos_keys",
    "mending": "analysis.system_fixes",
    "misfits": "analysis.runtime_logs",
    "mistakes": "packs.validation",
    "proving.plan": "packs.proving",
    "proving.runs": "analysis.proving.runs",
    "analysis.proving.plan": "packs.proving",
    "model.logs": "packs.logs",
    "planning.formulas": "language.formulas",
    "planning.solver": "language.solver",
    "reading": "resolving.reader",
    "settle": "matching.peer_values",
    "shape": "matching.topic_shape",
}
"""Modules that have another name now; what authors of packs import is one module."""

MOVED: Final = (
    RENAMED
    | {name: f"{room}.{name}" for room, names in ROOMS.items() for name in names.split()}
    | {f"{old}.{name}": f"{new}.{name}" for old, (new, names) in ROOMS_BEFORE.items() for name in names.split()}
)


LEFT: Final = {"bulk": "cqos_bulk", "pictures": "cqos_pictures"}
"""Rooms that became distributions, by the package that has them now."""


def find(fullname: str) -> ModuleSpec | None:
    """Return what loads the module that an old path names, or None for a path that never was."""
    old = fullname.removeprefix("cqos_core.")
    room, dot, rest = old.partition(".")
    new = LEFT[room] + dot + rest if room in LEFT else f"cqos_core.{MOVED[old]}" if old in MOVED else None
    return None if new is None else ModuleSpec(fullname, _Alias(new))


class _Alias(Loader):
    """Loads a module under its old path: a plain module is the same object, a package hands on its names."""

    def __init__(self, name: str) -> None:
        self.module = importlib.import_module(name)
        self.spec = self.module.__spec__

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Return the module under its new path."""
        return ModuleType(spec.name) if hasattr(self.module, "__path__") else self.module

    def exec_module(self, module: ModuleType) -> None:
        """Leave a module as it was imported."""
        if module is self.module:
            module.__spec__ = self.spec  # the import system has put that of the old path there
        else:
            module.__path__ = []  # so that its modules are looked for here
            module.__getattr__ = partial(getattr, self.module)  # type: ignore[method-assign]
