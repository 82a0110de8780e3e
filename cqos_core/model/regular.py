"""`re` with possessive quantifiers and atomic groups. Python 3.10 lacks them; there the package `regex` has them."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING or sys.version_info >= (3, 11):
    import re
else:
    import regex as re

__all__ = ["re"]
