"""Workspaces that attack or are broken end in a clear report, and nothing of them runs."""

from __future__ import annotations

import time

import pytest

from tests.command_process import run

MANIFEST = "<package><name>bot</name></package>"
TRAP = "import pathlib\npathlib.Path(__file__).with_suffix('.ran').write_text('ran')\n"
NODE = '<node pkg="bot" exec="talker" name="talker">{}</node>\n'
FACTS = "cqos_nodes: 1\npackage: bot\nnodes:\n  talker:\n    parameters: {topic: {default: chatter}}\n    publishes:\n      ${topic}: {type: std_msgs/msg/String}\n"
PARAMETERS = '<param from="$(find-pkg-share bot)/config/a.yaml"/>'


def launch(body):
    return {"bot/launch/a.launch.xml": f"<launch>\n{body}</launch>\n", "bot/bot.node.yaml": FACTS}


CASES = {
    "a cycle of includes": (launch('<include file="$(find-pkg-share bot)/launch/a.launch.xml"/>' + NODE.format("")), "include"),
    "a cycle of remaps": (launch(NODE.format('<remap from="chatter" to="b"/><remap from="b" to="chatter"/>')), "compatible|unknown"),
    "a parameter file that is no text": ({**launch(NODE.format(PARAMETERS)), "bot/config/a.yaml": b"\xff\xfe\x00talker: \xe9"}, "a.yaml"),
    "a parameter file with a syntax error": ({**launch(NODE.format(PARAMETERS)), "bot/config/a.yaml": b"talker: [\n"}, "a.yaml"),
    "a huge parameter file": ({**launch(NODE.format(PARAMETERS)), "bot/config/a.yaml": b"#" * 3_000_000}, "2 MiB"),
    "aliases that multiply": (
        {
            **launch(NODE.format(PARAMETERS)),
            "bot/config/a.yaml": b"".join(
                b"l%d: &l%d [%s]\n" % (n, n, b", ".join([b"*l%d" % (n - 1)] * 9) if n else b"x") for n in range(9)
            ) + b"talker: {ros__parameters: {topic: *l8}}\n",
        },
        "talker|note|unknown",
    ),
    "a launch file that is no text": ({"bot/launch/a.launch.py": b"\xff\xfe\x00"}, "a.launch.py"),
    "a launch file with a syntax error": ({"bot/launch/a.launch.py": b"def generate_launch_description(:\n"}, "a.launch.py"),
    "a launch file with a side effect": (
        {"bot/launch/a.launch.py": f"{TRAP}def generate_launch_description():\n    __import__('os').abort()\n".encode()},
        "a.launch.py|nothing",
    ),
    "a node file with a syntax error": ({**launch(NODE.format("")), "bot/bot.node.yaml": b"cqos_nodes: 1\nnodes: [\n"}, "bot.node.yaml"),
    "fragments in a circle": (
        {**launch(NODE.format("")), "bot/bot.node.yaml": b'cqos_nodes: 1\npackage: bot\nfragments: {"bot::A": {uses: ["bot::A"]}}\nnodes: {talker: {uses: ["bot::A"]}}\n'},
        "circle",
    ),
    "a node inside itself": (
        {**launch(NODE.format("")), "bot/bot.node.yaml": b"cqos_nodes: 1\npackage: bot\nnodes: {talker: {publishes: {a: {}}, inside: [{node: bot/talker, name: inner}]}}\n"},
        "nested too deep",
    ),
    "conditions in a circle": (
        {**launch(NODE.format("")), "bot/bot.node.yaml": b"cqos_nodes: 1\npackage: bot\nnodes: {talker: {parameters: {a: {default: x, when: {a: x}}}, publishes: {p: {when: {a: x}}}}}\n"},
        "circle",
    ),
    "wide holes": (
        {**launch(NODE.format("")), "bot/bot.node.yaml": b"cqos_nodes: 1\npackage: bot\nnodes: {talker: {parameters: {" + b", ".join(b'p%d: {default: "%s"}' % (at, b"${p%d}" % (at + 1) * 30) for at in range(8)) + b', p8: {default: x}}, publishes: {"${p0}": {}}}}\n'},
        "characters",
    ),
    "deep holes": (
        {**launch(NODE.format("")), "bot/bot.node.yaml": b'cqos_nodes: 1\npackage: bot\nnodes: {talker: {parameters: {a: {default: "' + b"${" * 3000 + b"a" + b"}" * 3000 + b'"}}, publishes: {"${a}": {}}}}\n'},
        "nested too deep",
    ),
    "wide fragments": (
        {**launch(NODE.format("")), "bot/bot.node.yaml": b'cqos_nodes: 1\npackage: bot\nfragments: {"bot::A": {uses: [' + b", ".join([b'"bot::A"'] * 30) + b']}}\nnodes: {talker: {uses: ["bot::A"]}}\n'},
        "circle|fragments",
    ),
    "many variables": (
        {**launch(NODE.format("")), "bot/bot.node.yaml": b"cqos_nodes: 1\npackage: bot\nnodes: {talker: {publishes: {a: {for_each: {" + b", ".join(b"v%d: [%s]" % (at, b", ".join(b"x%d" % n for n in range(100))) for at in range(5)) + b"}}}}}\n"},
        "combinations",
    ),
    "holes in a circle": (
        {**launch(NODE.format("")), "bot/bot.node.yaml": b'cqos_nodes: 1\npackage: bot\nnodes: {talker: {parameters: {a: {default: "${b}"}, b: {default: "${a}"}}, publishes: {"${a}": {}}}}\n'},
        "circle",
    ),
    "holes without an end": (
        {**launch(NODE.format("")), "bot/bot.node.yaml": b"cqos_nodes: 1\npackage: bot\nnodes: {talker: {publishes: {'" + b"${" * 500 + b"': {}}}}\n"},
        "not known|circle|not YAML",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_a_hostile_workspace_ends_in_a_report(tmp_path, name):
    files, expected = CASES[name]
    for path, content in {"bot/package.xml": MANIFEST, **files}.items():
        target = tmp_path / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content if isinstance(content, bytes) else content.encode())
    first = next(path for path in files if "/launch/" in path)
    start = time.process_time()
    done = run(["check", ".", "--launch", first, "--show", "notes", "--format", "concise"], tmp_path)
    assert time.process_time() - start < 5
    said = done.out + done.err
    assert done.code in {0, 1, 2}
    assert "Traceback" not in said
    assert any(word in said for word in expected.split("|")), said
    assert not list(tmp_path.rglob("*.ran"))


def test_links_out_of_the_workspace_are_not_read(tmp_path):
    outside = tmp_path / "secret.yaml"
    outside.write_text("talker: {ros__parameters: {topic: secret}}\n")
    root = tmp_path / "src"
    for path, content in {"bot/package.xml": MANIFEST, **launch(NODE.format(PARAMETERS))}.items():
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).write_text(content)
    (root / "bot" / "config").mkdir()
    (root / "bot" / "config" / "a.yaml").symlink_to(outside)
    (root / "bot" / "loop").symlink_to(root)
    done = run(["check", str(root), "--launch", "bot:a.launch.xml", "--show", "notes", "--format", "concise"], tmp_path)
    assert "a link out of the workspace" in done.out
    assert "secret" not in done.out.replace("secret.yaml", "")


def test_the_command_says_what_is_missing(tmp_path):
    (tmp_path / "bot").mkdir()
    (tmp_path / "bot" / "package.xml").write_text(MANIFEST)
    cases = (
        (["--launch", "bot:x.launch.py"], "has no launch file `x.launch.py`"),
        (["--launch", "bto:x.launch.py"], "did you mean `bot`"),
        (["--launch-arg", "a:=b"], "--launch-arg has no effect without --launch"),
        (["--launch", "bot:x.launch.py", "--launch-arg", "a"], "is no launch argument"),
    )
    for more, words in cases:
        done = run(["check", ".", *more], tmp_path)
        assert done.code == 2
        assert words in done.err, done.err


def test_fixing_leaves_a_workspace_as_it_is(tmp_path):
    for path, content in {"bot/package.xml": MANIFEST, **launch(NODE.format('<remap from="chater" to="x"/>'))}.items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(content)
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    done = run(["check", ".", "--launch", "bot:a.launch.xml", "--fix"], tmp_path)
    assert "Traceback" not in done.err, done.err
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


@pytest.mark.parametrize("command", [["check", ".", "--launch"], ["why", ".", "/a", "--launch"]])
@pytest.mark.parametrize(
    ("name", "content"),
    [("a.launch.py", b"def (:\n"), ("a.launch.xml", b"<launch>\xff</launch>"), ("a.launch.xml", b"<lau")],
)
def test_a_launch_file_that_cannot_be_read_is_an_error(tmp_path, command, name, content):
    (tmp_path / "package.xml").write_text(MANIFEST)
    (tmp_path / name).write_bytes(content)
    done = run([*command, name], tmp_path)
    assert (done.code, name in done.err) == (2, True), done.out + done.err


def test_a_launch_file_that_is_not_read_gives_few_errors(tmp_path):
    path = tmp_path / "bot" / "launch" / "a.launch.py"
    path.parent.mkdir(parents=True)
    (tmp_path / "bot" / "package.xml").write_text(MANIFEST)
    body = "def generate_launch_description():\n    return LaunchDescription([" + "a(), " * 1000 + "])\n"
    path.write_text("from launch import LaunchDescription\n" + body)
    done = run(["check", ".", "--launch", "bot:a.launch.py"], tmp_path)
    assert done.code == 2
    assert done.err.count("error[CQ047]") == 21
    assert "more parts of this file are not read" in done.err


def test_packages_that_are_passed_over_are_named(tmp_path):
    files = {
        "bot/package.xml": MANIFEST,
        **launch(NODE.format("")),
        "copy/package.xml": MANIFEST,
        "broken/package.xml": "<package>",
        "other/package.xml": "<package><name>../x</name></package>",
    }
    for path, content in files.items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(content)
    for command in (["check", ".", "--launch", "bot:a.launch.xml", "--show", "notes"], ["launch", "bot:a.launch.xml"]):
        done = run(command, tmp_path)
        assert "another package `bot`, which is passed over" in done.out
        assert "broken/package.xml" in done.out
        assert "`../x` is no name of a package" in done.out


def test_many_nodes_of_one_kind_are_read_soon(tmp_path):
    facts = (
        "cqos_nodes: 1\npackage: bot\nnodes:\n  talker:\n    unread: [{what: more, cause: unknown}]\n    publishes:\n"
    )
    facts += "".join(f"      topic{n}: {{type: std_msgs/msg/String}}\n" for n in range(12))
    nodes = "".join(f'<node pkg="bot" exec="talker" name="n{n}"/>\n' for n in range(4000))
    files = {
        "bot/package.xml": MANIFEST,
        "bot/bot.node.yaml": facts,
        "bot/launch/a.launch.xml": f"<launch>{nodes}</launch>",
    }
    for path, content in files.items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(content)
    start = time.process_time()
    done = run(["check", ".", "--launch", "bot:a.launch.xml"], tmp_path)
    assert time.process_time() - start < 8
    assert "48000 endpoints read" in done.out
