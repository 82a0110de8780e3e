"""Handlers of the calls that plan changes: the weakest settings that meet requirements, and the smallest repair."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from cqos.v1 import check_pb2, plan_pb2, report_pb2
from cqos_core.checking.trial import tried_out
from cqos_core.model.excerpt import exact
from cqos_core.model.problems import CqosError, InputError, MissingError
from cqos_core.remote.documents import read_documents
from cqos_core.remote.messages import to_message
from cqos_core.remote.refusal import Refused, unfit
from cqos_core.remote.request_problems import FieldProblem

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cqos_core.analysis.planning.plan import RepairPlan
    from cqos_core.model.system import System


def suggest_settings(request: check_pb2.SuggestRequest, most: int) -> check_pb2.SuggestResponse:
    """Find the weakest settings that meet the requirements of documents.

    Raises:
        Refused: they cannot be read, or no plan can be made.
    """
    from cqos_core.analysis.planning.suggestion import find_suggestion

    plan = _make_plan(request.documents, most, find_suggestion)
    return check_pb2.SuggestResponse(revision=request.revision, plan=plan)


def repair_documents(request: check_pb2.RepairRequest, most: int) -> check_pb2.RepairResponse:
    """Find the smallest repair of documents.

    Raises:
        Refused: they cannot be read, or no plan can be made.
    """
    from cqos_core.analysis.planning.search import find_repair

    make = partial(find_repair, keep=tuple(request.keep), decide=request.decide)
    return check_pb2.RepairResponse(revision=request.revision, plan=_make_plan(request.documents, most, make))


def _make_plan(documents: check_pb2.Documents, most: int, make: Callable[..., RepairPlan]) -> plan_pb2.Plan:
    """Return the plan for documents.

    Raises:
        Refused: ``FAILED_PRECONDITION`` if the solver is not installed.
    """
    from cqos_core.language.solver import load

    _refuse_unnamed(documents)
    where, system = read_documents(documents, most, "documents.")

    def again(texts: Mapping[str, bytes]) -> System:
        changed = check_pb2.Documents()
        changed.CopyFrom(documents)
        for each in (*changed.documents, *changed.included):
            each.content = texts.get(each.name, each.content)
        try:
            return tried_out(read_documents(changed, most, "documents.")[1], where.default_protocol)
        except Refused as refused:
            raise InputError(refused.documents) from None

    importer = documents.reading.importer if documents.reading.HasField("importer") else None
    try:
        load()
        return plan_message(make(system.sources, again, where, importer=importer))
    except InputError:
        raise
    except MissingError as error:  # the line that installs it is for the machine of the service, not for callers
        raise Refused("FAILED_PRECONDITION", f"{error.what}: the service lacks the extra `repair`") from None
    except CqosError as error:
        raise Refused("FAILED_PRECONDITION", str(error)) from None


def _refuse_unnamed(documents: check_pb2.Documents) -> None:
    """Refuse documents without a unique name, because edits of a plan refer to documents by name."""
    names = [each.name for each in documents.documents]
    wrong = [
        FieldProblem(
            f"documents.documents[{index}].name",
            f"`{name[:60]}` is the name of another document"
            if name
            else "a name is needed, by which edits refer to it",
        )
        for index, name in enumerate(names)
        if not name or name in names[:index]
    ]
    if wrong:
        raise unfit(wrong)


def plan_message(plan: RepairPlan) -> plan_pb2.Plan:
    """Return the message of a plan; places are those in the texts before it."""
    at = exact({edit.place for each in plan.changes for edit in each.edits}, plan.edited.before)
    message = plan_pb2.Plan(
        weight=plan.weight,
        confirmed=plan.confirmed,
        proven=plan.proven,
        conflicts=[plan_pb2.PlanConflict(parts=each) for each in plan.conflicts],
        costs=plan.costs,
        grown=plan.grown,
        brought=[to_message(each, report_pb2.Finding) for each in plan.brought],
        cut=plan.cut,
        left=[to_message(each, report_pb2.Finding) for each in plan.left] if plan.confirmed else [],
    )
    for each in plan.changes:
        change = message.changes.add(
            text=each.text,
            policy=each.policy,
            old=each.old,
            new=each.new,
            members=each.members,
            weight=each.weight,
            weakens=each.weakens,
            kind=each.kind,
            shared=each.shared,
            because=each.because,
            costs=each.costs,
        )
        for edit in each.edits:
            change.edits.append(to_message(edit, report_pb2.Edit))
            change.edits[-1].place.CopyFrom(to_message(at[edit.place], report_pb2.Place))
    return message
