"""Files become systems, and systems become files.

`opening` and `loading` say which files there are and which importer reads each; `merging` makes one system of several. `exporting`
and the modules ``*_writer`` write a system in another form. `applying` and `edits` write fixes into files that exist.
"""

import importlib
from typing import TYPE_CHECKING

if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        """Return what `opening` has: it had this path before there were rooms, and keeps it until the first release."""
        return getattr(importlib.import_module("cqos_core.files.opening"), name)
