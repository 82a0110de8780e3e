"""How people see the settings of packs, and what a drawing can state for them."""

from __future__ import annotations

import pytest

from cqos_core.model.problems import InputError
from cqos_core.model.source import Source
from cqos_core.packs.moddle import drawing_settings, moddle
from cqos_core.packs.pack_yaml import read_pack
from cqos_core.packs.property_panel import describe_panel, headings, values_of
from cqos_core.plugins import load_plugins, named

OURS = ("dds", "mqtt", "ros2")
FORM = named(load_plugins().importers["bpmn"].drawn)
STRANGER = """
cqos_pack: 1
id: beacon
title: Beacon
policies:
  delivery: {kind: choice, values: [fire_and_forget, confirmed], default: fire_and_forget}
  alarm_after.first: {kind: duration, default: infinite, roles: [subscriber], words: {odd: {unknown: a secret}}}
  loud: {kind: flag, default: false}
  channel: {kind: count, level: participant, default: 1}
rules: []
"""


def pack_of(text):
    return read_pack(Source("beacon.yaml", text.encode()))


def installed(name):
    pack = load_plugins().pack(name)
    assert pack is not None
    return pack


@pytest.fixture(params=OURS)
def pack(request):
    return installed(request.param)


def test_a_pack_that_says_nothing_of_it_has_a_panel():
    beacon = pack_of(STRANGER)
    seen = {policy.name: describe_panel(beacon.panel, policy) for policy in beacon.policies}
    assert seen["delivery"] == {
        "label": "Delivery",
        "group": "Quality of service",
        "advanced": False,
        "value_docs": [
            {"value": "fire_and_forget", "label": "Fire and forget", "doc": ""},
            {"value": "confirmed", "label": "Confirmed", "doc": ""},
        ],
    }
    assert seen["alarm_after.first"]["label"] == "Alarm after first"
    assert [each["label"] for each in seen["loud"]["value_docs"]] == ["No", "Yes"]
    assert headings(beacon.panel, beacon.policies) == ["Quality of service", "Participant"]
    written = {each.policy.name: each for each in drawing_settings(beacon, FORM)}
    assert list(written) == ["channel", "delivery", "alarm_after.first", "loud"]
    assert (written["alarm_after.first"].words, written["alarm_after.first"].roles) == ((), ("subscriber",))


@pytest.mark.parametrize(
    ("panel", "said"),
    [
        ("{groups: {A: [delivry]}}", "names `delivry`, which is no policy"),
        ("{groups: {A: [delivery], B: [delivery]}}", "`delivery` stands in several groups"),
        ("{advanced: [delivry]}", "names `delivry`, which is no policy"),
        ("{values: {delivery: {certain: Surely.}}}", "`certain` is no value of `delivery`"),
        ("{value_labels: {delivery: {certain: Surely}}}", "`certain` is no value of `delivery`"),
        ("{roles: {delivry: [publisher]}}", "names `delivry`, which is no policy"),
    ],
)
def test_a_panel_that_names_what_is_not_there_is_refused(panel, said):
    with pytest.raises(InputError, match=said):
        pack_of(f"{STRANGER}panel: {panel}\n")


@pytest.mark.parametrize(
    ("dialect", "said"),
    [
        ("{writes: {delivry: d}}", "`writes` names `delivry`, which is no policy"),
        ("{writes: {delivery: d}}", "`delivery` is written as `d`, which is not read as it"),
        ("{words: [even]}", "`words` names `even`, which no policy has"),
    ],
)
def test_a_dialect_that_writes_what_is_not_read_is_refused(dialect, said):
    with pytest.raises(InputError, match=said):
        pack_of(f"{STRANGER}dialects: {{bpmn: {dialect}}}\n")


def test_every_setting_of_ours_that_can_be_drawn_has_a_place_and_every_value_a_sentence(pack):
    grouped = {name for names in pack.panel.groups.values() for name in names}
    for each in drawing_settings(pack, FORM):
        assert each.policy.name in grouped, each
        if each.policy.domain.kind == "choice" and each.policy.level == "endpoint":
            docs = {value["value"]: value["doc"] for value in describe_panel(pack.panel, each.policy)["value_docs"]}
            assert all(
                docs[value] for value in values_of(each.policy) if value not in set(each.policy.words) - set(each.words)
            )


def test_sentences_are_sentences(pack):
    for values in pack.panel.values.values():
        for text in values.values():
            assert text[0].isupper()
            assert text.endswith(".")


def test_words_of_tools_have_no_place_in_a_drawing(pack):
    words = {word for each in drawing_settings(pack, FORM) for word in each.words}
    assert not words & {"from_publishers", "from_subscribers", "from_first", "unknown"}


def test_what_is_drawn_is_read_as_the_same_policy(pack):
    for each in drawing_settings(pack, FORM):
        index = pack.find(each.policy.level, each.name, pack.dialects["bpmn"])
        assert index is not None
        assert pack.policies[index] is each.policy


def test_the_paper_has_its_attributes():
    names = {each.name for each in drawing_settings(installed("ros2"), FORM) if each.policy.level == "endpoint"}
    assert names >= {
        *("history", "depth", "reliability", "durability"),
        *("deadline", "lifespan", "liveliness", "leaseDuration"),
    }


def test_only_publishers_are_asked_for_a_lifespan():
    written = {each.policy.name: each for each in drawing_settings(installed("ros2"), FORM)}
    assert written["lifespan"].roles == ("publisher",)


def test_the_descriptor_has_every_word_and_setting():
    packs = [installed(name) for name in OURS]
    descriptor = moddle(FORM, packs)
    types = {each["name"]: {prop["name"] for prop in each["properties"]} for each in descriptor["types"]}
    assert (descriptor["prefix"], descriptor["uri"]) == ("qos", "http://qos")
    for owner in FORM.owners:
        attributes = types[f"{owner.kind.capitalize()}Words"]
        assert attributes >= set(owner.attributes)
        for word in owner.words:
            if word.element:
                assert types[word.name.capitalize()] >= {each.name for each in word.attributes}
    for pack in packs:
        for each in drawing_settings(pack, FORM):
            owner = next(owner for owner in FORM.owners if each.policy.level in owner.levels)
            assert each.name in types[f"{owner.kind.capitalize()}Words"]
    assert types["Policy"] >= {"reliability", "leaseDuration", "type", "value"}
