"""C-QoS: says at design time which publishers and subscribers fit, which do not, and what cannot be known.

>>> import cqos_core as cqos
>>> pair = cqos.check_pair("ros2", offered={"reliability": "best_effort"}, requested={"reliability": "reliable"})
>>> str(pair.verdict)
'incompatible'

`__init__.pyi` lists the public names. Each is loaded on first use, so importing the package costs next to nothing.
"""

from importlib import import_module
from pathlib import Path

_LINES = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8").splitlines()
_MODULES = {line.split()[3]: line.split()[1] for line in _LINES if line.startswith("from ")}
"""By public name, the module that has it."""

__all__ = sorted(_MODULES)  # noqa: PLE0605 - type checkers read the names in `__init__.pyi`


def __getattr__(name: str) -> object:
    """Load a public name from its module on first use."""
    if name not in _MODULES:
        raise AttributeError(f"module `cqos_core` has no attribute `{name}`")
    value = globals()[name] = getattr(import_module(_MODULES[name]), name)
    return value


def __dir__() -> list[str]:
    """Return the public names."""
    return __all__
