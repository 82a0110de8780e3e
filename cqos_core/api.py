"""The library: `check`, `explain`, `read`, `diff`, `apply`, plans. `cqos_core` re-exports it, with `check_pair` and `Session`."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING

from cqos_core.analysis.explanation import explain_pair
from cqos_core.analysis.pair_judge import check_pair, pack_is_there
from cqos_core.checking.checker import check_system
from cqos_core.checking.hypothetical_pairs import with_profiles_tried
from cqos_core.files.inputs import Input, read, source_of
from cqos_core.files.path_loader import load_paths
from cqos_core.files.system_faults import faults, faults_of
from cqos_core.files.system_merge import merge
from cqos_core.language.domains import SettingValue, as_text
from cqos_core.language.values import INFINITE
from cqos_core.matching.pipeline import CheckContext, context, with_options
from cqos_core.model.exact_columns import with_exact_columns
from cqos_core.model.finding import Edit
from cqos_core.model.system import System
from cqos_core.plugins import Plugins, function

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from cqos_core.analysis.plan import RepairPlan
    from cqos_core.files.edited_files import Edited
    from cqos_core.model.finding import Remedy
    from cqos_core.model.report import PairReport, Report
    from cqos_core.model.system_diff import Diff
    from cqos_core.packs.pack import RulePack


def check(
    *inputs: Input,
    importer: str | None = None,
    protocol: str | None = None,
    options: Mapping[str, Mapping[str, SettingValue]] | None = None,
    packs: Iterable[RulePack] = (),
) -> Report:
    """Check a system, given as paths, bytes, or `System` values that are taken together.

    Args:
        inputs: what to read; the format of each is detected.
        importer: read all of them with this importer.
        protocol: pack id for participants that state none.
        options: by pack id, laid over those of the input: ``{"ros2": {"rmw": "cyclonedds"}}``.
        packs: further rule packs beside the installed ones.

    Raises:
        InputError: an input cannot be read; every problem is listed.
        CqosError: an option is of a rule pack that there is not.
    """
    packs = list(packs)
    where = context(packs, protocol)
    assumed = _by_pack(options or {}, where, packs)
    system = with_profiles_tried(read(*inputs, importer=importer, protocol=protocol), protocol)
    system = with_options(system, assumed, where)
    return with_exact_columns(check_system(system, where), system.sources)


def apply(inputs: Input | Sequence[Input], fixes: Iterable[Remedy | Edit], *, importer: str | None = None) -> Edited:
    """Apply fixes of a report to the texts that it was made of; layout and comments stay.

    >>> report = check("system.yaml")
    >>> edited = apply("system.yaml", [report.findings[0].remedies[0]])
    >>> print(edited.diff())
    >>> edited.write()

    Args:
        inputs: what was checked: one input or several.
        fixes: remedies of the report, or single edits of them.
        importer: read all inputs with this importer.

    Returns:
        The new texts by name of their source, and edits that could not be applied, each with the reason. Nothing is
        written until `Edited.write` is called, and nothing is checked again.

    Raises:
        InputError: an input cannot be read.
    """
    from cqos_core.files.edited_files import apply_edits, opened_sources

    each = [inputs] if isinstance(inputs, (str, bytes, PathLike, System)) else list(inputs)
    edits = [edit for fix in fixes for edit in ((fix,) if isinstance(fix, Edit) else fix.edits)]
    sources = opened_sources([read(*each, importer=importer)], edits)
    for position, one in enumerate(each):
        if isinstance(one, bytes):
            source = source_of(each, position)
            sources[source.name] = source.data
    return apply_edits(sources, edits, importer)


def repair(
    inputs: Input | Sequence[Input],
    *,
    keep: Sequence[str] = (),
    decide: bool = False,
    importer: str | None = None,
    protocol: str | None = None,
    options: Mapping[str, Mapping[str, SettingValue]] | None = None,
    packs: Iterable[RulePack] = (),
) -> RepairPlan:
    """Find the changes of least weight after which no pair is incompatible and all requirements hold.

    >>> plan = repair("system.yaml", keep=["lidar/*"])
    >>> [change.text for change in plan.changes]
    >>> plan.edited.write()

    Args:
        inputs: paths or bytes, one or several; together they are one system.
        keep: shell patterns of endpoints, participants and files that stay as they are.
        decide: unknown pairs have to become compatible, too.
        importer: read all inputs with this importer.
        protocol: pack id for participants that state none.
        options: by pack id, laid over those of the inputs.
        packs: further rule packs beside the installed ones.

    Returns:
        The plan with its new texts, checked again; or a conflicting set. Nothing is written until `Edited.write` is called.

    Raises:
        InputError: an input cannot be read.
        CqosError: the distribution ``cqos-planning`` is not installed, or its solver found no answer in time.
    """
    find_repair: Callable[..., RepairPlan] = function("repair")
    sources, again, where = _texts_of(inputs, importer, protocol, options or {}, list(packs))
    return find_repair(sources, again, where, keep=keep, decide=decide, importer=importer)


def suggest(
    inputs: Input | Sequence[Input],
    *,
    importer: str | None = None,
    protocol: str | None = None,
    options: Mapping[str, Mapping[str, SettingValue]] | None = None,
    packs: Iterable[RulePack] = (),
) -> RepairPlan:
    """Find the weakest settings that meet all requirements, for endpoints that state no settings; see `repair`.

    Raises:
        InputError: an input cannot be read.
        CqosError: the distribution ``cqos-planning`` is not installed, or its solver found no answer in time.
    """
    find_suggestion: Callable[..., RepairPlan] = function("suggest")
    sources, again, where = _texts_of(inputs, importer, protocol, options or {}, list(packs))
    return find_suggestion(sources, again, where, importer=importer)


def _texts_of(
    inputs: Input | Sequence[Input],
    importer: str | None,
    protocol: str | None,
    options: Mapping[str, Mapping[str, SettingValue]],
    packs: Sequence[RulePack],
) -> tuple[Mapping[str, bytes], Callable[[Mapping[str, bytes]], System], CheckContext]:
    """Return the texts of inputs by name, a function that reads them again with other texts, and the context of a check."""
    from cqos_core.files.source_reader import read_texts

    where = context(packs, protocol)
    given = _by_pack(options, where, packs)
    each = [inputs] if isinstance(inputs, (str, bytes, PathLike, System)) else list(inputs)
    if any(isinstance(one, System) for one in each):
        raise TypeError("a plan changes texts: give paths or bytes, no System")
    sources = dict(read(*each, importer=importer, protocol=protocol).sources)
    names: list[str] = []
    for position, one in enumerate(each):
        if isinstance(one, (str, PathLike)) and Path(one).is_dir():
            names += [path for path, _ in load_paths([fspath(one)], importer, protocol=protocol).systems]
        else:
            names.append(source_of(each, position).name)
            sources.setdefault(names[-1], source_of(each, position).data)

    def again(texts: Mapping[str, bytes]) -> System:
        systems = read_texts(names, {**sources, **texts}, importer, protocol=protocol)
        return with_options(with_profiles_tried(merge(systems), protocol), given, where)

    return sources, again, where


def diff(
    a: Input,
    b: Input,
    *,
    protocol: str | None = None,
    options: Mapping[str, Mapping[str, SettingValue]] | None = None,
    packs: Iterable[RulePack] = (),
    topics: Sequence[str] = (),
    ignored: Sequence[str] = (),
) -> Diff:
    """Compare two systems: return the different values of the same topics and endpoints, as far as both are known.

    Args:
        a: a path, bytes or a `System`.
        b: what to compare it with.
        protocol: pack id for participants that state none.
        options: by pack id, laid over those of both.
        packs: further rule packs beside the installed ones.
        topics: shell patterns of the topics to compare; all if empty.
        ignored: shell patterns of the topics not to compare.

    Raises:
        InputError: an input cannot be read.
    """
    from cqos_core.analysis.differences import compare

    packs = list(packs)
    where = context(packs, protocol)
    assumed = _by_pack(options or {}, where, packs)
    one, other = (with_options(read(each, protocol=protocol), assumed, where) for each in (a, b))
    return compare(one, other, where, topics, ignored)


def _nested(name: str, value: object) -> dict[str, dict[str, object]]:
    """``ros2.rmw`` of the command line as the library takes it."""
    pack, _, option = name.rpartition(".")
    return {pack or "PACK": {option: value}}


def _by_pack(
    options: Mapping[str, Mapping[str, SettingValue]], where: CheckContext, packs: Sequence[RulePack]
) -> Mapping[str, Mapping[str, SettingValue]]:
    """Return options unchanged; refuse options that are not given by pack, or of a missing pack."""
    for pack_id, settings in options.items():
        if not isinstance(settings, Mapping):
            raise TypeError(f"options are by rule pack, as in {_nested(pack_id, settings)}")
        pack_is_there(pack_id, where, packs)
    return options


def explain(
    *inputs: Input,
    publisher: str,
    subscriber: str,
    options: Mapping[str, Mapping[str, SettingValue]] | None = None,
    packs: Iterable[RulePack] = (),
    protocol: str | None = None,
) -> PairReport:
    """Explain one pair of a system: every policy, both values with origin and place, and the rules over it.

    Raises:
        InputError: an input cannot be read.
        CqosError: there is no such endpoint, or the two are on different topics.
    """
    packs = list(packs)
    where = context(packs, protocol)
    assumed = _by_pack(options or {}, where, packs)
    system = with_options(with_profiles_tried(read(*inputs, protocol=protocol), protocol), assumed, where)
    return explain_pair(system, publisher, subscriber, where)


__all__ = [
    "INFINITE",
    "CheckContext",
    "Plugins",
    "apply",
    "as_text",
    "check",
    "check_pair",
    "context",
    "diff",
    "explain",
    "explain_pair",
    "faults",
    "faults_of",
    "read",
    "repair",
    "suggest",
    "with_exact_columns",
    "with_options",
]
