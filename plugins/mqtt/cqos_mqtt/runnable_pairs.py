"""What a run of a pair on a broker and a model of it have in common: values as rules have them, and which pairs neither shows."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.packs.prover import NotRunnableError
from cqos_mqtt import connection_policies as of_connection
from cqos_mqtt import endpoint_policies as of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.packs import Plain, Policy
    from cqos_core.packs.prover import Plan


def known(policy: Policy, values: Mapping[str, str]) -> Plain | None:
    """Return a value as rules have it, by default where it is not stated; None for a fact that is not known."""
    text = values.get(policy.name, policy.default)
    if not isinstance(text, str):
        return None
    meaning = policy.words.get(policy.word(text), text)
    return policy.domain.parse(meaning) if isinstance(meaning, str) else None


def ensure_runnable(plan: Plan) -> None:
    """Refuse a pair of which neither a run nor a model of its two clients shows what happens.

    Raises:
        NotRunnableError: it is such a pair; the text says why.
    """
    if known(of.IS_WILL, plan.publisher.values):
        raise NotRunnableError(
            "a Will is published by the broker and not by its client, so no samples can be sent on it"
        )
    for end in (plan.publisher, plan.subscriber):
        if known(of_connection.SAME_ID, end.participant):
            raise NotRunnableError(
                f"the client of `{end.id}` has the id `{end.participant[of_connection.CLIENT_ID.name]}` of another client of the "
                "broker, so each ends the connection of the other (MQTT410). A run starts one client for each end and cannot "
                "show that; give each client an id of its own"
            )
