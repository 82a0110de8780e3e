"""C-QoS by its short name: all that `cqos_core` has, loaded on first use; in `cqos.v1`, what .proto files make."""

from typing import TYPE_CHECKING

import cqos_core

if TYPE_CHECKING:
    from cqos_core import *
else:

    def __getattr__(name):
        """Return what `cqos_core` has under this name."""
        return getattr(cqos_core, name)


def __dir__() -> list[str]:
    """List the public names."""
    return [*dir(cqos_core), "v1"]
