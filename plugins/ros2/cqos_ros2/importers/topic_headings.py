"""Which topic a line between snapshots names: a heading, a name that a loop echoes, or the command that was typed."""

from __future__ import annotations

from pathlib import PurePath
from typing import Final, NamedTuple

from cqos_core.model.regular_expressions import re

_PART: Final = r"[A-Za-z_][A-Za-z0-9_]*"
NAME: Final = rf"(?:/{_PART})++"
_FULL: Final = re.compile(NAME)
_COMMAND: Final = re.compile(r"\bros2\s+topic\s+info\s+([^|<>;&]*)")
_PROMPT: Final = re.compile(r"(?:^|[^\s])[$%]\s+\w")
_ABSENT: Final = re.compile(r"\s*Unknown topic\b")
# `### /scan`, `=== /scan ===`, `Topic: /scan`, `**/scan**`, `/scan [sensor_msgs/msg/LaserScan]`
_HEADING: Final = re.compile(
    r"""[\s\#=*>"'`\[(-]*+ (?:topic(?:\ name)?\b[\s:=]*+)?+ ["'`]?+ """
    rf"(?P<name>{NAME})"
    r"""[\s\#=*"'`\]):-]*+ (?:\[[\w/,\ ]*\][\s:]*+)?+""",
    re.IGNORECASE | re.VERBOSE,
)
_LONGEST: Final = 300
_VALUED_OPTIONS: Final = frozenset({"--spin-time"})
_FILE_PREFIX: Final = re.compile(r"(?:ros2[_-]*)?(?:topic[_-]*)?info[_-]+|(?:ros2[_-]*)?topic[_-]+", re.IGNORECASE)
_FILE_SUFFIX: Final = re.compile(r".*[_-](?:dump|info|log|out|output|qos|snapshot|verbose)", re.IGNORECASE)
_SAYS_NOTHING: Final = frozenset(
    (
        *("", "dump", "graph", "info", "log", "out", "output", "qos", "ros2", "snapshot"),
        *("stdin", "bytes", "topic", "topics", "topic_info", "ros2_topic_info"),
    )
)


class Heading(NamedTuple):
    """A line that says what comes next.

    Attributes:
        name: of the topic; None where something else than a topic with a name comes next.
        column: one-based, of the name.
        bare: nothing else stands on the line, as in a list of topics.
    """

    name: str | None
    column: int = 1
    bare: bool = False


def heading(line: str) -> Heading | None:
    """Return what ``line`` says of the lines below it, or None for a line that says nothing."""
    if len(line) > _LONGEST:
        return None
    command = _COMMAND.search(line)
    if command is not None:
        return _of_command(command[1], command.start(1))
    found = _HEADING.fullmatch(line)
    if found is not None:
        return Heading(found["name"], found.start("name") + 1, bare=line.strip().startswith("/"))
    return Heading(None) if _PROMPT.search(line) or _ABSENT.match(line) else None


def _of_command(arguments: str, start: int) -> Heading:
    """Find the topic among the arguments of ``ros2 topic info``."""
    skip = False
    for word in re.finditer(r"\S+", arguments):
        text = word[0].strip("\"'`:,.")
        if not skip and not text.startswith("-"):
            return Heading(full_name(text), start + word.start() + 1 + word[0].find(text))
        skip = text in _VALUED_OPTIONS
    return Heading(None)


def full_name(text: str) -> str | None:
    """Return the topic that ``text`` names, with its leading slash; None where it names none."""
    name = text if text.startswith("/") else f"/{text}"
    return name if _FULL.fullmatch(name) else None


def named_by_file(source: str) -> str | None:
    """Guess the topic from the name of a file: ``scan.txt``, ``ros2_topic_info__robot__scan.txt``.

    ``map_info.txt`` tells no topic: it may be information on ``/map``, or a snapshot of ``/map_info``.
    """
    stem = PurePath(source).name.strip("<>").split(".")[0]
    if stem.lower() in _SAYS_NOTHING:
        return None
    rest = _FILE_PREFIX.sub("", stem, count=1) if _FILE_PREFIX.match(stem) else stem
    return (
        None
        if rest.lower() in _SAYS_NOTHING or _FILE_SUFFIX.fullmatch(rest)
        else full_name(rest.strip("_").replace("__", "/"))
    )


def unnamed(source: str, line: int) -> str:
    """Return a name for a topic whose name is not known, which no other topic has."""
    stem = re.sub(r"[^A-Za-z0-9]+", "_", source).strip("_")
    return f"/unnamed/in_{stem}/line_{line}" if stem else f"/unnamed/line_{line}"
