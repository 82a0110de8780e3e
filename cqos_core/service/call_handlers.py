"""Handlers of the calls without sessions: from the bytes of a request to the bytes of its answer.

Handlers only call the library, and may run in any process.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from google.protobuf import json_format

from cqos.v1 import catalogue_pb2, check_pb2, report_pb2
from cqos_core.analysis.differences import compare
from cqos_core.analysis.explanation import explain_pair
from cqos_core.analysis.pair_judge import stated_pairs
from cqos_core.checking.checker import check_system
from cqos_core.checking.hypothetical_pairs import with_profiles_tried
from cqos_core.matching.pipeline import context
from cqos_core.model.dataclass import dataclass
from cqos_core.model.exact_columns import with_exact_columns
from cqos_core.model.problems import CqosError, InputError
from cqos_core.plugins import load_plugins
from cqos_core.remote.asked import decode, decode_json, least_severe, paths_of, refusal_message, reported, write_pair
from cqos_core.remote.description import describe, elements_of
from cqos_core.remote.messages import list_text, to_message
from cqos_core.remote.refusal import TOO_LARGE, Refused, unfit
from cqos_core.remote.request_problems import FieldProblem
from cqos_core.remote.request_systems import no_pack, read_documents, read_input, read_system
from cqos_core.service.plans import repair_documents, suggest_settings

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from google.protobuf.message import Message

    from cqos_core.model.report import PairReport


@dataclass(frozen=True, slots=True)
class Method:
    """One call of the contract.

    Attributes:
        request: class of its message.
        answer: makes the answer from the message and the most endpoints of a system.
        apart: whether a request needs a worker although it is small.
    """

    request: Any
    answer: Callable[[Any, int], Message]
    apart: Callable[[Any], bool] = lambda _request: False


def answer(method: str, data: bytes, most_endpoints: int) -> bytes:
    """Answer a call.

    Raises:
        Refused: it cannot be answered.
    """
    return answer_to(method, decode(METHODS[method].request, data), most_endpoints)


def answer_to(method: str, request: Any, most_endpoints: int) -> bytes:
    """Answer a call whose message is decoded.

    Raises:
        Refused: it cannot be answered.
    """
    return _answer_message(method, request, most_endpoints).SerializeToString()


def _answer_message(method: str, request: Any, most_endpoints: int) -> Message:
    try:
        return METHODS[method].answer(request, most_endpoints)
    except RecursionError:
        raise Refused("INVALID_ARGUMENT", "values are nested too deep, which is refused") from None
    except InputError as error:  # bridges make too much of what was read
        text = "\n".join(str(each) for each in error.problems)
        raise Refused("RESOURCE_EXHAUSTED", text, documents=error.problems, reason=TOO_LARGE) from None


def answer_json(method: str, data: bytes, most_endpoints: int) -> bytes:
    """Answer a call in JSON.

    Raises:
        Refused: it cannot be answered.
    """
    request = decode_json(METHODS[method].request, data)
    return json_format.MessageToJson(_answer_message(method, request, most_endpoints), indent=None).encode()


# --- the catalogue ---


def list_packs(request: catalogue_pb2.ListPacksRequest, _most: int) -> catalogue_pb2.ListPacksResponse:
    """Return the installed packs."""
    from cqos_core.remote.catalogue import packs_message

    return packs_message(request.revision)


def get_pack(request: catalogue_pb2.GetPackRequest, _most: int) -> catalogue_pb2.GetPackResponse:
    """Return the description of one rule pack."""
    from cqos_core.remote.catalogue import pack_message

    pack = load_plugins().pack(request.id)
    if pack is None:
        problem = no_pack("id", request.id)
        raise Refused("NOT_FOUND", problem.description, [problem])
    return catalogue_pb2.GetPackResponse(revision=request.revision, pack=pack_message(pack))


def get_rule(request: catalogue_pb2.GetRuleRequest, _most: int) -> catalogue_pb2.GetRuleResponse:
    """Return the description of one rule."""
    from cqos_core.remote.catalogue import rule_message

    found = rule_message(request.code, request.revision)
    if found is None:
        text = f"no installed rule pack has a rule `{request.code[:60]}`"
        raise Refused("NOT_FOUND", text, [FieldProblem("code", text)])
    return found


# --- checks ---


def check_document(request: check_pb2.CheckDocumentRequest, most: int) -> check_pb2.CheckDocumentResponse:
    """Check files."""
    paths = paths_of(request, report_pb2.Report)
    where, system = read_documents(request, most)
    system = with_profiles_tried(system, where.default_protocol)
    report = with_exact_columns(check_system(system, replace(where, most_endpoints=most)), system.sources)
    found = reported(report, paths, least_severe(request))
    return check_pb2.CheckDocumentResponse(revision=request.revision, report=found, elements=elements_of(system))


def check_model(request: check_pb2.CheckSystemRequest, most: int) -> check_pb2.CheckSystemResponse:
    """Check a model."""
    paths = paths_of(request, report_pb2.Report)
    system = with_profiles_tried(read_system(request.system, most))
    report = check_system(system, replace(context(), most_endpoints=most))
    found = reported(report, paths, least_severe(request))
    return check_pb2.CheckSystemResponse(revision=request.revision, report=found)


def check_one_pair(request: check_pb2.CheckPairRequest, _most: int) -> check_pb2.CheckPairResponse:
    """Check one pair."""
    response = check_pb2.CheckPairResponse(revision=request.revision)
    write_pair_report(response.report, request)
    return response


def write_pair_report(message: report_pb2.PairReport, request: check_pb2.CheckPairRequest, path: str = "") -> None:
    """Check the pair of a request, and write the requested fields of its report."""
    paths = paths_of(request, report_pb2.PairReport, path)
    write_pair(message, judge_pair_request(request, path), paths)


def judge_pair_request(request: check_pb2.CheckPairRequest, path: str = "") -> PairReport:
    """Return the report of the pair of a request; ``path`` is that of its fields in errors.

    Raises:
        Refused: there is no such protocol.
    """
    if load_plugins().pack(request.protocol) is None:
        raise unfit([no_pack(f"{path}protocol", request.protocol)])
    pairs = stated_pairs(request.protocol, dict(request.options), dict(request.topic))
    return pairs.report(
        pairs.offer({**request.offered, **_lists(request.offered_lists)}),
        pairs.request({**request.requested, **_lists(request.requested_lists)}),
    )


def _lists(values: Mapping[str, check_pb2.NameList]) -> dict[str, str]:
    return {name: list_text(value.items) for name, value in values.items()}


def answer_of_stream(data: bytes) -> bytes:
    """Answer one message of a stream of pairs; its mistakes are part of the answer.

    Raises:
        Refused: it cannot be decoded, which ends the stream.
    """
    request = decode(check_pb2.CheckPairsRequest, data)
    response = check_pb2.CheckPairsResponse(revision=request.pair.revision)
    try:
        write_pair_report(response.report, request.pair, "pair.")
    except Refused as refused:
        response.refusal.CopyFrom(refusal_message(refused.fields))
    except RecursionError:
        response.refusal.CopyFrom(refusal_message([FieldProblem("pair", "values are nested too deep")]))
    return response.SerializeToString()


def describe_system(request: check_pb2.DescribeRequest, most: int) -> check_pb2.DescribeResponse:
    """Describe the endpoints of a system."""
    where, system = read_input(request, most)
    found = describe(system, replace(where, most_endpoints=most))
    return check_pb2.DescribeResponse(
        revision=request.revision,
        system=found.system,
        endpoints=[to_message(each, check_pb2.DescribedEndpoint) for each in found.endpoints],
        participants=[to_message(each, check_pb2.DescribedParticipant) for each in found.participants],
    )


def explain(request: check_pb2.ExplainRequest, most: int) -> check_pb2.ExplainResponse:
    """Explain one pair of a system."""
    paths = paths_of(request, report_pb2.PairReport)
    where, system = read_input(request, most)
    try:
        report = explain_pair(system, request.publisher, request.subscriber, replace(where, most_endpoints=most))
    except InputError:
        raise
    except CqosError as error:
        text = str(error)
        field = "publisher" if f"`{request.publisher}`" in text or not request.publisher else "subscriber"
        raise unfit([FieldProblem(field, text)]) from None
    response = check_pb2.ExplainResponse(revision=request.revision)
    write_pair(response.report, report, paths)
    return response


def compare_two(request: check_pb2.DiffRequest, most: int) -> check_pb2.DiffResponse:
    """Compare two systems."""
    (one, a), (other, b) = (read_input(getattr(request, side), most, f"{side}.") for side in ("a", "b"))
    where = other if one.default_protocol is None else one
    found = compare(a, b, where, request.topics, request.ignored)
    return check_pb2.DiffResponse(revision=request.revision, diff=to_message(found, report_pb2.Diff))


def convert(request: check_pb2.ConvertRequest, most: int) -> check_pb2.ConvertResponse:
    """Write a system in another form."""
    from cqos_core.packs.export import ExportContext

    plugins = load_plugins()
    info = plugins.exporters.get(request.exporter)
    if info is None:
        known = ", ".join(sorted(plugins.exporters))
        said = f"there is no exporter `{request.exporter[:60]}`; installed: {known}"
        raise unfit([FieldProblem("exporter", said)])
    choices = info.choices()
    wrong = [
        FieldProblem(f"settings[{name}]", f"`{value}` is none of {', '.join(choices[name])}")
        if name in choices
        else FieldProblem(
            f"settings[{name}]", f"{info.name} has no such setting; it has {', '.join(choices) or 'none'}"
        )
        for name, value in request.settings.items()
        if value not in choices.get(name, ())
    ]
    if wrong:
        raise unfit(wrong)
    where, system = read_input(request, most)
    settings = {name: values[0] for name, values in choices.items()} | dict(request.settings)
    exported = info.load()(
        system, ExportContext(where.find_pack, where.default_protocol, settings, find_rule=where.find_rule)
    )
    return check_pb2.ConvertResponse(
        revision=request.revision, text=exported.text, expressed=exported.expressed, notes=exported.notes
    )


def _always(_request: Any) -> bool:
    """Return True: a small file may expand to a large system, so a worker reads it."""
    return True


def _has_bridges(request: check_pb2.CheckSystemRequest) -> bool:
    """Whether a model has bridges, which add endpoints."""
    return bool(request.system.bridges)


METHODS: Final[Mapping[str, Method]] = {
    "/cqos.v1.CatalogueService/ListPacks": Method(catalogue_pb2.ListPacksRequest, list_packs),
    "/cqos.v1.CatalogueService/GetPack": Method(catalogue_pb2.GetPackRequest, get_pack),
    "/cqos.v1.CatalogueService/GetRule": Method(catalogue_pb2.GetRuleRequest, get_rule),
    "/cqos.v1.CheckService/CheckDocument": Method(check_pb2.CheckDocumentRequest, check_document, _always),
    "/cqos.v1.CheckService/CheckSystem": Method(check_pb2.CheckSystemRequest, check_model, _has_bridges),
    "/cqos.v1.CheckService/CheckPair": Method(check_pb2.CheckPairRequest, check_one_pair),
    "/cqos.v1.CheckService/Describe": Method(check_pb2.DescribeRequest, describe_system, _always),
    "/cqos.v1.CheckService/Explain": Method(check_pb2.ExplainRequest, explain, _always),
    "/cqos.v1.CheckService/Diff": Method(check_pb2.DiffRequest, compare_two, _always),
    "/cqos.v1.CheckService/Convert": Method(check_pb2.ConvertRequest, convert, _always),
    "/cqos.v1.CheckService/Suggest": Method(check_pb2.SuggestRequest, suggest_settings, _always),
    "/cqos.v1.CheckService/Repair": Method(check_pb2.RepairRequest, repair_documents, _always),
}
PAIRS: Final = "/cqos.v1.CheckService/CheckPairs"
EDIT: Final = "/cqos.v1.SessionService/Edit"
