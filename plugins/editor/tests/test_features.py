"""What an editor asks for: hover, completion, names, fixes, outline and hints, in system files and in other formats."""

import json
import re
from functools import cache
from pathlib import Path

import pytest

from cqos_core.files.schema import suggested_values, system_schema, written_name
from cqos_core.importers import yaml_form
from cqos_core.language.policy import NEED
from cqos_core.packs import ENDPOINT
from cqos_core.plugins import load_plugins
from cqos_core.resolving.unknown_names import can_be_stated
from plugins.editor.tests.client import RefusedError

ROOT = Path(__file__).resolve().parents[3]
PACKS = [pack for name in sorted(load_plugins().packs) if (pack := load_plugins().pack(name)) is not None]
KEYS = yaml_form.ENDPOINT.keys
WHOLE = {"start": {"line": 0, "character": 0}, "end": {"line": 9999, "character": 0}}
TEXT = """\
cqos: 1
protocol: ros2
profiles:
  video: {reliability: best_effort, depth: 5}
participants:
  camera:
    publishes:
      /image: {profile: video}
      /status:
        reliability: reliable
  viewer:
    subscribes:
      /image: {reliability: reliable}
      /status: {needs: {late_join: true}}
    starts_after: camera
accept:
  - {rule: ROS512, endpoint: viewer/subscriber/status, because: the status comes often}
"""


def place_of(text, word, number=0):
    """Return line and column of the second character of a word."""
    at = -1
    for _ in range(number + 1):
        at = text.index(word, at + 1)
    before = text[:at]
    return before.count("\n"), at - before.rfind("\n")


def completed(editor, path, text):
    """Return what is completed at `¦`, by label."""
    before = text[: text.index("¦")]
    editor.change(path, text.replace("¦", ""))
    found = editor.at(path, "completion", before.count("\n"), len(before) - before.rfind("\n") - 1)
    return {} if found is None else {each["label"]: each for each in found["items"]}


def hovered(editor, path, text, word, number=0):
    found = editor.at(path, "hover", *place_of(text, word, number))
    return "" if found is None else found["contents"]["value"]


def applied(text, edits):
    """Apply edits of the protocol to a text without characters that count twice."""
    starts = [0, *(at + 1 for at, each in enumerate(text) if each == "\n")]
    for edit in sorted(edits, key=lambda each: (each["range"]["start"]["line"], each["range"]["start"]["character"]))[
        ::-1
    ]:
        start, end = (starts[edit["range"][at]["line"]] + edit["range"][at]["character"] for at in ("start", "end"))
        text = text[:start] + edit["newText"] + text[end:]
    return text


def lines(locations):
    return [each["range"]["start"]["line"] for each in locations or []]


@pytest.fixture
def design(editor, tmp_path):
    path = tmp_path / "design.yaml"
    path.write_text(TEXT)
    assert editor.open(path) == [("ROS101", 12, 28, 36)]
    return path


# Every pack


@pytest.mark.parametrize("pack", PACKS, ids=lambda pack: pack.id)
def test_every_policy_is_completed_and_explained(editor, tmp_path, pack):
    """Keys, values and hover of each policy that an endpoint may state, of both roles, and of each requirement."""
    path = tmp_path / "design.yaml"
    editor.open(path, "cqos: 1\n")
    for role, group in (("publisher", "publishes"), ("subscriber", "subscribes")):
        mine = [
            policy
            for policy in pack.policies
            if policy.level == ENDPOINT and not policy.derived and can_be_stated(policy) and role in policy.roles
        ]
        head = f"cqos: 1\nprotocol: {pack.id}\nparticipants:\n  a:\n    {group}:\n      t: "
        found = completed(editor, path, head + "{¦")
        assert {policy.name for policy in mine} <= found.keys()
        assert all(policy.doc.rstrip(".") in found[policy.name]["documentation"]["value"] for policy in mine)
        other = {policy.name for policy in pack.policies if policy.level == ENDPOINT and role not in policy.roles}
        assert not other & found.keys() - {policy.name for policy in mine}
        for policy in mine[:: 1 + len(mine) // 8]:
            values = completed(editor, path, f"{head}{{{policy.name}: ¦")
            assert {spelled(value) for value in suggested_values(policy)} <= values.keys()
        text = head + "{" + ", ".join(f"{policy.name}: {a_value(policy)}" for policy in mine) + "}\n"
        editor.change(path, text)
        for policy in mine[:: 1 + len(mine) // 8]:
            said = hovered(editor, path, text, f" {policy.name}:" if policy is not mine[0] else f"{{{policy.name}:")
            assert policy.doc.rstrip(".") in said
            if policy.name in KEYS:  # the schema speaks of it
                continue
            assert f"**{policy.name}** ({pack.title}" in said
            assert not policy.clause or f"clause: {policy.clause}" in said
            assert "In effect: " in said
    needs = {
        written_name(each) for each in pack.policies if each.level == NEED and can_be_stated(each) and not each.derived
    }
    head = f"cqos: 1\nprotocol: {pack.id}\nparticipants:\n  a:\n    subscribes:\n      t:\n        "
    assert completed(editor, path, head + "needs: {¦").keys() == needs
    presets = {name for name, preset in pack.presets.items() if preset.level == ENDPOINT}
    assert completed(editor, path, head + "profile: ¦").keys() >= presets
    options = {each.name for each in pack.policies if each.level == "option" and not each.derived}
    assert completed(editor, path, f"cqos: 1\noptions:\n  {pack.id}:\n    ¦").keys() == options


def spelled(value):
    return value if isinstance(value, str) else json.dumps(value)


def a_value(policy):
    return next((json.dumps(spelled(value)) for value in suggested_values(policy)), "x")


whole_schema = cache(lambda: system_schema(PACKS))


@pytest.mark.parametrize(
    "place",
    [
        "¦",
        "protocol: ¦",
        "profiles:\n  x: {¦",
        "participants:\n  a: {¦",
        "participants:\n  a: {options: {¦",
        "participants:\n  a: {publishes: {t: {¦",
        "participants:\n  a: {subscribes: {t: {needs: {¦",
        "topics: {t: {¦",
        "brokers: {b: {¦",
        "bridges: {b: {routes: [{¦",
        "checks: [{¦",
        "options: {mqtt: {¦",
    ],
)
def test_the_schema_alone_completes_the_same_words(editor, tmp_path, place):
    """A word is completed by the server where the schema has it among its properties or values, and nowhere else."""
    path = tmp_path / "design.yaml"
    editor.open(path, "cqos: 1\n")
    found = completed(editor, path, f"cqos: 1\n{place}")
    schema = whole_schema()
    keys = [
        part for part in place.replace("¦", "").replace("{", " ").replace("[", " [ ").replace("\n", " ").split() if part
    ]
    at = [{"[": 0}.get(part, part.rstrip(":")) for part in keys]
    words, values = in_schema(schema, [schema], at)
    expected = (values if place.endswith(": ¦") else words) - {"cqos"}
    if place == "participants:\n  a: {publishes: {t: {¦":
        expected -= {"needs"}
    assert found.keys() <= expected
    only_subscribers = {"needs"}
    missing = expected - found.keys() - only_subscribers
    roles = {role for pack in PACKS for each in pack.policies if written_name(each) in missing for role in each.roles}
    assert roles <= {"subscriber"}


def in_schema(schema, nodes, path):
    """Return properties and constants that an editor finds at a path of the schema, written independently of the server."""

    def whole(node):
        found, waiting = [], [node]
        while waiting:
            each = waiting.pop()
            if isinstance(each, dict):
                found.append(each)
                waiting += [*each.get("allOf", []), *each.get("anyOf", [])]
                waiting += [schema["$defs"][each["$ref"].split("/")[-1]]] if "$ref" in each else []
        return found

    here = [each for node in nodes for each in whole(node)]
    if not path:
        names = {name for each in here for name, about in each.get("properties", {}).items() if about is not False}
        constants = {each["const"] for each in here if "const" in each}
        return names, constants
    step, *rest = path
    below = [
        each.get("items") if step == 0 else each.get("properties", {}).get(step, each.get("additionalProperties"))
        for each in here
    ]
    return in_schema(schema, [each for each in below if isinstance(each, dict)], rest)


# One system


def test_completion_knows_the_names_of_the_system(editor, design):
    assert "video" in completed(editor, design, TEXT.replace("profile: video", "profile: ¦"))
    assert completed(editor, design, TEXT.replace("starts_after: camera", "starts_after: ca¦")).keys() == {
        "camera",
        "viewer",
    }
    assert {"/image", "/status"} <= completed(editor, design, TEXT + "topics:\n  ¦").keys()
    assert "ROS101" in completed(editor, design, TEXT.replace("rule: ROS512", "rule: ¦"))
    assert completed(editor, design, TEXT.replace("depth: 5", "# ¦")) == {}
    item = completed(editor, design, TEXT.replace("depth: 5", "dep¦"))["depth"]
    assert applied(TEXT.replace("depth: 5", "dep"), [item["textEdit"]]) == TEXT.replace("depth: 5", "depth: ")


def test_hover_says_value_origin_clause_and_who_matches(editor, design):
    said = hovered(editor, design, TEXT, "reliability", 2)
    assert "**reliability** (ROS 2)" in said
    assert "clause: DDS 1.4, 2.2.3.14" in said
    assert "In effect: `reliable`, stated here" in said
    said = hovered(editor, design, TEXT, "/image")
    assert "| reliability | `best_effort` | from profile video |" in said
    assert "Incompatible with `viewer/subscriber/image` (ROS101)" in said
    assert "Used by `camera/publisher/image`." in hovered(editor, design, TEXT, "video")
    assert "- publisher on `/status`" in hovered(editor, design, TEXT, "camera")
    assert "**late_join** (ROS 2" in hovered(editor, design, TEXT, "late_join")
    assert "Topics it publishes" in hovered(editor, design, TEXT, "publishes")


def test_definitions_and_references(editor, design):
    def ask(method, word, number=0):
        return lines(editor.at(design, method, *place_of(TEXT, word, number)))

    assert ask("definition", "video", 1) == [3]
    assert ask("definition", "/image", 1) == [7]
    assert ask("definition", "camera", 1) == [5]
    assert ask("references", "/image") == [7, 12]
    assert ask("references", "camera") == [5, 14]
    assert ask("references", "reliability") == []


@pytest.mark.parametrize(
    ("word", "new", "expected"),
    [
        ("video", "film", TEXT.replace("video", "film")),
        ("camera", "left: eye", TEXT.replace("camera", "'left: eye'")),
        ("/status", "/state", TEXT.replace("/status", "/state").replace("subscriber/status", "subscriber/state")),
        ("video", "film: x}", TEXT.replace("video", "'film: x}'")),
        ("viewer", "screen", TEXT.replace("viewer", "screen")),
    ],
)
def test_a_new_name_reaches_every_place_and_changes_nothing_else(editor, design, word, new, expected):
    assert editor.at(design, "prepareRename", *place_of(TEXT, word)) is not None
    changes = editor.at(design, "rename", *place_of(TEXT, word), newName=new)["changes"]
    changed = applied(TEXT, changes[design.as_uri()])
    assert changed.replace('"', "'") == expected
    assert [each[0] for each in editor.change(design, changed)] == ["ROS101"]


@pytest.mark.parametrize(("word", "new"), [("/image", "/status"), ("camera", "viewer")])
def test_a_name_that_would_change_the_system_is_refused(editor, design, word, new):
    with pytest.raises(RefusedError, match=new):
        editor.at(design, "rename", *place_of(TEXT, word), newName=new)


@pytest.mark.parametrize(
    ("file", "text", "word"),
    [
        ("pack.yaml", "cqos_pack: 1\nid: mine\ntitle: Mine\npolicies: {speed: {kind: count}}\n", "speed"),
        ("cqos.toml", '[options.ros2]\nrmw = "cyclonedds"\n', "rmw"),
    ],
)
def test_a_name_that_unseen_files_may_use_is_refused_with_the_reason(editor, tmp_path, file, text, word):
    path = tmp_path / file
    path.write_text(text)
    editor.open(path)
    for method in ("prepareRename", "rename"):
        with pytest.raises(RefusedError, match="in system files only"):
            editor.at(path, method, *place_of(text, word), newName="other")


def test_a_key_of_the_form_that_packs_read_is_explained_by_them(editor, tmp_path):
    path = tmp_path / "design.yaml"
    text = "cqos: 1\nprotocol: dds\nparticipants: {a: {publishes: {t: {type: Weather}}}}\n"
    path.write_text(text)
    editor.open(path)
    said = editor.at(path, "hover", *place_of(text, "type"))["contents"]["value"]
    assert "- clause: DDS 1.4, 2.2.2.3" in said
    assert "- also called: `type_name`, `data_type`" in said


def test_fixes_are_changes_of_the_open_text(editor, design):
    found = editor.ask(
        "textDocument/codeAction",
        {
            "textDocument": {"uri": design.as_uri()},
            "range": WHOLE,
            "context": {"diagnostics": editor.diagnostics[design.as_uri()]},
        },
    )
    fixes = [each for each in found if "accept" not in each["title"]]
    assert [each["isPreferred"] for each in fixes] == [True, False]
    for fix in fixes:
        assert fix["diagnostics"][0]["code"] == "ROS101"
        assert editor.change(design, applied(TEXT, fix["edit"]["changes"][design.as_uri()])) == []
    [accept] = [each for each in found if "accept" in each["title"]]
    text = applied(TEXT, accept["edit"]["changes"][design.as_uri()])
    assert "CQ607" in {each[0] for each in editor.change(design, text)}
    assert editor.change(design, text.replace("[ROS101] ", "[ROS101] frames are sent again")) == []


def test_outline_and_hints_stay_while_the_text_cannot_be_read(editor, design):
    def hints():
        found = editor.ask("textDocument/inlayHint", {"textDocument": {"uri": design.as_uri()}, "range": WHOLE})
        return {each["position"]["line"]: (each["position"]["character"], each["label"]) for each in found}

    outline = editor.ask("textDocument/documentSymbol", {"textDocument": {"uri": design.as_uri()}})
    assert [(each["name"], [one["name"] for one in each.get("children") or []]) for each in outline] == [
        ("video", []),
        ("camera", ["/image", "/status"]),
        ("viewer", ["/image", "/status"]),
    ]
    before = hints()
    assert before[7][0] == len("      /image: {profile: video}")
    assert before[7][1].startswith("depth 5 (from profile video), reliability best_effort (from profile video)")
    assert before[8] == (
        len("      /status:"),
        "durability volatile, deadline infinite, liveliness automatic, liveliness_lease_duration infinite, … 1 more",
    )
    assert [each[0] for each in editor.change(design, TEXT.replace("participants:", "x: [\nparticipants:"))] == [
        "CQ001"
    ]
    assert hints() == {line + 1: hint for line, hint in before.items()}
    assert "from profile video" in hovered(
        editor, design, TEXT.replace("participants:", "x: [\nparticipants:"), "/image"
    )
    editor.tell("workspace/didChangeConfiguration", {"settings": {"cqos": {"hints": "stated"}}})
    assert editor.change(design, TEXT) == [("ROS101", 12, 28, 36)]
    assert hints()[7][1] == "depth 5 (from profile video), reliability best_effort (from profile video)"
    assert 8 not in hints()


# Other files


def test_configurations_and_packs_are_completed(editor, tmp_path):
    config, pack = tmp_path / "cqos.toml", tmp_path / "pack.yaml"
    config.write_text("")
    editor.open(config)
    assert {"protocol", "options", "packs", "severities"} <= completed(editor, config, "pro¦").keys()
    assert completed(editor, config, "fail_on = ¦")["error"]["textEdit"]["newText"] == '"error"'
    assert completed(editor, config, 'protocol = "¦"').keys() == {pack.id for pack in PACKS}
    for each in PACKS:
        options = {policy.name for policy in each.policies if policy.level == "option" and not policy.derived}
        assert completed(editor, config, f"[options.{each.id}]\n¦").keys() == options
    pack.write_text("cqos_pack: 1\n")
    editor.open(pack)
    assert {"policies", "rules", "presets", "title"} <= completed(editor, pack, "cqos_pack: 1\n¦").keys()
    assert {"duration", "choice"} <= completed(editor, pack, "cqos_pack: 1\npolicies:\n  a: {kind: ¦").keys()
    assert "because" in completed(editor, pack, "cqos_pack: 1\nrules:\n  - requires: x\n    ¦")


def test_a_protocol_that_only_a_yaml_pack_knows(editor, tmp_path):
    """The server names no protocol and no policy: everything comes from the pack that the configuration names."""
    opcua = (ROOT / "examples" / "opcua" / "opcua_pack.yaml").read_text(encoding="utf-8")
    pack, config, design = (tmp_path / name for name in ("opcua_pack.yaml", "cqos.toml", "line.yaml"))
    pack.write_text(opcua)
    config.write_text('packs = ["opcua_pack.yaml"]\n')
    text = (ROOT / "examples" / "opcua" / "press_line.yaml").read_text(encoding="utf-8")
    design.write_text(text)
    assert [each[0] for each in editor.open(design)] == ["OPC101"]
    words = completed(editor, design, text.replace("{profile: periodic, ", "{¦"))
    assert {"publishing_interval", "keep_alive_time", "encoding"} <= words.keys()
    assert "message_receive_timeout" not in words
    assert "durability" not in words
    assert completed(editor, design, text.replace("profile: periodic", "encoding: ¦")).keys() == {"uadp", "json"}
    assert {"periodic", "alarm"} <= completed(editor, design, text.replace("profile: periodic", "profile: ¦")).keys()
    editor.change(design, text)
    said = hovered(editor, design, text, "security_mode")
    assert "**security_mode** (OPC UA PubSub)" in said
    assert "clause: Part 14, 6.2.5.2" in said
    named = {policy.name for pack in PACKS for policy in pack.policies if "_" in policy.name}
    protocols = {*(pack.id for pack in PACKS), *named}
    for module in (ROOT / "plugins" / "editor" / "cqos_lsp").glob("*.py"):
        assert not protocols & set(re.findall(r"\w+", module.read_text(encoding="utf-8"))), module.name


XML = (ROOT / "examples" / "smart_agriculture_incompatible.bpmn").read_text(encoding="utf-8")


def test_other_formats_have_findings_hover_fixes_and_outline(editor, tmp_path):
    model = tmp_path / "model.bpmn"
    model.write_text(XML)
    found = editor.open(model, language="xml")
    assert {"ROS101", "ROS104", "BP101", "BP102"} == {each[0] for each in found}
    line = next(each[1] for each in found if each[0] == "ROS101")
    column = XML.splitlines()[line].index("reliability") + 2
    assert "**reliability** (ROS 2)" in editor.at(model, "hover", line, column)["contents"]["value"]
    outline = editor.ask("textDocument/documentSymbol", {"textDocument": {"uri": model.as_uri()}})
    assert sum(len(each.get("children") or []) or 1 for each in outline) >= 4
    fixes = editor.ask(
        "textDocument/codeAction",
        {"textDocument": {"uri": model.as_uri()}, "range": WHOLE, "context": {"diagnostics": []}},
    )
    fix = next(each for each in fixes if each["title"].startswith("ROS101"))
    changed = applied(XML, fix["edit"]["changes"][model.as_uri()])
    assert "ROS101" not in {each[0] for each in editor.change(model, changed)}
