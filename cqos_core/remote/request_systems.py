"""The systems that requests bring: as data, or as documents to read."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.files.source_files import SentFiles
from cqos_core.files.source_reader import GivenSource, read_together
from cqos_core.files.system_merge import merge
from cqos_core.matching.pipeline import context, with_options
from cqos_core.model.problems import InputError
from cqos_core.model.source import Source
from cqos_core.model.system import System
from cqos_core.plugins import load_plugins
from cqos_core.remote.messages import system_value
from cqos_core.remote.refusal import Refused, too_much, unfit
from cqos_core.remote.request_problems import FieldProblem, system_problems

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos.v1 import check_pb2, system_pb2
    from cqos_core.matching.pipeline import CheckContext


def read_input(
    request: check_pb2.DescribeRequest | check_pb2.ExplainRequest | check_pb2.ConvertRequest | check_pb2.DiffInput,
    most: int,
    path: str = "",
) -> tuple[CheckContext, System]:
    """Return the system of a message, at ``path`` of the request, that brings it in either form."""
    if request.WhichOneof("input") == "documents":
        return read_documents(request.documents, most, f"{path}documents.")
    if request.WhichOneof("input") == "system":
        return context(), read_system(request.system, most, f"{path}system")
    raise unfit([FieldProblem(f"{path}input", "`system` or `documents` is needed")])


def read_system(message: system_pb2.System, most: int, path: str = "system") -> System:
    """Return the system of a message.

    Raises:
        Refused: something is wrong with it, or it has too many endpoints.
    """
    # A route of a bridge is one endpoint on either side.
    bounded(len(message.endpoints) + 2 * sum(len(each.routes) for each in message.bridges), most, f"{path}.endpoints")
    wrong = list(system_problems(message, path))
    if wrong:
        raise unfit(wrong)
    return system_value(message)


def bounded(found: int, most: int, field: str) -> None:
    """Refuse more endpoints than are allowed."""
    if found > most:
        raise too_much(field, f"there are {found} endpoints, this service takes {most}")


def read_documents(
    request: check_pb2.CheckDocumentRequest | check_pb2.Documents, most: int, path: str = ""
) -> tuple[CheckContext, System]:
    """Read files as one system.

    Raises:
        Refused: they cannot be read, or hold too many endpoints.
    """
    reading = request.reading
    _refuse_unknown(request, path)
    protocol, importer = (
        getattr(reading, name) if reading.HasField(name) else None for name in ("protocol", "importer")
    )
    where = context((), protocol)
    switches = {name: dict(options.settings) for name, options in reading.switches.items()}
    sources = [Source(document.name or "<bytes>", document.content) for document in request.documents]
    opener = SentFiles([*sources, *(Source(each.name, each.content) for each in request.included)])
    results = read_together([GivenSource(each, opener) for each in sources], importer, switches, protocol=protocol)
    systems = [each for each in results if isinstance(each, System)]
    wrong = [(index, each) for index, each in enumerate(results) if isinstance(each, InputError)]
    if wrong:
        problems = [problem for _, error in wrong for problem in error.problems]
        fields = [
            FieldProblem(f"{path}documents[{index}].content", str(each))
            for index, error in wrong
            for each in error.problems
        ]
        text = f"{problems[0]}" + (f" (and {len(problems) - 1} more)" if len(problems) > 1 else "")
        raise Refused("INVALID_ARGUMENT", text, fields, problems)
    routes = sum(len(bridge.routes) for system in systems for bridge in system.bridges.values())
    bounded(sum(len(system.endpoints) for system in systems) + 2 * routes, most, f"{path}documents")
    options: Mapping[str, Mapping[str, str]] = {
        pack: {name: options.settings[name] for name in sorted(options.settings)}
        for pack, options in sorted(reading.options.items())
    }
    return where, with_options(merge(systems), options, where)


def _refuse_unknown(request: check_pb2.CheckDocumentRequest | check_pb2.Documents, path: str) -> None:
    plugins = load_plugins()
    reading = request.reading
    wrong = [] if request.documents else [FieldProblem(f"{path}documents", "at least one is needed")]
    wrong += [
        FieldProblem(f"{path}included[{index}].name", "a name is needed, by which it is included")
        for index, each in enumerate(request.included)
        if not each.name
    ]
    if reading.HasField("protocol") and plugins.pack(reading.protocol) is None:
        wrong.append(no_pack(f"{path}reading.protocol", reading.protocol))
    if reading.HasField("importer") and reading.importer not in plugins.importers:
        known = ", ".join(sorted(plugins.importers))
        said = f"there is no importer `{reading.importer[:60]}`; installed: {known}"
        wrong.append(FieldProblem(f"{path}reading.importer", said))
    wrong += [
        FieldProblem(f"{path}reading.switches[{name}]", f"there is no importer `{name[:60]}`")
        for name in sorted(reading.switches)
        if name not in plugins.importers
    ]
    wrong += [
        no_pack(f"{path}reading.options[{pack}]", pack)
        for pack in sorted(reading.options)
        if plugins.pack(pack) is None
    ]
    if wrong:
        raise unfit(wrong)


def no_pack(field: str, name: str) -> FieldProblem:
    """Say that there is no such rule pack, and which there are."""
    known = ", ".join(sorted(load_plugins().packs))
    said = f"there is no rule pack `{name[:60]}`" if name else "the id of a rule pack is needed"
    return FieldProblem(field, f"{said}; installed: {known}")
