"""Reads packages of a workspace for those who check it: the function ``ros2-sources``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.model.optional_features import missing
from cqos_ros2_sources.node_files.node_file_maker import learn
from cqos_ros2_sources.programs.packages import NoParserError, Parsed

if TYPE_CHECKING:
    from cqos_ros2_sources.node_files.node_file_maker import Learned
    from cqos_ros2_workspace.launch.workspace import Workspace


class SourceReader:
    """Reads packages of one workspace, each source once; a `cqos_ros2_workspace.nodes.library.SourceReader`."""

    def __init__(self) -> None:
        self._parsed = Parsed()

    def __call__(self, package: str, workspace: Workspace) -> Learned:
        """Return what the sources of a package say about its nodes.

        Raises:
            InputError: what they say cannot be written down.
            MissingError: they are in C++, and their parser is not installed.
        """
        try:
            return learn(package, workspace, parsed=self._parsed)
        except NoParserError:
            raise missing("ros2_sources", "its sources in C++ were not read") from None
