"""Hostile files end with a clear report, soon, and nothing of them is executed."""

from __future__ import annotations

import time

import pytest

from cqos_ros2_workspace.launch.workspace import find_packages

HEAD = "from launch import LaunchDescription\nfrom launch_ros.actions import Node\n"
FUNCTION = "def generate_launch_description():\n"


def causes(found):
    return [each.cause for each in found.remarks]


def test_nothing_is_executed(launched, tmp_path):
    mark = tmp_path / "executed"
    body = f"open({str(mark)!r}, 'w').write('x')\nimport os\nos.system('touch {mark}')\nexec('open({str(mark)!r})')\n"
    found = launched({"a/a.launch.py": HEAD + body + FUNCTION + "    return LaunchDescription([])\n"})
    assert not found.instances
    assert not mark.exists()


def test_a_circle_of_includes_ends(launched):
    found = launched(
        {
            "a/a.launch.xml": '<launch><include file="$(dirname)/b.launch.xml"/></launch>',
            "a/b.launch.xml": '<launch><node pkg="p" exec="e"/><include file="$(dirname)/a.launch.xml"/></launch>',
        }
    )
    assert len(found.instances) == 1
    assert causes(found) == ["it includes itself, which is not followed"]


def test_includes_end_at_a_depth(launched):
    files = {
        f"a/{n}.launch.xml": f'<launch><include file="$(dirname)/{n + 1}.launch.xml"/></launch>' for n in range(40)
    }
    assert causes(launched(files)) == ["there are too many includes: limit 25 deep and 2000 in all"]


@pytest.mark.parametrize(
    ("content", "cause"),
    [
        (b"def f(:\n", "this is not Python"),
        (b"x = '\xff\xfe'\n", "this is not Python"),
        (b"\0", "this is not Python"),
        (b"", "it has no function `generate_launch_description`"),
        (("x = " + "(" * 300 + ")" * 300).encode(), "this is not Python"),
        (b"#" * 3_000_000, "the file has more than 2 MiB"),
        (HEAD.encode() + b"def generate_launch_description():\n    return " + b"-" * 3000 + b"1\n", "is"),
    ],
)
def test_files_that_are_no_launch_files(launched, content, cause):
    (found,) = causes(launched({"a/a.launch.py": content}))
    assert cause in found


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.launch.xml", b"<launch>"),
        ("a.launch.xml", b"<robot/>"),
        ("a.launch.xml", b'<!DOCTYPE x [<!ENTITY y SYSTEM "file:///etc/passwd">]><launch>&y;</launch>'),
        ("a.launch.xml", b"<launch>" + b"<group>" * 200 + b"</group>" * 200 + b"</launch>"),
        ("a.launch.yaml", b"launch: [node: {pkg: [}"),
        ("a.launch.yaml", b"nodes: []"),
        ("a.launch.yaml", b"\xff\xfe\x00"),
        ("a.launch.yaml", b""),
        ("a.launch.xml", b'<launch><node pkg="$(find-pkg-share $(var $(var" exec="e"/></launch>'),
        ("a.launch.xml", b'<launch><arg name="x" default="' + b"$(var y " * 500 + b'"/></launch>'),
    ],
)
def test_markup_that_is_no_launch_file(launched, name, content):
    found = launched({f"a/{name}": content})
    assert found.remarks or found.instances or found.arguments


@pytest.mark.parametrize(
    "body",
    [
        "    x = [1]\n" + "    x = x + x\n" * 60,
        "    x = [1]\n" + "    x = [x, x]\n" * 100 + "    y = x == [x]\n",
        "    x = 'a'\n" + "    x = x + x\n" * 60,
        "    x = ('a',)\n" + "    x = (x, x)\n" * 60 + "    y = {x: 1}\n",
        "    for i in range(1000):\n        for j in range(1000):\n            for k in range(1000):\n                pass\n",
        "    def f(n):\n        return f(n - 1) + f(n - 2)\n    x = f(100)\n",
        "    x = 'a'.replace('a', 'b' * 5000)\n" + "    x = x.replace('b', x)\n" * 10,
        "    x = 10 ** 10 ** 10\n    y = 1 << 10 ** 10\n    z = '%1000000000d' % 1\n",
        "    x = [[[i for i in range(9999)] for j in range(9999)] for k in range(9999)]\n",
        "".join(f"    x{n} = 'a' if os.environ['V{n}'] == '1' else 'b'\n" for n in range(30))
        + f"    y = {' + '.join(f'x{n}' for n in range(30))}\n",
        "    x = " + " + ".join(["'a'"] * 20_000) + "\n",
        "    x = " + "[" * 90 + "]" * 90 + "\n",
    ],
)
def test_work_is_bounded(launched, body):
    text = (
        HEAD + "import os\n" + FUNCTION + body + "    return LaunchDescription([Node(package='p', executable='e')])\n"
    )
    started = time.process_time()
    found = launched({"a/a.launch.py": text})
    assert time.process_time() - started < 5
    assert found.instances or found.remarks


def test_links_out_of_the_workspace_are_not_read(launched, tmp_path):
    secret = tmp_path / "secret.launch.xml"
    secret.write_text('<launch><node pkg="secret" exec="e"/></launch>')
    folder = tmp_path / "src" / "a"
    folder.mkdir(parents=True)
    (folder / "link.launch.xml").symlink_to(secret)
    entry = (
        '<launch><include file="$(find-pkg-share a)/link.launch.xml"/><include file="$(dirname)/link.launch.xml"/>'
        f'<include file="{secret}"/><include file="$(find-pkg-share a)/../../secret.launch.xml"/>'
        '<include file="secret.launch.xml"/></launch>'
    )
    found = launched({"a/a.launch.xml": entry})
    assert not found.instances
    assert len(found.remarks) == 5


def test_many_nodes_end_at_a_limit(launched):
    nodes = '<node pkg="p" exec="e"/>' * 6000
    found = launched({"a/a.launch.xml": f"<launch>{nodes}</launch>"})
    assert len(found.instances) == 5000
    assert "more than 5000 nodes" in found.remarks[0].cause


@pytest.mark.parametrize("name", ["../../evil", "/evil", "a/b", "..", "a\nb", ""])
def test_a_name_that_no_package_may_have_names_none(tmp_path, name):
    # `cqos learn` names a file by its package.
    folder = tmp_path / "a"
    folder.mkdir()
    (folder / "package.xml").write_text(f"<package><name>{name}</name></package>")
    found = find_packages(str(tmp_path))
    assert not found.packages
    assert len(found.unreadable) == 1
