"""Reads paths in revisions of a git repository: ``designs#ref=main``, ``.git#ref=v1.2``."""

from __future__ import annotations

import os
import re
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import fields, is_dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final, NamedTuple

from cqos_core.files.path_loader import FileOutcome, Loaded
from cqos_core.model.dataclass import dataclass
from cqos_core.model.problems import CqosError
from cqos_core.model.spelling import nearest

_FORM: Final = re.compile(r"(?P<path>.*)#ref=(?P<ref>.*)", re.DOTALL)
_REF: Final = re.compile(r"(?!-)[^\s:?*\[\\\x00-\x1f\x7f]{1,250}")
_GIT: Final = ".git"
_SECONDS: Final = 300
# Git sets these for its hooks; they would lead away from the repository of the path, and from the index of our own.
_OF_HOOKS: Final = frozenset({"GIT_DIR", "GIT_WORK_TREE", "GIT_INDEX_FILE", "GIT_PREFIX", "GIT_OBJECT_DIRECTORY"})


@dataclass(frozen=True, slots=True)
class Revision:
    """A path in a revision of its git repository.

    Attributes:
        path: as written; ``.git`` at its end stands for the folder that has it.
        ref: a branch, a tag, a commit, or what else git takes for one commit.
    """

    path: str
    ref: str

    @property
    def whole(self) -> bool:
        """Whether the path names a repository, and nothing in it."""
        return Path(self.path).name == _GIT

    @property
    def within(self) -> str:
        """The path itself, or the folder that has the repository."""
        return os.path.dirname(self.path) or "." if self.whole else self.path  # noqa: PTH120 - any text may be given


def revision_of(text: str) -> Revision | None:
    """Return the revision that a path names; None where it is an ordinary path.

    Raises:
        CqosError: what follows ``#ref=`` is no name of a revision.
    """
    match = _FORM.fullmatch(text)
    if match is None or os.path.exists(text):  # noqa: PTH110 - Path.exists raises where a path is too long
        return None
    if not _REF.fullmatch(match["ref"]):
        raise CqosError(
            f"`{match['ref']}` is no name of a git revision", "write PATH#ref=NAME, for instance .git#ref=main"
        )
    return Revision(match["path"] or ".", match["ref"])


def at_same_paths(text: str, paths: Sequence[str]) -> list[str]:
    """Return the paths to compare with: ``.git#ref=main`` stands for ``paths`` in that revision.

    Raises:
        CqosError: what follows ``#ref=`` is no name of a revision.
    """
    revision = revision_of(text)
    return [f"{path}#ref={revision.ref}" for path in paths] if revision is not None and revision.whole else [text]


@contextmanager
def checked_out(revision: Revision) -> Iterator[Path]:
    """Check a revision out into a temporary folder, and yield the folder.

    Raises:
        CqosError: git is missing, the path is in no repository, or the repository has no such revision.
    """
    top = _top(revision)
    commit = _commit(top, revision)
    with tempfile.TemporaryDirectory(prefix="cqos-") as temporary:
        folder = Path(temporary) / "tree"
        folder.mkdir()
        # With an index of its own, the repository stays untouched, and no attribute excludes files.
        index = {"GIT_INDEX_FILE": str(Path(temporary) / "index")}
        _git(top, ["read-tree", commit], index)
        _git(top, ["checkout-index", "--all", "--quiet", f"--prefix={folder}{os.sep}"], index)
        yield folder


class NotThereError(CqosError):
    """A revision lacks a path."""


class RevisionLoader(NamedTuple):
    """Reads paths, some of them in revisions.

    Attributes:
        load: reads paths of files.
        origins: filled with the beginning of each name that stands for a revision, and the folder of the repository.
    """

    load: Callable[[Sequence[str]], Loaded]
    origins: dict[str, str]

    def __call__(self, paths: Sequence[str]) -> Loaded:
        """Return what was read; files of revisions are named as git names them: ``main:designs/a.yaml``.

        Raises:
            CqosError: a revision cannot be read.
            NotThereError: it lacks the path.
        """
        names: dict[str, str] = {}
        with ExitStack() as stack:
            real = [self._real(path, stack, names) for path in paths]
            loaded = self.load(real)
        renamed = partial(_renamed, names)
        return Loaded(
            [FileOutcome(*map(renamed, (each.file, each.system, each.problems))) for each in loaded.outcomes],
            loaded.skipped,
            renamed(loaded.not_searched),
            {renamed(part): renamed(whole) for part, whole in loaded.parts.items()},
            renamed(loaded.unsearched),
            loaded.detected.renamed(names),
            loaded.folders,
            [(renamed(file), info) for file, info in loaded.left],
        )

    def _real(self, path: str, stack: ExitStack, names: dict[str, str]) -> str:
        revision = revision_of(path)
        if revision is None:
            return path
        top = _top(revision)
        within = os.path.relpath(os.path.realpath(revision.within), os.path.realpath(top))
        folder = stack.enter_context(checked_out(revision))
        if not (folder / within).exists():
            raise NotThereError(f"there is no `{within}` in revision `{revision.ref}`")
        names[f"{folder}{os.sep}"] = label = f"{revision.ref}:"
        self.origins[f"{folder}{os.sep}"] = self.origins[label] = top
        return str(folder / within)


def _renamed(names: Mapping[str, str], value: Any) -> Any:
    """Return a value with renamed files in all its texts and places."""
    if isinstance(value, str):
        start = next((start for start in names if value.startswith(start)), None)
        return value if start is None else names[start] + value[len(start) :].removeprefix(f".{os.sep}")
    if isinstance(value, dict):
        return {_renamed(names, key): _renamed(names, each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return type(value)([_renamed(names, each) for each in value])
    if is_dataclass(value) and not isinstance(value, type):
        return replace(value, **{each.name: _renamed(names, getattr(value, each.name)) for each in fields(value)})
    return value


def _top(revision: Revision) -> str:
    folder = os.path.abspath(revision.within)  # noqa: PTH100 - `resolve` would follow links
    while not os.path.isdir(folder):  # noqa: PTH112 - the path may be in the revision only
        folder = os.path.dirname(folder)  # noqa: PTH120
    done = _run(folder, ["rev-parse", "--show-toplevel"])
    if done.returncode:
        raise CqosError(f"{revision.path} is in no git repository: {_last(done.stderr)}")
    return done.stdout.rstrip("\n")


def _commit(top: str, revision: Revision) -> str:
    name = f"{revision.ref}^{{commit}}"
    done = _run(top, ["rev-parse", "--verify", "--quiet", "--end-of-options", name])
    if done.returncode == 0:
        return done.stdout.strip()
    refs = _run(top, ["for-each-ref", "--format=%(refname:short)", "refs/heads", "refs/tags", "refs/remotes"])
    near = nearest(revision.ref, refs.stdout.split())
    shallow = "a shallow clone lacks most of them, `git fetch --unshallow` brings them"
    advice = f"did you mean `{near}`?" if near else shallow
    raise CqosError(f"the repository {top} has no revision `{revision.ref}`", advice)


def _git(folder: str, arguments: Sequence[str], environment: dict[str, str]) -> None:
    done = _run(folder, arguments, environment)
    if done.returncode:
        raise CqosError(f"git {arguments[0]} failed: {_last(done.stderr)}")


def _run(
    folder: str, arguments: Sequence[str], environment: dict[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    around = {name: value for name, value in os.environ.items() if name not in _OF_HOOKS} | {"LC_ALL": "C"}
    try:
        return subprocess.run(  # noqa: S603 - no shell, and no name that git takes for an option
            ["git", "-C", folder, *arguments],  # noqa: S607 - the git of this user
            env=around | (environment or {}),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            encoding="utf-8",
            errors="surrogateescape",
            check=False,
            timeout=_SECONDS,
        )
    except FileNotFoundError:
        raise CqosError("a revision is read with git, which is not installed", "install git") from None
    except subprocess.TimeoutExpired:
        raise CqosError(f"git {arguments[0]} took longer than {_SECONDS} s") from None


def _last(text: str) -> str:
    return (text.strip().splitlines() or ["no reason given"])[-1]
