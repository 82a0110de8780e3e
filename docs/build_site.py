"""Builds the documentation as a site into build/docs/site, and checks every link in it.

The pages are those of the repository, the pages of all rules, and a reference of the library from its docstrings. What docs/site.toml
says holds. A broken link or anchor ends the build with 1. Nothing is loaded from elsewhere, so the site works offline.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote, urlsplit

from lxml import html

import cqos_core
from cqos_core import packs

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "build" / "docs"
SOURCE = BUILD / "source"
SITE = BUILD / "site"
COPIED = (
    "*.md",
    "LICENSE",
    "CITATION.cff",
    "dev.py",
    "docs/**/*",
    "examples/**/*",
    "deploy/**/*",
    "proto/cqos/**/*",
    "cqos_core/**/*.py",
    "plugins/*/cqos_*/**/*.py",
    "plugins/*/tests/cases/*.yml",
)


def main() -> int:
    """Build the site; return 1 if anything in it is broken."""
    if sys.version_info < (3, 11, 5):
        print("the site is not built, its generator needs Python 3.11.5 or newer", file=sys.stderr)
        return 0
    # Tests run beside this, and one of them compares the derived files that are in git.
    subprocess.run([sys.executable, str(ROOT / "docs" / "generate.py"), "--rules"], check=True)
    stage()
    command = [sys.executable, "-m", "zensical", "build", "--strict", "--config-file", str(BUILD / "zensical.toml")]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    broken = [] if done.returncode else sorted(set(broken_links()))
    if done.returncode or broken:
        print(done.stdout, done.stderr, *broken, sep="\n")
        return 1
    print(
        f"built {SITE.relative_to(ROOT)}/index.html, {len(list(SITE.rglob('*.html')))} pages, all links lead somewhere"
    )
    return 0


def stage() -> None:
    """Copy what the site is made of, and write the page of the library."""
    shutil.rmtree(BUILD, ignore_errors=True)
    for pattern in COPIED:
        for path in ROOT.glob(pattern):
            if path.is_file() and "node_modules" not in path.parts and "__pycache__" not in path.parts:
                target = SOURCE / path.relative_to(ROOT)
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(path, target)
    shutil.copyfile(ROOT / "docs" / "site.toml", BUILD / "zensical.toml")
    with (BUILD / "zensical.toml").open("a", encoding="utf-8") as settings:
        settings.write(f"\n[project.plugins.mkdocstrings.handlers.python]\npaths = [{str(ROOT)!r}]\n")
    (SOURCE / "docs" / "api.md").write_text(reference(), encoding="utf-8")


def reference() -> str:
    """Return the page of the library: every public name, from its docstring."""
    parts = ["# API reference", "Every public name of the library. [The library](library.md) shows them at work."]
    parts += ["## For programs", *described("cqos_core", dir(cqos_core))]
    parts += ["## For authors of packs", *described("cqos_core.packs", packs.__all__)]
    return "\n\n".join(parts) + "\n"


def described(module: str, names: Iterable[str]) -> Iterator[str]:
    """Yield what mkdocstrings replaces by the docstrings of ``names``."""
    return (f"::: {module}.{name}" for name in sorted(names) if not name.startswith("_"))


# Links --------------------------------------------------------------------------------------------------------------


def broken_links() -> Iterator[str]:
    """Yield every link of the site that leads nowhere, or to another host than that of the reader's choice."""
    files = {str(path): path for path in SITE.rglob("*") if path.is_file()}
    shown = (name for name, path in files.items() if path.suffix == ".html" and path.name != "404.html")
    pages = {name: html.parse(name).getroot() for name in shown}
    anchors = {name: {*page.xpath("//@id"), *page.xpath("//a/@name")} for name, page in pages.items()}
    for name, page in pages.items():
        place, folder = files[name].relative_to(SITE), os.path.dirname(name)  # noqa: PTH120 - of many links, as text
        for loaded in page.xpath("//link[@rel='stylesheet']/@href | //script/@src | //img/@src"):
            if urlsplit(loaded).netloc:
                yield f"{place}: loads {loaded}"
        for link in page.xpath("//a/@href | //img/@src"):
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = os.path.normpath(os.path.join(folder, unquote(parts.path))) if parts.path else name  # noqa: PTH118
            target = target if target in files else os.path.join(target, "index.html")  # noqa: PTH118
            if target not in files or (
                parts.fragment and target in anchors and unquote(parts.fragment) not in anchors[target]
            ):
                yield f"{place}: {link} leads nowhere"


if __name__ == "__main__":
    sys.exit(main())
