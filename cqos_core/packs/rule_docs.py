"""Pages about rules and codes, derived from them: Markdown for the docs, text for ``cqos rule``."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Final, TypeAlias

from cqos_core.language.expression import definitions
from cqos_core.language.solutions import may_change
from cqos_core.model.codes import CODES, CodeInfo, find_code
from cqos_core.model.dataclass import dataclass
from cqos_core.model.suggestions import listed
from cqos_core.packs.catalogue import assumed_options, rule_table

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from cqos_core.language.expression import Condition
    from cqos_core.language.vocabulary import Use
    from cqos_core.packs.bound_rule import BoundRule
    from cqos_core.packs.pack import RulePack
    from cqos_core.packs.rule import Rule


# What a page holds


@dataclass(frozen=True, slots=True)
class Paragraph:
    """Running text."""

    text: str


@dataclass(frozen=True, slots=True)
class Listing:
    """Points, one beneath the other."""

    items: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Sample:
    """Text to be shown as it is; ``language`` colours it."""

    text: str
    language: str = ""


@dataclass(frozen=True, slots=True)
class Grid:
    """A table."""

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


Block: TypeAlias = Paragraph | Listing | Sample | Grid


@dataclass(frozen=True, slots=True)
class Page:
    """A title, and sections of blocks; the first section has no heading."""

    title: str
    sections: tuple[tuple[str, tuple[Block, ...]], ...]


@dataclass(frozen=True, slots=True)
class Example:
    """One case of a rule's case file, with its settings as YAML."""

    name: str
    text: str
    fires: bool


# Rules


def rule_page(bound: BoundRule, pack: RulePack, examples: Iterable[Example] = ()) -> Page:
    """Derive a page from a rule."""
    rule = bound.rule
    source = f" Source: {rule.clause}." if rule.clause else ""
    sections: list[tuple[str, tuple[Block, ...]]] = [
        ("", (Paragraph(_sentence(rule.because)), Paragraph(f"{_severity(bound)} A rule of {pack.title}.{source}"))),
    ]
    if (grid := derived_table(bound)) is not None:
        samples = any(bound.bound.vocabulary.policies[use.index].domain.kind in _SAMPLED for use in bound.bound.uses)
        notes = ["Durations and counts are examples."] if samples else []
        if assumed := dict.fromkeys(f"{use.term.name} `{value}`" for use, value in assumed_texts(bound)):
            notes.append(f"This is the table for {', '.join(assumed)}.")
        sections.append(("Compatible values", (grid, *map(Paragraph, notes))))
    if changes := _changes(bound):
        sections.append(("What to do", (Listing(changes),)))
    for example in examples:
        heading = "Example" if example.fires else "Example without the finding"
        outcome = f"reports {rule.code}" if example.fires else f"does not report {rule.code}"
        introduction = f"{_sentence(example.name)} Pasted into `cqos check -`, this {outcome}:"
        sections.append((heading, (Paragraph(introduction), Sample(example.text, "yaml"))))
    if rule.aliases:
        sections.append(("Former codes and names", (Paragraph(", ".join(rule.aliases)),)))
    sections.append((CONDITION, (*_condition(rule.condition), *map(Paragraph, _meaning(bound)))))
    return Page(f"{rule.code} {rule.name}", tuple(sections))


CONDITION: Final = "Condition"  # the heading of the section that Markdown folds


def _condition(condition: Condition) -> Iterator[Block]:
    """Yield a condition, then the definitions that it uses."""
    yield Sample(str(condition), "python")
    if used := definitions(condition):
        yield Paragraph("Definitions:")
        yield Sample("\n".join(f"{name} =\n  {node.text()}" for name, node in used.items()), "python")


_SAMPLED: Final = frozenset({"duration", "count"})


def assumed_texts(bound: BoundRule) -> Iterable[tuple[Use, str]]:
    """The options that a table assumes, with their values as text."""
    policies = bound.bound.vocabulary.policies
    return ((use, policies[use.index].format(value)) for use, value in assumed_options(bound))


_SIDES: Final = {"offered": "Publisher", "requested": "Subscriber"}


def derived_table(bound: BoundRule) -> Grid | None:
    """Return the table of a rule that compares one value of each side, in the form of Table 1 of the C-QoS paper.

    The rows come out of the sentence (`rule_table`); rules over more values, or over none that can be listed, have none.
    """
    rows = rule_table(bound)
    columns = [column for column in rows[0] if column != "compatible"] if rows else []
    scopes = [column.partition(" ")[0] for column in columns]
    policies = {column.partition(" ")[2] for column in columns}
    if sorted(scopes) != sorted(_SIDES):
        return None
    header = [
        _SIDES[scope] if len(policies) == 1 else f"{_SIDES[scope]} {column.partition(' ')[2]}"
        for scope, column in zip(scopes, columns, strict=True)
    ]
    listed = tuple(tuple(row[column] for column in (*columns, "compatible")) for row in rows)
    return Grid((*header, "Compatible"), listed)


def _severity(bound: BoundRule) -> str:
    rule = bound.rule
    if not isinstance(rule.severity, str):
        values = bound.option.domain.candidates()
        cases = {text: bound.severities.get(text, "not checked") for text in map(bound.option.domain.format, values)}
        listed = ", ".join(f"{severity} for `{text}`" for text, severity in cases.items())
        return f"{bound.severity.capitalize()} by default. Option `{bound.option.name}` sets the severity: {listed}."
    name = rule.severity.capitalize()
    if bound.breaks_pairs or (rule.kind == "requires" and rule.severity == "error"):
        return "Warning." if rule.doubt else f"{name}; a warning if it cannot be decided."
    return f"{name}."


_SUBJECTS: Final = {
    "pair": "a publisher and a subscriber that match",
    "endpoint": "an endpoint",
    "participant": "a participant",
    "broker": "a broker",
    "signal": "a topic with all its publishers and subscribers",
    "system": "the system",
}


def _meaning(bound: BoundRule) -> list[str]:
    """Say in words when the rule reports a finding."""
    rule, subject = bound.rule, _SUBJECTS[bound.scope]
    if bound.scope == "endpoint" and bound.role:
        subject = f"a {bound.role}"
    if rule.kind == "meets":
        reported = "every pair that it keeps apart" if rule.always else "endpoints that it leaves without a partner"
        matching = "Two endpoints on one topic match only if this holds; otherwise no other rule checks them"
        said = [f"{matching}. The rule reports {reported}."]
    elif bound.breaks_pairs:
        holds = f"If this holds for {subject}, the pair is incompatible"
        said = [f"{holds}. If it cannot be decided, the rule reports a warning."]
    elif rule.kind == "forbids":
        said = [f"The rule reports a finding if this certainly holds for {subject}."]
    else:
        verdict = "unknown" if rule.doubt else "incompatible"
        broken = f"; if it does not, the pair is {verdict}" if bound.scope == "pair" else ""
        undecided = "is silent" if rule.creation else "reports a warning"
        said = [f"This must hold for {subject}{broken}. If it cannot be decided, the rule {undecided}."]
    if rule.creation:
        said.append("It concerns the creation of an endpoint, so endpoints that were observed running are exempt.")
    return said


def _changes(bound: BoundRule) -> tuple[str, ...]:
    """List what can be changed to satisfy the rule, side by side, and what the rule itself advises."""
    changes: dict[str, list[str]] = {}
    causes: dict[str, str] = {}
    for use in bound.bound.uses:
        policy = bound.bound.vocabulary.policies[use.index]
        if not may_change(policy.name, use.term.scope, bound.rule.fixes):
            continue
        if policy.derived:
            causes[policy.name] = listed([f"`{name}`" for name in policy.follows])
        elif policy.level == "endpoint" and policy.default is not None:
            changes.setdefault(_whose(use, bound), []).append(f"`{policy.name}`")
    direct = [f"{' or '.join(dict.fromkeys(names))} of the {whose}" for whose, names in changes.items()]
    change = [f"Change {', or '.join(direct)}."] if direct else []
    change += [f"Change what `{name}` follows from: {policies}." for name, policies in causes.items() if policies]
    said = change if bound.rule.kind != "meets" else []
    return (*said, *([_sentence(bound.rule.help)] if bound.rule.help else []))


def _whose(use: Use, bound: BoundRule) -> str:
    side = {"offered": "publisher", "requested": "subscriber"}.get(use.term.scope)
    return side or bound.role or "endpoint"


def _sentence(text: str) -> str:
    """Begin with a capital, unless the first word is a name, and end with a stop."""
    first = text.partition(" ")[0]
    if first.isalpha() and first.islower():
        text = text[0].upper() + text[1:]
    return text if text.endswith((".", "!", "?")) else f"{text}."


# Codes


def code_page(info: CodeInfo, pack: RulePack | None = None) -> Page:
    """Derive a page from a code of the core, or of the importers that come with ``pack``."""
    reporter = "C-QoS itself, for every protocol" if pack is None else f"the importers of {pack.title}"
    sections: list[tuple[str, tuple[Block, ...]]] = [
        ("", (Paragraph(info.summary), Paragraph(f"{info.severity.capitalize()}. Reported by {reporter}."))),
    ]
    if info.reason:
        sections.append(("Why" if info.help else "Why, and what to do", (Paragraph(info.reason),)))
    if info.help:
        sections.append(("What to do", (Paragraph(_sentence(info.help)),)))
    return Page(f"{info.code} {info.name}", tuple(sections))


# Finding them


@dataclass(frozen=True, slots=True)
class Reported:
    """A code of the core, or of the importers that come with ``pack``."""

    info: CodeInfo
    pack: RulePack | None = None


def find(name: str, packs: Iterable[RulePack]) -> tuple[BoundRule, RulePack] | Reported | None:
    """Return what ``name`` spells: a rule of a pack, a code of its importers, or a code of the core."""
    wanted = name.strip().lower()
    for pack in _with_variants(packs):
        rule = pack.rule(wanted)
        if rule is not None:
            return next(bound for bound in pack.bound_rules if bound.rule is rule), pack
        info = pack.code(wanted)
        if info is not None:
            return Reported(info, pack)
    own = find_code(wanted)
    return None if own is None else Reported(own)


def names(packs: Iterable[RulePack]) -> list[str]:
    """All names that `find` knows, for suggestions."""
    named: list[Rule | CodeInfo] = [*CODES.values()]
    for pack in _with_variants(packs):
        named += (*pack.rules, *pack.codes)
    return [spelling for each in named for spelling in (each.code, each.name, *each.aliases)]


def _with_variants(packs: Iterable[RulePack]) -> list[RulePack]:
    """The packs, then the variants of them, whose rules mostly are those of the packs."""
    listed = list(packs)
    return [*listed, *(variant for pack in listed for variant in pack.variants.values())]


# Writing pages


def as_markdown(page: Page) -> str:
    """Write a page for the docs."""
    parts = [f"# {page.title}"]
    for heading, blocks in page.sections:
        folded = heading == CONDITION
        parts += (
            [f'<details markdown="1">\n<summary>{heading}</summary>' if folded else f"## {heading}"] if heading else []
        )
        parts += [*map(_block_as_markdown, blocks), *(["</details>"] if folded else [])]
    return "\n\n".join(parts) + "\n"


def _block_as_markdown(block: Block) -> str:
    match block:
        case Paragraph(text):
            return textwrap.fill(text, _LINE, break_long_words=False, break_on_hyphens=False)
        case Listing(items):
            return "\n".join(_item(text, _LINE) for text in items)
        case Sample(text, language):
            return f"```{language}\n{_wrapped(text, _LINE) if language == 'python' else text.rstrip()}\n```"
        case Grid(header, rows):
            widths = [max(map(len, column)) for column in zip(header, *rows, strict=True)]
            ruled = [header, tuple("-" * width for width in widths), *rows]
            return "\n".join(f"| {' | '.join(map(str.ljust, row, widths))} |" for row in ruled)


_LINE: Final = 115


def _item(text: str, width: int) -> str:
    return textwrap.fill(
        text,
        width,
        initial_indent="- ",
        subsequent_indent="  ",
        break_long_words=False,
        break_on_hyphens=False,
    )


def as_text(page: Page, width: int = 100) -> str:
    """Write a page for a terminal."""
    width = max(width, 40)
    parts = [page.title]
    for heading, blocks in page.sections:
        texts = [_block_as_text(block, width) for block in blocks]
        if heading:
            texts[0] = f"{heading}\n{texts[0]}"
        parts += texts
    return "\n\n".join(parts) + "\n"


def _block_as_text(block: Block, width: int) -> str:
    match block:
        case Paragraph(text):
            return textwrap.indent(textwrap.fill(text, width - 2, break_long_words=False, break_on_hyphens=False), "  ")
        case Listing(items):
            return textwrap.indent("\n".join(_item(text, width - 2) for text in items), "  ")
        case Sample(text, language):
            shown = _wrapped(text, width - 4) if language == "python" else text.rstrip()
            return textwrap.indent(shown, "    ")
        case Grid(header, rows):
            return textwrap.indent(_columns((header, *rows)), "    ")


def _wrapped(text: str, width: int) -> str:
    """Break long conditions, one a line."""
    wrapper = textwrap.TextWrapper(width, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)
    return "\n".join(map(wrapper.fill, text.splitlines()))


def _columns(rows: Sequence[Sequence[str]]) -> str:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip() for row in rows
    )
