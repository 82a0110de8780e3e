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
    "model": "system report report_form problems codes remarks spelling logs pattern encoding excerpt memory tls",
    "language": "evaluate relation solve name_index",
    "packs": "guarantee pack_file rule_docs",
    "resolving": "resolve overlays participants profiles reader resolved rewrites",
    "matching": "judge pairing wire routes bridging hops",
    "checking": "fixes findings team topic acceptance checker session trial",
    "analysis": "baseline differences edits applying explanation proving",
    "inputs": "loading files unread ignoring merging builtin",
    "exporters": "schema",
    "remote": "client messages",
}
"""Modules that kept their names, by room."""

RENAMED: Final = {
    **dict.fromkeys(("expression", "pack", "policy", "rule"), "packs"),
    "arrivals": "paths.delivery_paths",
    "assumed": "matching.assumptions",
    "detours": "paths.bridge_reachability",
    "given": "matching.derived_guarantees",
    "importers.editing": "exporters.editing",
    "matching.bridge_findings": "paths.bridge_findings",
    "matching.bridge_reachability": "paths.bridge_reachability",
    "matching.delivery_paths": "paths.delivery_paths",
    "mending": "analysis.system_fixes",
    "misfits": "analysis.runtime_logs",
    "mistakes": "packs.validation",
    "proving.plan": "analysis.proving.plan",
    "proving.runs": "analysis.proving.runs",
    "reading": "resolving.reader",
    "settle": "matching.peer_values",
    "shape": "matching.topic_shape",
}
"""Modules that have another name now; what authors of packs import is one module."""

MOVED: Final = RENAMED | {name: f"{room}.{name}" for room, names in ROOMS.items() for name in names.split()}


def find(fullname: str) -> ModuleSpec | None:
    """Return what loads the module that an old path names, or None for a path that never was."""
    new = MOVED.get(fullname.removeprefix("cqos_core."))
    return None if new is None else ModuleSpec(fullname, _Alias(f"cqos_core.{new}"))


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
