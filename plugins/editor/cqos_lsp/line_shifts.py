"""Maps lines of a checked text to lines of the edited text, and back."""

from __future__ import annotations

from cqos_core.model.dataclass import dataclass
from cqos_lsp.positions import lines_of


@dataclass(frozen=True, slots=True)
class LineShift:
    """The lines that two versions of a text share at the start and at the end.

    Attributes:
        first: the number of shared lines at the start.
        old: the one-based first shared line at the end, in the old text.
        new: the same in the new text.
    """

    first: int
    old: int
    new: int

    @classmethod
    def between(cls, then: bytes, now: bytes) -> LineShift:
        """Compare two texts."""
        if then == now:
            return cls(0, 1, 1)
        old, new = (lines_of(data).text.split("\n") for data in (then, now))
        first = next((at for at, (a, b) in enumerate(zip(old, new, strict=False)) if a != b), min(len(old), len(new)))
        most = min(len(old), len(new)) - first
        last = next((at for at in range(most) if old[-1 - at] != new[-1 - at]), most)
        return cls(first, len(old) - last + 1, len(new) - last + 1)

    @property
    def unchanged(self) -> bool:
        """Whether the texts are the same."""
        return self.first == 0 and self.old == self.new == 1

    def after(self, line: int) -> int | None:
        """Return the line of the new text for one of the old text; None if it was edited."""
        return _moved(line, self.first, self.old, self.new)

    def before(self, line: int) -> int | None:
        """Return the line of the old text for one of the new text; None if it was edited."""
        return _moved(line, self.first, self.new, self.old)


def _moved(line: int, first: int, old: int, new: int) -> int | None:
    if line <= first:
        return line
    return line - old + new if line >= old else None
