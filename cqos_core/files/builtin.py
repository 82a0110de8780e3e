"""Registers the importers, exporters, formatters and commands of the core, by the hooks of plugins."""

from __future__ import annotations

from collections.abc import Callable

from cqos_core.plugins import CommandInfo, ExporterInfo, FormatterInfo, ImporterInfo, hookimpl

_CLAIMS = "cqos_core.importers.format_detection"


@hookimpl
def register_importers(register: Callable[[ImporterInfo], None]) -> None:
    """Register the importers of BPMN and of system files."""
    register(
        ImporterInfo(
            "bpmn",
            "BPMN 2.0 collaborations with QoS on signal events",
            (".bpmn", ".bpmn20.xml", ".bpmn2"),
            f"{_CLAIMS}:claims_bpmn",
            "cqos_core.bpmn:read",
            whole=True,
            inserter="cqos_core.bpmn.editing:insert",
            drawn="cqos_core.bpmn.form:FORM",
        )
    )
    register(
        ImporterInfo(
            "yaml",
            "C-QoS system files, YAML or JSON",
            (".yaml", ".yml", ".json"),
            f"{_CLAIMS}:claims_yaml",
            "cqos_core.importers.yaml_system:read",
            whole=True,
            inserter="cqos_core.files.yaml_edits:insert",
        )
    )


@hookimpl
def register_exporters(register: Callable[[ExporterInfo], None]) -> None:
    """Register the exporters of system files and of BPMN."""
    writer = "cqos_core.files.yaml_writer:write"
    register(ExporterInfo("yaml", "a C-QoS system file", ".yaml", writer, ("profiles=kept|shared",)))
    summary = "a BPMN model with its QoS as attributes in words"
    register(ExporterInfo("bpmn", summary, ".bpmn", "cqos_core.files.bpmn_qos_writer:write"))


@hookimpl
def register_formatters(register: Callable[[FormatterInfo], None]) -> None:
    """Register the output formats of ``cqos check``."""
    for name, summary in (
        ("text", "what is wrong, where and what to write, in at most eight lines per finding"),
        ("full", "one paragraph with excerpt and fixes per finding"),
        ("concise", "one line per finding; findings of one cause share one"),
        ("statistics", "one line per rule, with the number of its findings"),
        ("json", "the whole report, versioned"),
        ("jsonl", "one JSON object per line: summary, groups, findings"),
        ("sarif", "SARIF 2.1.0 for code scanning"),
        ("junit", "JUnit XML for CI dashboards"),
        ("github", "GitHub workflow annotations"),
        ("gitlab", "GitLab's Code Quality report"),
        ("rdjson", "reviewdog's diagnostics, for the review of any forge"),
        ("markdown", "Markdown for the summary of a step or a comment"),
    ):
        module = "json_report" if name in {"json", "jsonl"} else name
        renderer = f"cqos_core.formatters.{module}:render_{name}"
        people, plugins_have_it = name in {"text", "full", "concise", "statistics"}, name in {"markdown", "statistics"}
        register(FormatterInfo(name, summary, renderer, for_people=people, gives_way=plugins_have_it))


@hookimpl
def register_commands(register: Callable[[CommandInfo], None]) -> None:
    """Register the subcommands of ``cqos``."""
    for name, summary in (
        ("check", "Check designs, and report each pair as compatible, incompatible or unknown."),
        ("explain", "Explain one publisher and one subscriber: whether they fit, why, and what to write."),
        ("convert", "Write a system in another form: as a design in YAML, as parameters, as code."),
        ("diff", "List the differences of two systems on the same topics and endpoints."),
        ("breaking", "Find pairs that get worse while a system is updated, and a safe order of updates."),
        ("rule", "Explain a rule or code: its condition, its reason, and what to do."),
        ("packs", "List rule packs, file formats and other plugins."),
        ("init", "Write a commented configuration for what lies in a folder."),
        ("modeler", "Draw a system in the browser, and see the QoS while you draw."),
        ("serve", "Serve checks by gRPC, to modelers and to others."),
        ("test-pack", "Run the case files of a rule pack."),
        ("completion", "Print a script by which bash, zsh or fish completes commands, rules and packs."),
        ("schema", "Print the JSON schema of the YAML system file."),
    ):
        module = "pack_cases:test_pack" if name == "test-pack" else f"{name}:{name}"
        register(CommandInfo(name, summary, f"cqos_core.cli.{module}"))
