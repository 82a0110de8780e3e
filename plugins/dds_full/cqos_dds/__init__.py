"""The DDS rule pack of C-QoS. Here are only the hooks; everything else is imported when a check needs it."""

from __future__ import annotations

from collections.abc import Callable

from cqos_core.plugins import ExporterInfo, ImporterInfo, RulePackInfo, hookimpl


@hookimpl
def register_rule_packs(register: Callable[[RulePackInfo], None]) -> None:
    """Register ``dds``."""
    summary = "every QoS policy of DDS 1.4 and DDS-XTypes 1.3, as the standard and as implementations judge them"
    register(RulePackInfo("dds", summary, "cqos_dds.pack:PACK"))


@hookimpl
def register_importers(register: Callable[[ImporterInfo], None]) -> None:
    """Register the files that DDS people have."""
    for name, summary in _READ:
        claim = f"cqos_dds.importers.detect:claims_{name}"
        reader = f"cqos_dds.importers.{name}:read"
        inserter = "cqos_dds.exporters.editing:insert" if name in _EDITED else ""
        suffix = ".ini" if name == "opendds_ini" else ".xml"
        shares = name == "dds_xml"
        register(ImporterInfo(name, summary, (suffix,), claim, reader, inserter=inserter, shares_names=shares))


@hookimpl
def register_exporters(register: Callable[[ExporterInfo], None]) -> None:
    """Register the forms that implementations of DDS read."""
    for name, summary, settings in _WRITTEN:
        register(ExporterInfo(name, summary, ".xml", f"cqos_dds.exporters.{name}:write", settings))


_READ = (
    ("dds_xml", "DDS-XML: libraries of QoS, domains, participants and applications"),
    ("fastdds_xml", "XML profiles of Fast DDS, as programs of DDS use them"),
    ("cyclonedds_xml", "Configurations of Cyclone DDS (CYCLONEDDS_URI): the lease of participants"),
    ("opendds_ini", "Configurations of OpenDDS (DCPSConfigFile): the lease of participants"),
)
_EDITED = ("dds_xml", "fastdds_xml")
_WRITTEN = (
    (
        "dds_xml",
        "DDS-XML with a library of QoS profiles, and the participants that use them",
        ("participants=with|without",),
    ),
    ("fastdds_xml", "Fast DDS profiles of data writers and data readers", ("topics=unnamed|named",)),
)
