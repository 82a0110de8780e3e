"""What was learned is kept, and holds only for the same sources."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from cqos_ros2_sources.node_files import node_file_maker
from cqos_ros2_sources.programs import packages

CODE = "import rclpy\nfrom std_msgs.msg import String\ndef main():\n    node = rclpy.create_node('n')\n    node.create_publisher(String, 'a', 3)\n"
FILES = {
    "setup.py": "setup(entry_points={'console_scripts': ['driver = bot.driver:main']})\n",
    "bot/driver.py": CODE,
}


@pytest.fixture
def reads(monkeypatch):
    """Return the packages that were read, one after the other."""
    found: list[str] = []

    def reading(name, *rest):
        found.append(name)
        return packages.read_package(name, *rest)

    monkeypatch.setattr(node_file_maker, "read_package", reading)
    return found


def kept() -> list[Path]:
    return [*Path(os.environ["XDG_CACHE_HOME"], "cqos", "learned").iterdir()]


def test_the_same_sources_are_read_once(learned, reads):
    assert learned(FILES).document == learned(FILES).document
    assert reads == ["bot"]
    assert len(kept()) == 1


def test_other_sources_are_read(learned, reads):
    learned(FILES)
    found = learned({**FILES, "bot/driver.py": CODE.replace("'a'", "'b'")}).document
    assert "b" in found["nodes"]["driver"]["publishes"]
    assert reads == ["bot", "bot"]


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b'{"key": 1}', b"[" * 100_000, b"\xff"])
def test_a_damaged_file_is_no_harm(learned, reads, content):
    first = learned(FILES).document
    kept()[0].write_bytes(content)
    assert learned(FILES).document == first
    assert reads == ["bot", "bot"]


def test_a_folder_that_cannot_be_written_is_no_harm(learned, monkeypatch, tmp_path):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert learned(FILES).document["nodes"]
