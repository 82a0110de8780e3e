"""Which launch files of a workspace include which, whatever their conditions, and how much each starts."""

from __future__ import annotations

import posixpath
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from cqos_ros2_workspace.launch.launch_evaluation import Launch, launch
from cqos_ros2_workspace.launch.python_names import TooMuchError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_ros2_workspace.launch.workspace import Workspace

_MOST_FILES: Final = 500
"""How many launch files are followed; others count as included by none."""


@dataclass(slots=True)
class Includes:
    """The launch files of a workspace, by real path.

    Attributes:
        direct: the files that each includes, as far as they are known.
    """

    files: list[str]
    direct: dict[str, dict[str, None]] = field(default_factory=dict)

    def reached(self, path: str) -> set[str]:
        """Return the files that one includes, directly or through others."""
        found: set[str] = set()
        waiting = [path]
        while waiting:
            new = self.direct.get(waiting.pop(), {}).keys() - found
            found |= new
            waiting += new
        return found - {path}

    def roots(self) -> list[str]:
        """Return the files that no other includes; of files that include each other in a circle, all."""
        included = {each: {by for by, others in self.direct.items() if each in others} for each in self.files}
        return [each for each in self.files if included[each] <= self.reached(each) | {each}]


class _Everything(Launch):
    """A launch whose conditions all hold, which notes the includes."""

    def __init__(self, workspace: Workspace, entry: str, found: Includes) -> None:
        super().__init__(workspace, {}, {})
        self.includes = found
        self.found.entry = self.file = entry
        self.chain.append(entry)

    def decide(self, action: Any) -> Any:
        """Take both what a condition allows and what it excludes."""
        del action
        return True

    def run_file(self, path: str) -> None:
        """Note who includes the file."""
        self.includes.direct.setdefault(path, {})
        if len(self.chain) > 1:
            self.includes.direct.setdefault(self.chain[-2], {})[path] = None
        super().run_file(path)


def includes_of(files: Sequence[str], workspace: Workspace) -> Includes:
    """Follow launch files, given by their real paths."""
    found = Includes([*files])
    # Files whose names others mention are probably reached from these.
    texts = {each: data for each in files if isinstance(data := workspace.read(each, None), bytes)}
    mentioned = {
        each
        for each in files
        if any(posixpath.basename(each).encode() in text for other, text in texts.items() if other != each)
    }
    for each in sorted(files, key=lambda each: each in mentioned)[:_MOST_FILES]:
        if each in found.direct:
            continue
        run = _Everything(workspace, each, found)
        with suppress(TooMuchError, RecursionError):  # what was followed until then counts
            run.run_file(each)
    return found


def started_by(path: str, workspace: Workspace) -> int:
    """Return how many nodes a launch file starts with the defaults of its arguments."""
    return sum(each.kind != "process" for each in launch(workspace, path, {}, {}).instances)
