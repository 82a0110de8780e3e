"""Writes what in these docs is derived: pages of rules and codes under rules/ (not in git), help texts and the table of options in command.md, figures in img/.

python docs/generate.py            write
python docs/generate.py --rules    write pages of rules and codes only, which leaves files in git as they are
python docs/generate.py --kept     write files in git only
python docs/generate.py --check    fail if a help text in command.md or a figure differs, or a page cannot be made
"""  # noqa: INP001 - a script

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import yaml
from figures import figures
from incidents import incidents, incidents_page
from known_nodes import known_nodes_page

from cqos_core.api import check
from cqos_core.cli.app import cli
from cqos_core.cli.help import short_help
from cqos_core.cli.parameters import READS_SYSTEMS
from cqos_core.model.codes import CODES
from cqos_core.packs.rule_docs import Example, as_markdown, code_page, rule_page
from cqos_core.plugins import load_plugins
from cqos_core.testing import Case, load_cases

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cqos_core.model.code_info import CodeInfo
    from cqos_core.packs.bound_rule import BoundRule
    from cqos_core.packs.pack import RulePack

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
RULES = DOCS / "rules"
COMMAND = DOCS / "command.md"
OPTIONS = re.compile(r"(?P<before><!-- options -->\n\n).*?\n(?=\n## )", re.DOTALL)
HELP = re.compile(r"(?P<before><!-- help: cqos(?P<path>[ \w-]*) -->\n\n```text\n).*?(?P<after>```\n)", re.DOTALL)


def main(arguments: list[str]) -> int:
    """Write or compare every derived file."""
    rules = {} if "--kept" in arguments else dict(rule_pages())
    kept = {} if "--rules" in arguments else dict(kept_pages())
    wanted = kept if "--check" in arguments else {**rules, **kept}
    looked = {*wanted, *(RULES.glob("*.md") if rules and "--check" not in arguments else ())}
    present = {path: path.read_text(encoding="utf-8") for path in looked if path.is_file()}
    stale = sorted(path for path in {*wanted, *present} if wanted.get(path) != present.get(path))
    for path in stale:
        print(f"{'differs' if '--check' in arguments else 'written'}: {path.relative_to(ROOT)}")  # noqa: T201
    if "--check" in arguments:
        if stale:
            print("run: python docs/generate.py")  # noqa: T201
        return 1 if stale else 0
    for path in stale:
        path.parent.mkdir(exist_ok=True)
        if path in wanted:
            path.write_text(wanted[path], encoding="utf-8")
        else:
            path.unlink()
    return 0


def rule_pages() -> Iterator[tuple[Path, str]]:
    """Every page of a rule or a code with its text; they are not in git."""
    packs = list(our_packs())
    for pack in packs:
        for bound in pack.bound_rules:
            yield RULES / f"{bound.rule.code}.md", as_markdown(rule_page(bound, pack, examples(bound, pack)))
        for info in pack.codes:
            yield RULES / f"{info.code}.md", as_markdown(code_page(info, pack))
    for code, info in CODES.items():
        yield RULES / f"{code}.md", as_markdown(code_page(info))
    yield RULES / "README.md", index(packs)


def kept_pages() -> Iterator[tuple[Path, str]]:
    """Every derived file in git with its text."""
    for name, drawn in figures(next(pack for pack in our_packs() if pack.id == "ros2")):
        yield DOCS / "img" / name, drawn
    yield DOCS / "incidents.md", incidents_page(incidents(ROOT / "examples" / "incidents" / "incidents.yaml"))
    yield DOCS / "known-nodes.md", known_nodes_page()
    yield COMMAND, with_help(COMMAND.read_text(encoding="utf-8"))


def our_packs() -> Iterator[RulePack]:
    """The packs of the plugins in this repository, not what else may be installed."""
    plugins = load_plugins()
    projects = ROOT.glob("plugins/*/pyproject.toml")
    ours = {tomllib.loads(project.read_text(encoding="utf-8"))["project"]["name"] for project in projects}
    for pack_id in sorted(plugins.packs):
        pack = plugins.pack(pack_id) if plugins.owner("packs", pack_id).split()[0] in ours else None
        if pack is not None:
            yield pack


def index(packs: Iterable[RulePack]) -> str:
    """The table of all rules and codes."""
    parts = [
        "# Rules and codes",
        "Written by `python docs/generate.py` from the rules themselves; `cqos rule CODE` says the same in a terminal.",
    ]
    for pack in packs:
        rows = [(b.rule.code, b.rule.name, b.severity, b.rule.because) for b in pack.bound_rules]
        parts += [f"## {pack.title}", listing([*rows, *map(row, pack.codes)])]
    parts += ["## C-QoS itself", listing(row(info) for _, info in sorted(CODES.items()))]
    return "\n\n".join(parts) + "\n"


def row(info: CodeInfo) -> tuple[str, str, str, str]:
    """The row of a code in that table."""
    return info.code, info.name, info.severity, info.summary.rstrip(".")


def listing(rows: Iterable[tuple[str, str, str, str]]) -> str:
    """A table with a link in each row."""
    lines = ["| code | name | severity | |", "| ---- | ---- | -------- | --- |"]
    lines += [f"| [{code}]({code}.md) | {name} | {severity} | {why} |" for code, name, severity, why in rows]
    return "\n".join(lines)


def examples(bound: BoundRule, pack: RulePack) -> Iterator[Example]:
    """Return the first case that makes a rule report, and the first that does not, as systems that reproduce it."""
    code = bound.rule.code
    cases = [case for file in ROOT.glob(f"plugins/*/tests/cases/{code}.yml") for case in load_cases(file, pack.id)]
    for fires in (True, False):
        chosen = (case for case in cases if (case.content["expect"] != "ok") is fires)
        texts = ((case, as_system(case)) for case in chosen)
        found = next(((case, text) for case, text in texts if reports(code, text, pack) is fires), None)
        if found is not None:
            yield Example(found[0].name, found[1], fires=fires)
        elif fires and cases:
            raise SystemExit(f"no case of {code} makes a system that reports it")


def reports(code: str, text: str, pack: RulePack) -> bool:
    """Whether a check of a system in YAML reports a code."""
    return any(finding.code == code for finding in check(text.encode(), importer="yaml", packs=[pack]).findings)


def as_system(case: Case) -> str:
    """Return what a case states as a system file."""
    content = case.content
    system: dict[str, Any] = {"cqos": 1, "protocol": case.pack}
    if "options" in content:
        system["options"] = {case.pack: content["options"]}
    if "system" in content:
        system |= content["system"]
    else:
        facts = dict(content.get("topic", {}))
        topic = str(facts.pop("name", "chatter"))
        if facts:
            system["topics"] = {topic: facts}
        pair = not content.keys().isdisjoint(("offered", "requested", "needs"))
        ends = (("talker", "publishes", "publisher", "offered"), ("listener", "subscribes", "subscriber", "requested"))
        needs = {"needs": content["needs"]} if "needs" in content else {}
        system["participants"] = {
            name: {verb: {topic: content.get(stated if pair else role, {}) | (needs if role == "subscriber" else {})}}
            for name, verb, role, stated in ends
            if pair or role in content
        }
    dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)  # many times as fast, where it was built
    text: str = yaml.dump(system, None, dumper, sort_keys=False, default_flow_style=None, width=100, allow_unicode=True)
    return text


def with_help(text: str) -> str:
    """Put the help of each command between the marks for it."""

    def filled(match: re.Match[str]) -> str:
        return f"{match['before']}{help_of(match['path'].split())}\n{match['after']}"

    return OPTIONS.sub(lambda match: f"{match['before']}{options_table()}\n", HELP.sub(filled, text))


def options_table() -> str:
    """The tables of all options and of exit codes: what each means, and which commands have it."""
    of_options: dict[str, tuple[str, str, list[str]]] = {}
    reading = []
    for name in load_plugins().commands:
        command, context = found(name.split())
        if getattr(command.callback, READS_SYSTEMS, False):
            reading.append(name)
        for param in command.params:
            if isinstance(param, click.Option):
                usage, _ = param.get_help_record(context) or ("", "")
                form = re.sub(r" \[.*\]$", "", usage).replace("|", "\\|")
                row = of_options.setdefault(max(param.opts, key=len), (form, param.help or "", []))
                row[2].append(name)
    everywhere = len(load_plugins().commands)
    lines = ["| option | meaning | commands |", "| ------ | ------- | -------- |"]
    for _, (form, text, names) in sorted(of_options.items()):
        left = [name for name in names if name not in reading] if {*reading} <= {*names} else names
        of = ["all that read systems"] * (left is not names) + [f"`{name}`" for name in left]
        shown = "all" if len(names) == everywhere else ", ".join(of)
        lines.append(f"| `{form}` | {text.replace('|', chr(92) + '|')} | {shown} |")
    systems = ", ".join(f"`{name}`" for name in reading)
    codes = ["| command | exit codes |", "| ------- | ---------- |"]
    for name in load_plugins().commands:
        epilog = found(name.split())[0].epilog or ""
        codes.append(f"| `{name}` | {epilog[epilog.index('Exit codes') :].removeprefix('Exit codes: ')} |")
    return "\n".join([*lines, "", f"Commands that read systems: {systems}.", "", *codes])


def help_of(path: list[str]) -> str:
    """The help text of ``cqos`` or one of its commands, as a terminal of 100 columns shows it."""
    return short_help(found(path)[1])


def found(path: list[str]) -> tuple[click.Command, click.Context]:
    """Return a command, and the context in which its help is written."""
    settings = {"terminal_width": 100}
    context = click.Context(cli, info_name="cqos", **settings)  # type: ignore[arg-type]
    command: click.Command = cli
    for name in path:
        inner = command.get_command(context, name) if isinstance(command, click.Group) else None
        if inner is None:
            raise SystemExit(f"docs/command.md shows the help of `cqos {name}`, which there is not")
        command, context = inner, click.Context(inner, info_name=name, parent=context, **settings)  # type: ignore[arg-type]
    return command, context


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
