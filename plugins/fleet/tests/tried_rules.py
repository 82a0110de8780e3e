"""Rules of packs over random pairs: as columns, and what Python says of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cqos_fleet.source_text import CompiledPack, compiled_pack
from cqos_fleet.writers import expression
from plugins.fleet.tests.needed import needed
from plugins.fleet.tests.random_ends import ends_of_system, random_ends, said
from plugins.fleet.tests.random_fleet import any_rows

if TYPE_CHECKING:
    from cqos_core.packs import RulePack
    from cqos_fleet.forms import Column, RuleForm
    from plugins.fleet.tests.random_ends import End

PAIRS = 150
OF_SYSTEM = 50
"""Pairs of a random system, whose values the pack resolved; the others have any values."""


class Tried:
    """Random pairs of a pack, in columns, and what its rules say of them."""

    def __init__(self, pack: RulePack, rules: list[RuleForm], ends: list[tuple[End, End]], *, alone: bool) -> None:
        self.pack, self.rules = pack, rules
        self.ends = [(first, first) for first, _ in ends] if alone else ends
        self.expected = [[said(rule, *pair) for rule in rules] for pair in self.ends]
        used = {each for rule in rules for form in (rule.reports, rule.unknown) for each in form.reads()}
        self.columns = sorted({each._replace(second=False) for each in used})

    def table(self, side: int) -> dict[str, list[Any]]:
        rows = [pair[side].cells(self.pack, self.columns) for pair in self.ends]
        cells = dict(zip((self.name(each) for each in self.columns), map(list, zip(*rows, strict=True)), strict=True))
        numbers = [*range(len(rows))]
        return {"id": [str(each) for each in numbers], "topic": numbers, **cells}

    def name(self, column: Column) -> str:
        return column.name(self.pack.vocabulary)


def both_kinds(pack: RulePack, seed: int = 0) -> list[tuple[CompiledPack, Tried]]:
    """Return the rules of a pack over pairs, and those over endpoints, with random pairs."""
    ends = random_ends(pack, PAIRS - OF_SYSTEM, f"{pack.id}{seed or ''}")
    return both_kinds_over(
        pack, [*ends, *ends_of_system(pack, any_rows(pack.id, seed, PAIRS), OF_SYSTEM, f"{pack.id}{seed}")]
    )


def both_kinds_over(pack: RulePack, ends: list[tuple[End, End]]) -> list[tuple[CompiledPack, Tried]]:
    """Return the rules of a pack over pairs, and those over endpoints, with these ends."""
    compiled = compiled_pack(pack)
    return [(compiled, Tried(pack, [*rules], ends, alone=at == 1)) for at, rules in enumerate(compiled[:2])]


def both_ends(tried: Tried) -> Any:
    """Return a table of Arrow with a row for each pair."""
    cells = {
        f"{'or'[side]}{at}": cells for side in (0, 1) for at, cells in enumerate([*tried.table(side).values()][2:])
    }
    return needed("pyarrow").table({"n": [*range(PAIRS)], **cells})


def answers_in(frame: Any, tried: Tried) -> list[list[tuple[bool, bool]]]:
    """Return for each pair what each rule says in a frame of Narwhals over `both_ends`."""
    nw = needed("narwhals")
    at = {column: index for index, column in enumerate(tried.columns)}

    def column(each: Column) -> Any:
        return nw.col(f"{'or'[each.second]}{at[each._replace(second=False)]}")

    asked = {
        f"{kind}{number}": expression(form, column)
        for number, rule in enumerate(tried.rules)
        for kind, form in (("reports", rule.reports), ("unknown", rule.unknown))
    }
    rows = frame.select("n", *[each.alias(name) for name, each in asked.items()]).sort("n").collect("pyarrow")
    found = rows.to_native().to_pylist()
    return [[(row[f"reports{n}"], row[f"unknown{n}"]) for n in range(len(tried.rules))] for row in found]
