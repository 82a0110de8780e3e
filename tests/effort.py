"""How much a run tries: `dev.py test` a short form of everything, `dev.py explore` all of it and new random examples.

What is tried more of in the second has the mark ``explored``, so that it is run there.
"""

from __future__ import annotations

import os
from typing import Final

from hypothesis import settings

EXPLORE: Final = os.environ.get("CQOS_HYPOTHESIS") == "explore"
EXAMPLES: Final = settings.default.max_examples if settings.default is not None else 20
"""Random examples of each property."""
