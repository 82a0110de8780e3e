"""Effects of importing a Python file on qualities of service: its top-level statements, in the order of imports."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cqos_ros2_sources.programs.names import last_part
from cqos_ros2_sources.programs.program import Assign, Attribute, Call, Do, If, Name, call_name
from cqos_ros2_sources.programs.statement_search import calls_in, inside, mentions
from cqos_ros2_sources.walk.frames import Frame
from cqos_ros2_sources.walk.qualities import FIELDS
from cqos_ros2_sources.walk.statements import run

if TYPE_CHECKING:
    from cqos_ros2_sources.programs.program import Expression, Function, Program, Statement
    from cqos_ros2_sources.walk.frames import Walk


def run_imports(path: str, walk: Walk, *, itself: bool) -> None:
    """Walk what the files that a file imports change then; and what it changes itself, where it is imported, too."""
    for script in _imported(path, walk.program):
        if script.place.source == path and not itself:
            continue
        found = [each for each in script.body if _changes(each, script, walk)]
        if found:
            walk.frames.append(Frame(script, None, names={"__name__": _module(script)}))
            run(found, walk)
            walk.frames.pop()


def _module(script: Function) -> str:
    return script.name.removesuffix(".__main__")


def _imported(path: str, program: Program) -> list[Function]:
    """Return the files that a file imports, each behind those that it imports itself, and the file."""
    modules = {_module(script): source for source, script in program.tops.items()}
    seen: set[str] = set()
    found: list[Function] = []

    def visit(source: str) -> None:
        if source in seen or source not in program.tops:
            return
        seen.add(source)
        for name in program.imports.get(source, ()):
            parts = name.split(".")
            for length in range(1, len(parts) + 1):
                visit(modules.get(".".join(parts[:length]), ""))
        found.append(program.tops[source])

    visit(path)
    return found


def _changes(statement: Statement, script: Function, walk: Walk) -> bool:
    """Whether a statement may change a quality of service; what only a program does that is run by its name changes nothing."""
    if isinstance(statement, If) and mentions(statement.condition, "__name__"):
        return False
    return any(
        (isinstance(each, Assign) and isinstance(each.target, Attribute) and each.target.name in FIELDS)
        or (isinstance(each, Do) and any(_hands_on(call, script, walk) for call in calls_in((each,))))
        for each in inside((statement,))
    )


def _hands_on(call: Call, script: Function, walk: Walk) -> bool:
    given = (*call.arguments, *(value for _, value in call.keywords))
    return call_name(call) == "setattr" or any(_is_quality(each, script, walk) for each in given)


def _is_quality(written: Expression, script: Function, walk: Walk) -> bool:
    """Whether a name at the top of a file is one of a quality of service."""
    if not isinstance(written, Name):
        return False
    table, full = walk.table, f"{_module(script)}.{written.text}"
    values: list[Any] = [
        value
        for name, value, _ in walk.program.constants.get(last_part(written.text), ())
        if name in {full, written.text}
    ]
    names = [written.text, *(each.text for each in values if isinstance(each, Name))]
    made = any(isinstance(each, Call) and table.lookup(table.makers, call_name(each)) is not None for each in values)
    return made or any(table.lookup(table.presets, each) is not None for each in names)
