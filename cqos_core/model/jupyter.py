"""Display of results in Jupyter notebooks: tables of findings, policies and guarantees."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from typing import Protocol

    class _Printer(Protocol):
        """The printer that IPython passes."""

        def text(self, obj: str) -> object:
            """Write something."""

    class _Finding(Protocol):
        """The columns of a finding."""

        @property
        def severity(self) -> object: ...
        @property
        def code(self) -> str: ...
        @property
        def message(self) -> str: ...
        @property
        def place(self) -> object: ...


_SHOWN: Final = 100  # findings in a notebook


class JupyterDisplay:
    """Base of results that a notebook shows at the end of a cell."""

    __slots__ = ()
    findings: tuple[_Finding, ...]

    def _repr_pretty_(self, printer: _Printer, cycle: bool) -> None:  # noqa: ARG002, FBT001 - as IPython calls it
        printer.text(str(self))

    def _repr_html_(self) -> str:
        from html import escape  # only notebooks ask

        rows = "".join(
            f"<tr><td>{each.severity}</td><td>{each.code}</td><td>{escape(each.message)}</td><td>{escape(str(each.place or ''))}</td></tr>"
            for each in self.findings[:_SHOWN]
        )
        more = f"<p>{len(self.findings) - _SHOWN} more findings</p>" if len(self.findings) > _SHOWN else ""
        head = f"<p><b>{escape(str(self).partition(chr(10))[0])}</b></p>"
        return "".join((head, f"<table>{rows}</table>{more}" if rows else "", *self._tables(escape)))

    def _tables(self, escape: Callable[[str], str]) -> Iterator[str]:
        """Yield the tables of an explained pair: its policies, and its guarantees under each fault."""
        policies, guarantees = getattr(self, "policies", ()), getattr(self, "guarantees", ())
        faults = [cell.fault for each in guarantees[:1] for cell in each.cells]
        ends = [(each.policy, each.offered, each.requested, each.verdict or "") for each in policies]
        compared = [(name, a.value if a else "", b.value if b else "", word) for name, a, b, word in ends]
        given = [(each.word, *(cell.value for cell in each.cells)) for each in guarantees]
        for head, rows in ((("policy", "offered", "requested", "verdict"), compared), (("guarantee", *faults), given)):
            body = "".join(f"<tr>{''.join(f'<td>{escape(each)}</td>' for each in row)}</tr>" for row in rows)
            if body:
                yield f"<table><tr>{''.join(f'<th>{escape(each)}</th>' for each in head)}</tr>{body}</table>"
