"""Handlers of the calls that plan changes: the weakest settings that meet requirements, and the smallest repair."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cqos.v1 import check_pb2, plan_pb2, report_pb2
from cqos_core.checking.hypothetical_pairs import with_profiles_tried
from cqos_core.model.excerpt import exact
from cqos_core.model.problems import CqosError, InputError, MissingError
from cqos_core.plugins import function
from cqos_core.remote.messages import to_message
from cqos_core.remote.refusal import Refused, unfit
from cqos_core.remote.request_problems import FieldProblem
from cqos_core.remote.request_systems import read_documents

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.analysis.plan import RepairPlan
    from cqos_core.model.system import System


def suggest_settings(request: check_pb2.SuggestRequest, most: int) -> check_pb2.SuggestResponse:
    """Find the weakest settings that meet the requirements of documents.

    Raises:
        Refused: they cannot be read, or no plan can be made.
    """
    plan = _make_plan(request.documents, most, "suggest")
    return check_pb2.SuggestResponse(revision=request.revision, plan=plan)


def repair_documents(request: check_pb2.RepairRequest, most: int) -> check_pb2.RepairResponse:
    """Find the smallest repair of documents.

    Raises:
        Refused: they cannot be read, or no plan can be made.
    """
    plan = _make_plan(request.documents, most, "repair", keep=tuple(request.keep), decide=request.decide)
    return check_pb2.RepairResponse(revision=request.revision, plan=plan)


def _make_plan(documents: check_pb2.Documents, most: int, name: str, **wishes: Any) -> plan_pb2.Plan:
    """Read documents and make a plan for them, with the function that has a name.

    Raises:
        Refused: ``FAILED_PRECONDITION`` if what plans is not installed.
    """
    _refuse_unnamed(documents)
    where, system = read_documents(documents, most, "documents.")

    def again(texts: Mapping[str, bytes]) -> System:
        changed = check_pb2.Documents()
        changed.CopyFrom(documents)
        for each in (*changed.documents, *changed.included):
            each.content = texts.get(each.name, each.content)
        try:
            return with_profiles_tried(read_documents(changed, most, "documents.")[1], where.default_protocol)
        except Refused as refused:
            raise InputError(refused.documents) from None

    importer = documents.reading.importer if documents.reading.HasField("importer") else None
    try:
        make = function(name)
        return plan_message(make(system.sources, again, where, importer=importer, **wishes))
    except InputError:
        raise
    except MissingError as error:  # the line that installs it is for the machine of the service, not for callers
        raise Refused(
            "FAILED_PRECONDITION", f"{error.what}: the service lacks the distribution `cqos-planning`"
        ) from None
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
