"""Profiles that RTI Connext has built in, as far as their names say what they set of the policies that are judged here.

Files name them as bases, and no file defines them (RTI Connext, Built-in QoS Profiles).
"""

from __future__ import annotations

from typing import Final

from cqos_core.packs import Preset

_LIBRARY: Final = "BuiltinQosLib::"
_EXPERIMENTAL: Final = "BuiltinQosLibExp::"
_SNIPPETS: Final = "BuiltinQosSnippetLib::"
_STRICT: Final = {"reliability": "reliable", "history": "keep_all"}
_KEEP_LAST: Final = {"reliability": "reliable", "history": "keep_last"}


def _generic(doc: str, *names: str, **settings: str) -> dict[str, Preset]:
    """Return one preset for each name, in the library and in the one where it was experimental."""
    return {
        f"{_LIBRARY}{name}": Preset(settings, f"{doc} Built into RTI Connext.", aliases=(f"{_EXPERIMENTAL}{name}",))
        for name in names
    }


def _snippet(name: str, **settings: str) -> dict[str, Preset]:
    stated = " and ".join(f"{policy} {value}" for policy, value in settings.items())
    return {f"{_SNIPPETS}QosPolicy.{name}": Preset(settings, f"Sets {stated}. Built into RTI Connext.")}


PRESETS: Final[dict[str, Preset]] = {
    **_generic("Nothing is sent again.", "Generic.BestEffort", reliability="best_effort"),
    **_generic("The newest samples arrive in the end.", "Generic.KeepLastReliable", **_KEEP_LAST),
    **_generic(
        "Every sample arrives.",
        "Generic.StrictReliable",
        "Generic.StrictReliable.HighThroughput",
        "Generic.StrictReliable.LowLatency",
        "Generic.StrictReliable.LargeData",
        **_STRICT,
    ),
    **_generic(
        "The newest samples arrive in the end, at late readers too.",
        "Generic.KeepLastReliable.TransientLocal",
        **_KEEP_LAST,
        durability="transient_local",
    ),
    **_generic("The defaults, with another configuration of the participant.", "Baseline", "Generic.Common"),
    **_snippet("Reliability.Reliable", reliability="reliable"),
    **_snippet("Reliability.BestEffort", reliability="best_effort"),
    **_snippet("Durability.TransientLocal", durability="transient_local"),
    **_snippet("Durability.Transient", durability="transient"),
    **_snippet("Durability.Persistent", durability="persistent"),
    **_snippet("History.KeepAll", history="keep_all"),
    **_snippet("History.KeepLast_1", history="keep_last", **{"history.depth": "1"}),
}
