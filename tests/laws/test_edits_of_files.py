"""Law: an edit that is offered can be applied, and is read back as its value; in every format, for every policy."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

import pytest

from cqos_core.api import context, read
from cqos_core.files.edited_files import apply_edits
from cqos_core.language.domains import Choice, Count, Duration, Flag
from cqos_core.model.problems import InputError
from cqos_core.resolving.resolver import resolve
from cqos_core.resolving.setting_edits import edits_of
from tests.effort import EXPLORE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.language.policy import Policy
    from cqos_core.language.values import Plain, Value
    from cqos_core.resolving.resolved_endpoint import Resolved

ROOT: Final = Path(__file__).parents[2]
FIND_PACK: Final = context().find_pack
FILES: Final = sorted(
    path
    for pattern in ("plugins/ros2/tests/importers/cases/*/*", "tests/decisive/designs/**/*", "examples/*/*.json5")
    for path in ROOT.glob(pattern)
    if path.is_file()
)
ENDPOINTS: Final = 24 if EXPLORE else 2
"""So many of a file are edited, far from each other."""


def resolved(data: bytes) -> list[Resolved]:
    system = read(data)
    return resolve(system, FIND_PACK, system.protocol).endpoints


def another(policy: Policy, now: Value) -> Plain | None:
    """Return a value that a policy does not have now."""
    domain = policy.domain
    values: tuple[Plain, ...] = ()
    if isinstance(domain, (Choice, Flag)):
        values = tuple(domain.candidates())
    elif isinstance(domain, Duration):
        values = (2_000_000_000, 3_000_000_000)
    elif isinstance(domain, Count):
        values = (7, 8)
    return next((each for each in values if each != now and domain.has(each) and policy.spelling(each)), None)


def changes(endpoint: Resolved) -> Iterator[tuple[int, Plain]]:
    for index, policy in enumerate(endpoint.pack.policies):
        value = another(policy, endpoint.profile.values[index])
        settable = policy.level in {"endpoint", "participant", "broker"} and not policy.derived
        # What the middleware ignores has its default, whatever is stated; no fix sets it.
        ignored = endpoint.origin(index)[0] == "ignored by the middleware"
        if value is not None and settable and not ignored and endpoint.role in policy.roles:
            yield index, value


@pytest.mark.explored
@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_every_edit_is_read_back_as_its_value(path):
    data = path.read_bytes()
    try:
        endpoints = resolved(data)
    except InputError:
        pytest.skip("it is refused, or no system by itself")
    wrong = []
    for endpoint in endpoints[:: max(1, len(endpoints) // ENDPOINTS)][:ENDPOINTS]:
        for index, value in changes(endpoint):
            edits = edits_of([endpoint], index, value)
            if not edits:
                continue
            made = apply_edits({"<bytes>": data}, edits)
            name = f"{endpoint.id}, {endpoint.pack.policies[index].name}"
            if made.left or not made.texts:
                wrong.append(f"{name}: {made.left}")
                continue
            again = [each for each in resolved(made.texts["<bytes>"]) if each.id == endpoint.id]
            if [each.profile.values[index] for each in again] != [value]:
                wrong.append(f"{name}: {edits[0].old} became {edits[0].new}")
    assert not wrong, "\n".join(wrong)
