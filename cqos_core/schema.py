"""The JSON schema of the system form, for editors and generators, made from the forms that files are read by."""

from __future__ import annotations

from typing import Any

from cqos_core.importers.yaml_form import DOCUMENT, VERSION


def system_schema() -> dict[str, Any]:
    """Return the schema (draft 2020-12) of a C-QoS system file, as ``cqos schema`` prints it.

    It describes one document without `instances` put in and without merging `include`; what settings there are and
    which values they take is known to the rule packs.
    """
    shared: dict[str, Any] = {}
    document = DOCUMENT.definition(shared)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"C-QoS system file, version {VERSION}",
        "description": "Participants, what they publish and subscribe to, and with which quality of service.",
        **document,
        "$defs": shared,
    }
