"""Every text that a person reads is plain English: no word of the ban list, no sentence over the limit.

The ban list is the table in `docs/english.md`. Texts are collected from every committed file: prose of Markdown; docstrings,
comments, string literals and names of Python; comments, texts and names of JavaScript and TypeScript;
comments of proto, YAML, TOML, C++ and shell; titles of case files.

`allowed.yml` holds how many hits each file still has. A count may only fall. After you have improved a text, or moved a file:

    python tests/english/test_plain_english.py          lower the counts
    python tests/english/test_plain_english.py FILE...  print the hits of these files
"""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections import Counter
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import pytest
import yaml

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

ROOT = Path(__file__).resolve().parents[2]
ALLOWED = Path(__file__).with_name("allowed.yml")
LIMIT = 25
# Generated, or inputs of tests as others write them, or this test and its page.
LEFT_OUT = re.compile(
    r"proto/python/|(?:.*/)?tests/(?!cases/)(?:.*/)?(?!cases/)[^/]+/.*\.ya?ml$|docs/english\.md$|tests/english/"
)


class Text(NamedTuple):
    """One text of a file: where it begins, and whether it is prose, so that sentences have a length."""

    line: int
    text: str
    prose: bool = True


class Hit(NamedTuple):
    """A text that is not plain: `ban` for a word of the list, `long` for a sentence over the limit."""

    line: int
    kind: str
    found: str


# Texts of a file ------------------------------------------------------------------------------------------------------


def markdown(source: str) -> Iterator[Text]:
    """Yield paragraphs, list items and cells of tables; code has no sentences."""
    source = re.sub(r"^( *)(```|~~~).*?^\1\2$", _blank, source, flags=re.MULTILINE | re.DOTALL)
    source = re.sub(r"<!--.*?-->", _blank, source, flags=re.DOTALL)
    start, lines = 1, list[str]()
    for number, line in enumerate([*source.splitlines(), ""], 1):
        stripped = line.strip()
        begins = re.match(r"[-*] |\d+\. |#|\||$|\?\?\? |!!! ", stripped)
        if begins and lines:
            yield Text(start, " ".join(lines))
            lines = []
        if stripped.startswith("|"):
            yield from (Text(number, cell) for cell in re.split(r"(?<!\\)\|", stripped))
        elif stripped and not re.match(r"    [$>]? ?\S", line[:6]):
            start, lines = (start, lines) if lines else (number, lines)
            lines.append(re.sub(r"^(?:[-*] |\d+\. |#+ )", "", stripped))


def python(source: str) -> Iterator[Text]:
    """Yield docstrings, comments, string literals and names."""
    yield from comments_after("#")(re.sub(r"# (?:noqa|type:|pragma)\S*(?: \S+,?(?= - ))?(?: - )?", "# ", source))
    parts = set[int]()
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.JoinedStr(values=values):
                parts.update(map(id, values))
                yield Text(
                    node.lineno,
                    "".join(
                        str(getattr(part, "value", "{…}")) if isinstance(part, ast.Constant) else "{…}"
                        for part in values
                    ),
                )
            case ast.Constant(value=str(text)) if id(node) not in parts:
                yield Text(node.lineno, text)
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) | ast.ClassDef(name=name):
                yield Text(node.lineno, words_of(name), prose=False)
            case ast.arg(arg=name):
                yield Text(node.lineno, words_of(name), prose=False)
            case ast.Name(id=name, ctx=ast.Store()):
                yield Text(node.lineno, words_of(name), prose=False)


def comments_after(mark: str) -> Callable[[str], Iterator[Text]]:
    """Return what yields the comments of a language whose line comments begin with ``mark``."""
    pattern = re.compile(rf"(?:^|\s){mark}+ (?P<text>.*)$|^\s*\* (?P<block>.*)$")

    def found(source: str) -> Iterator[Text]:
        start, lines, last = 0, list[str](), -1
        for number, line in enumerate(source.splitlines(), 1):
            if match := pattern.search(line):
                if number != last + 1 and lines:
                    yield Text(start, " ".join(lines))
                    lines = []
                start, last = (start if lines else number), number
                lines.append(match["text"] or match["block"] or "")
        if lines:
            yield Text(start, " ".join(lines))

    return found


SCRIPT = re.compile(
    r"/\*\*? (?P<comment>.*?) \*/|\b(?:const|let|function|class|interface|type) (?P<name>\w+)"
    r"|^\s+(?P<member>\w+)\??[:(]|(?P<quote>['`])(?P<text>(?:(?!(?P=quote)).)* (?:(?!(?P=quote)).)*)(?P=quote)"
)


def script(source: str) -> Iterator[Text]:
    """Yield comments, texts of several words, and names."""
    yield from comments_after("//")(source)
    for number, line in enumerate(source.splitlines(), 1):
        for match in SCRIPT.finditer(line.partition(" // ")[0]):
            if prose := match["comment"] or match["text"]:
                yield Text(number, re.sub(r"\$\{.*?\}", "{…}", prose))
            else:
                yield Text(number, words_of(match["name"] or match["member"]), prose=False)


def yaml_texts(source: str) -> Iterator[Text]:
    """Yield comments, and values that are sentences: titles of cases, reasons, descriptions."""
    yield from comments_after("#")(source)
    for number, line in enumerate(source.splitlines(), 1):
        if match := re.match(r"[\s-]*(?:name|title|because|help|reason|summary|description): (.+)$", line):
            yield Text(number, match[1])


READERS: dict[str, Callable[[str], Iterator[Text]]] = {
    ".md": markdown,
    ".py": python,
    ".proto": comments_after("//"),
    ".cpp": comments_after("//"),
    ".js": script,
    ".mjs": script,
    ".ts": script,
    ".toml": comments_after("#"),
    ".yml": yaml_texts,
    ".yaml": yaml_texts,
    ".sh": comments_after("#"),
}


def words_of(name: str) -> str:
    """Return the words of a name in snake_case or CamelCase."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|_+", " ", name).strip()


def _blank(match: re.Match[str]) -> str:
    return "\n" * match[0].count("\n")


# What is not plain ----------------------------------------------------------------------------------------------------


@cache
def banned() -> re.Pattern[str]:
    """Return what finds the words of the table in docs/english.md."""
    page = (ROOT / "docs" / "english.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ([^|]+?) \| [^|]+ \|$", page.partition("## Words that stay out")[2], re.MULTILINE)[2:]
    words = [word for row in rows for word in row.split(", ")]
    return re.compile(rf"\b(?:{'|'.join(map(re.escape, words))})\b", re.IGNORECASE)


CODE = re.compile(r"``.+?``|`[^`]+`")
LINK = re.compile(r"\[([^\]]*)\]\([^)]*\)")
SENTENCE_END = re.compile(r"(?<=[.!?:;])[\"')*]*\s+|\n\s*\n|\n\s*[-*] |\n(?=\s*\w+: )|\s+-+ | {3,}")


def hits_in(text: Text) -> Iterator[Hit]:
    """Yield the banned words and the long sentences of a text."""
    shown = LINK.sub(r"\1", CODE.sub("`x`", text.text))
    for match in banned().finditer(re.sub(r"\s+", " ", shown)):
        yield Hit(text.line, "ban", match[0].lower())
    if not text.prose or not re.search(r"\w \w+ \w", shown):
        return
    for sentence in SENTENCE_END.split(shown):
        if (count := len(re.findall(r"[A-Za-z`{…}][^\s]*", sentence))) > LIMIT:
            yield Hit(text.line, "long", f"{count} words: {' '.join(sentence.split())[:100]}")


def files() -> Iterator[Path]:
    """Yield every committed file that people write."""
    command = ["git", "-c", "safe.directory=*", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, check=True, capture_output=True).stdout.decode()
    for name in sorted(filter(None, listed.split("\0"))):
        path = ROOT / name
        if path.suffix in READERS and path.is_file() and not LEFT_OUT.match(name):
            yield path


def hits_of(path: Path) -> list[Hit]:
    """Return all hits of a file, in the order of lines."""
    texts = READERS[path.suffix](path.read_text(encoding="utf-8", errors="replace"))
    name = Text(0, words_of(path.stem.replace("-", "_")), prose=False)
    return sorted(hit for text in (name, *texts) for hit in hits_in(text))


@cache
def counts() -> dict[str, dict[str, int]]:
    """Return how many hits of each kind every file has; files without hits are left out."""
    found = {path: Counter(hit.kind for hit in hits_of(path)) for path in files()}
    return {path.relative_to(ROOT).as_posix(): dict(sorted(kinds.items())) for path, kinds in found.items() if kinds}


# Tests ----------------------------------------------------------------------------------------------------------------


def test_every_text_is_plain_english():
    allowed = yaml.safe_load(ALLOWED.read_text(encoding="utf-8")) or {}
    worse = {
        f"{name}: {kind}: {count}, allowed {allowed.get(name, {}).get(kind, 0)}"
        for name, kinds in counts().items()
        for kind, count in kinds.items()
        if count > allowed.get(name, {}).get(kind, 0)
    }
    assert not worse, "see docs/english.md; `python tests/english/test_plain_english.py FILE` prints the places"


@pytest.mark.parametrize(
    ("suffix", "source", "expected"),
    [
        (".md", "Whoever reads this.\n", ["whoever"]),
        (".md", "```text\nwhoever\n```\n`whoever` and [whoever](x.md)\n", ["whoever"]),
        (".md", "| a | nobody |\n", ["nobody"]),
        (".md", "of\nwhich\n", ["of which"]),
        (".py", 'raise Problem(f"{name} is told")\n', ["told"]),
        (".py", "# a comment of\n# which\n", ["of which"]),
        (".py", "def tell_whoever(nobody): pass\n", ["nobody", "whoever"]),
        (".py", "class SomebodyElse: pass\n", ["somebody"]),
        (".ts", "/** The line that is told. */\n", ["told"]),
        (".ts", "let told = 1;\n  tellNobody(): void;\n", ["nobody", "told"]),
        (".ts", "notice('Nobody listens', `${whoever}, somebody`);\n", ["nobody", "somebody"]),
        (".proto", "// Told to callers.\n", ["told"]),
        (".yml", "- name: nobody listens\n", ["nobody"]),
    ],
)
def test_banned_words_are_found(suffix, source, expected):
    hits = sorted(hit.found for text in READERS[suffix](source) for hit in hits_in(text))
    assert hits == expected


@pytest.mark.parametrize(("words", "expected"), [(25, []), (26, ["long"])])
def test_long_sentences_are_found(words, expected):
    text = " ".join(["word"] * words) + ". A short one."
    assert [hit.kind for found in markdown(text) for hit in hits_in(found)] == expected
    assert [hit.kind for found in python(f'"""{text}"""') for hit in hits_in(found)] == expected


def main(arguments: list[str]) -> None:
    """Lower the counts, or print the hits of files."""
    for name in arguments:
        for hit in hits_of(Path(name).resolve()):
            print(f"{name}:{hit.line}: {hit.kind}: {hit.found}")  # noqa: T201
    if not arguments:
        text = yaml.safe_dump(counts(), default_flow_style=None, sort_keys=True, width=160)
        ALLOWED.write_text(text if counts() else "{}\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
