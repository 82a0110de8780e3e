"""What the importers of ROS 2 files report, beside what all importers do (``CQ0xx``).

ROS900-ROS929: what was observed (snapshots and recordings); ROS930-ROS959: what is configured.
"""

from __future__ import annotations

from typing import Final

from cqos_core.codes import CodeInfo

OBSERVED: Final[tuple[CodeInfo, ...]] = ()
CONFIGURED: Final[tuple[CodeInfo, ...]] = ()

CODES: Final = (*OBSERVED, *CONFIGURED)
