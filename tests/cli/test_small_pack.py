"""What people see of a pack of three policies: a text that may be empty, a fact, and one with a default."""

from __future__ import annotations

import pytest

from tests.command_process import run

PACK = """
cqos_pack: 1
id: links
title: Links
policies:
  link_name: {kind: text, default: "", doc: The name of the link.}
  window: {kind: count, doc: How much is under way.}
  durable: {kind: flag, default: false, stronger: higher, doc: Whether messages are stored.}
rules:
  - {code: LNK101, name: names-differ, requires: offered(link_name) == requested(link_name), because: b, clause: c}
  - {code: LNK102, name: window-small, requires: offered(window) >= requested(window), because: b, clause: c}
"""
SYSTEM = "cqos: 1\nprotocol: links\nparticipants:\n  a: {publishes: {t: {}}}\n  b: {subscribes: {t: {}}}\n"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "pack.yaml").write_text(PACK, encoding="utf-8")
    (tmp_path / "system.yaml").write_text(SYSTEM, encoding="utf-8")
    return tmp_path


def test_an_empty_default_is_shown_as_an_empty_text(folder):
    listed = run(["packs", "links", "--pack", "pack.yaml"], folder).out
    assert 'default ""\n' in listed
    explained = run(["explain", "system.yaml", "a", "b", "--pack", "pack.yaml", "--show", "all"], folder).out
    assert '"" (default)' in explained


def test_a_fact_that_nothing_states_is_no_default(folder):
    explained = run(["explain", "system.yaml", "a", "b", "--pack", "pack.yaml", "--show", "all"], folder).out
    assert "requested here: unknown (not stated)" in explained
    assert "unknown (default)" not in explained


def test_policies_of_a_pack_are_its_own_and_requirements_of_all_packs_are_apart(folder):
    assert "Requirements" not in run(["packs", "links", "--pack", "pack.yaml"], folder).out
    own, _, shared = run(["packs", "ros2"], folder).out.partition("\nRequirements, the same in all packs")
    assert "loss_free" not in own.partition("\nRules")[0]
    assert "  loss_free" in shared
