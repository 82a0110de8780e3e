"""Hover texts: a policy with its value and origin, an endpoint with its partners, a key of the form."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.files.schema import written_name
from cqos_core.formatters import phrases
from cqos_core.language.policy import ENDPOINT, NEED
from cqos_core.model.finding import Fact, Verdict
from cqos_core.model.system import Endpoint, Participant, Profile
from cqos_lsp.completion import cursor_in, packs_at, schema_at
from cqos_lsp.names import ENDPOINTS, name_at, names_of
from cqos_lsp.place_index import items_on_line, owners_at, setting_at
from cqos_lsp.schema_words import doc_at

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cqos_core.language.policy import Policy
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.resolved_endpoint import Resolved
    from cqos_lsp.document_checks import Analysis
    from cqos_lsp.names import Name
    from cqos_lsp.place_index import PlacedItem
    from cqos_lsp.projects import Project

_MOST: Final = 20
"""More partners or users than this are counted."""


def hover(
    path: str, text: str, place: tuple[int, int], project: Project, analysis: Analysis | None, line_then: int | None
) -> str:
    """Return the Markdown for a one-based line and column; empty if nothing is known.

    Args:
        path: of the document.
        text: of the document, as it is now.
        place: line and column.
        project: of the document.
        analysis: of its system.
        line_then: the line in the text of the analysis; None if it was edited since.
    """
    line, column = place
    if analysis is not None and line_then is not None and (source := analysis.name_of(path)) is not None:
        marks = items_on_line(analysis, source, line_then)
        found = setting_at(analysis, marks, line_then, column)
        if found is not None:
            return _setting(found, analysis)
        name = name_at(names_of({source: analysis.sources[source]}), analysis.sources, source, line_then, column)
        if name is not None and (said := _name(name, analysis)):
            return said
        ends = [] if name is not None else owners_at(analysis, marks, line_then, column)
        if ends and not _is_system_file(analysis, source):
            return "\n\n---\n\n".join(_owner(mark, analysis) for mark in ends[:_MOST])
    return _word(path, text, line, column, project)


def _is_system_file(analysis: Analysis, source: str) -> bool:
    return bool(names_of({source: analysis.sources[source]}))


def _word(path: str, text: str, line: int, column: int, project: Project) -> str:
    """Return the description of the key at the cursor."""
    at = cursor_in(path, text, line - 1, column - 1)
    schema = None if at is None else schema_at(path, text, at, project)
    if at is None or schema is None:
        return ""
    lines = text.split("\n")
    key = lines[line - 1][at.start : at.end].strip("\"'") if line <= len(lines) else ""
    keys = (*at.path, key) if at.at_key else at.path
    doc = doc_at(schema, keys)
    if doc and not ENDPOINTS.isdisjoint(keys[:-1]):  # a key of the form that packs read as a policy
        found = ((pack, pack.find(ENDPOINT, str(keys[-1]))) for pack in packs_at(text, at, project))
        doc = "\n\n".join(about_policy(pack, pack.policies[index]) for pack, index in found if index is not None) or doc
    return doc if doc.startswith("**") else f"**{keys[-1]}**\n\n{doc}" if doc else ""


def about_policy(pack: RulePack, policy: Policy) -> str:
    """Return the description of a policy: doc, values, default, clause, other names."""
    doc = f"{policy.doc.rstrip('.')}." if policy.doc else ""
    whose = "" if len(policy.roles) != 1 or policy.level not in {ENDPOINT, NEED} else f", of {policy.roles[0]}s"
    rows = [
        ("values", policy.expected()),
        ("default", _default(policy)),
        ("clause", policy.clause),
        ("also called", ", ".join(f"`{each}`" for each in policy.aliases if each != written_name(policy))),
    ]
    listed = "\n".join(f"- {name}: {text}" for name, text in rows if text)
    return "\n\n".join(filter(None, [f"**{written_name(policy)}** ({pack.title}{whose})", doc, listed]))


def _default(policy: Policy) -> str:
    if policy.default is None or isinstance(policy.default, str):
        return f"`{policy.default}`" if policy.default else ""
    return ", ".join(f"`{text}` for {role}s" for role, text in policy.default.items())


def _setting(mark: PlacedItem, analysis: Analysis) -> str:
    parts = [about_policy(pack, policy) for pack, policy in mark.policies]
    for pack, policy in mark.policies:
        for end in _ends_of(mark, analysis):
            if end.pack is pack and policy.level in {ENDPOINT, NEED}:
                index = pack.vocabulary.indices[policy.level, policy.name]
                parts.append("In effect: {}, {}".format(*_value(end, index)))
                break
    return "\n\n".join(parts)


def _ends_of(mark: PlacedItem, analysis: Analysis) -> Iterable[Resolved]:
    """Return the resolved endpoints of an item: a service has one for requests and one for responses."""
    if not isinstance(mark.owner, Endpoint):
        return ()
    whose = mark.owner
    return (
        end
        for end in analysis.endpoints
        if end.endpoint.place == whose.place and not end.is_copy and f"{end.id}/".startswith(f"{whose.id}/")
    )


def fact_of(end: Resolved, index: int) -> Fact:
    """Return a policy of an endpoint with its value and origin."""
    policy = end.pack.policies[index]
    return Fact(policy.name, policy.format(end.profile.values[index]), end.origin(index)[0])


def _value(end: Resolved, index: int) -> tuple[str, str]:
    fact = fact_of(end, index)
    return f"`{fact.value}`", phrases.origin(fact) or "stated here"


def _name(name: Name, analysis: Analysis) -> str:
    """Return the page of the endpoint, participant, profile or topic of a name."""
    system = analysis.system
    if name.kind == "profile":
        if name.text in system.profiles:
            return _profile(system.profiles[name.text], analysis)
        return _presets(name.text, analysis)
    if name.kind == "participant" and name.text in system.participants:
        return _participant(system.participants[name.text], analysis)
    if name.kind in {"topic", "service", "action"}:
        mine = [end for end in analysis.endpoints if not end.is_copy and end.endpoint.topic == name.text]
        here = [end for end in mine if _stands_at(end, name)]
        return "\n\n---\n\n".join(endpoint_page(end, analysis) for end in (here or mine)[:_MOST])
    return ""


def _stands_at(end: Resolved, name: Name) -> bool:
    """Whether an endpoint is stated below a key, whose path has its participant and role."""
    groups = {"publisher": "publish", "subscriber": "subscribe"}
    whose = end.endpoint.template or end.participant.participant.id
    in_role = any(str(part).startswith(groups[end.role]) for part in name.path) or end.endpoint.kind != "message"
    return len(name.path) > 1 and (name.path[1] == whose or str(whose).startswith(f"{name.path[1]}/")) and in_role


def _owner(mark: PlacedItem, analysis: Analysis) -> str:
    if isinstance(mark.owner, Endpoint):
        return "\n\n".join(endpoint_page(end, analysis) for end in _ends_of(mark, analysis))
    if isinstance(mark.owner, Participant):
        return _participant(mark.owner, analysis)
    return "" if mark.owner is None else _profile(mark.owner, analysis)


def endpoint_page(end: Resolved, analysis: Analysis) -> str:
    """Return the values of an endpoint with their origins, and its partners."""
    shown = ((end.pack.policies[index].name, *_value(end, index)) for index in shown_policies(end))
    rows = [" | ".join(row) for row in (("policy", "value", "from"), ("---",) * 3, *shown)]
    head = f"**{end.role} `{end.id}`** on `{end.shown}` ({end.pack.title})"
    return "\n\n".join([head, "\n".join(f"| {row} |" for row in rows), _partners(end, analysis)])


def shown_policies(end: Resolved) -> list[int]:
    """Return the policies of an endpoint that rules compare, and those that are stated."""
    pack = end.pack
    compared = {
        use.index
        for bound in pack.by_scope.get("pair", ())
        if bound.rule.kind == "requires" and not bound.rule.guarantee
        for use in bound.bound.uses
    }
    stated = {index for layer in end.layers if not layer.assumed for index in layer.settings}
    return [
        index
        for index, policy in enumerate(pack.policies)
        if policy.level == ENDPOINT and not policy.derived and end.role in policy.roles and index in compared | stated
    ]


def _partners(end: Resolved, analysis: Analysis) -> str:
    found: dict[Verdict, list[str]] = {}
    for group in analysis.report.groups:
        mine, others = (
            (group.publishers, group.subscribers) if end.role == "publisher" else (group.subscribers, group.publishers)
        )
        if end.id in mine:
            codes = f" ({', '.join(group.codes)})" if group.codes and group.verdict is not Verdict.COMPATIBLE else ""
            found.setdefault(group.verdict, []).extend(f"`{other}`{codes}" for other in others)
    if not found:
        return "Nothing here matches it."
    verdicts = sorted(found, key=lambda verdict: -verdict.rank)
    return "\n\n".join(f"{str(verdict).capitalize()} with {_listed(found[verdict])}" for verdict in verdicts)


def _listed(names: Sequence[str]) -> str:
    more = len(names) - _MOST
    return ", ".join(names[:_MOST]) + (f" and {more} more" if more > 0 else "")


def _participant(one: Participant, analysis: Analysis) -> str:
    mine = [end for end in analysis.endpoints if end.participant.participant.id == one.id and not end.is_copy]
    titles = sorted({end.pack.title for end in mine})
    head = f"**participant `{one.id}`**" + (f" ({', '.join(titles)})" if titles else "")
    listed = "\n".join(f"- {end.role} on `{end.shown}`" for end in mine[:_MOST])
    more = f"\n- and {len(mine) - _MOST} more" if len(mine) > _MOST else ""
    return f"{head}\n\n{listed}{more}"


def _profile(profile: Profile, analysis: Analysis) -> str:
    users = [end.id for end in analysis.system.endpoints if any(ref.name == profile.name for ref in end.profiles)]
    settings = "\n".join(f"- {name}: `{setting.text}`" for name, setting in profile.settings.items())
    base = f"Based on {_listed([f'`{ref.name}`' for ref in profile.base])}." if profile.base else ""
    used = f"Used by {_listed([f'`{each}`' for each in users])}." if users else "No endpoint names it."
    return "\n\n".join(filter(None, [f"**profile `{profile.name}`**", base, settings, used]))


def _presets(name: str, analysis: Analysis) -> str:
    found = []
    for pack in analysis.project.all_packs:
        preset = pack.presets.get(pack.preset_names.get(name.lower(), name))
        if preset is not None:
            settings = "\n".join(f"- {each}: `{text}`" for each, text in preset.settings.items())
            found.append("\n\n".join(filter(None, [f"**preset `{name}`** ({pack.title})", preset.doc, settings])))
    return "\n\n".join(found)
