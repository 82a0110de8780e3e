"""From text to values: which layer wins, where each value comes from, and the findings about unreadable values."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from typing import TYPE_CHECKING, Any

import pytest

from cqos_core import (
    Broker,
    Cases,
    Endpoint,
    Fact,
    Participant,
    Place,
    Profile,
    ProfileRef,
    Setting,
    System,
    Topic,
    check,
    check_pair,
)
from cqos_core.model.settings import EVERY_OTHER
from cqos_core.model.suggestions import suggestion
from cqos_core.packs import Choice, Count, Flag, Policy, RulePack, Text, by_option, forbids, parse, requires, stated
from tests.made_up_protocol import (
    CARRIER,
    DELAY,
    POLICIES,
    POST,
    box,
    checked,
    codes,
    facts,
    only,
    participant,
    place,
    profile,
    reader,
    settings,
    world,
    writer,
)

if TYPE_CHECKING:
    from cqos_core import Finding

Facts = dict[str, Fact]


def first(*parts: Any, **fields: Any) -> Facts:
    """The values of the first endpoint, as `explain` prints them."""
    return facts(*parts, **fields)


def every(*parts: Any, **fields: Any) -> list[Facts]:
    """The values of each endpoint."""
    system = world(*parts, **fields)
    return [facts(system, of=each.id) for each in system.endpoints]


def text(endpoint: Facts, name: str) -> str:
    return endpoint[name].value


def origin(endpoint: Facts, name: str) -> str:
    return endpoint[name].origin


def findings(*parts: Any, **fields: Any) -> list[Finding]:
    """What is wrong with what is stated."""
    return [each for each in checked(*parts, **fields).findings if each.code.startswith("CQ2")]


# What wins

# Nearest first: each layer gives another number of copies, so the value tells which one won.
LAYERS = {
    "overlay": ("1", "overlay"),
    "explicit": ("2", "explicit"),
    "near profile": ("3", "profile near"),
    "base of the near profile": ("4", "profile base"),
    "far profile": ("5", "profile far"),
    "preset": ("20", "preset standard"),
}


def with_layers(names: tuple[str, ...]) -> Facts:
    stated = {name: {"copies": LAYERS[name][0]} if name in names else {} for name in LAYERS}
    return first(
        profile("base", **stated["base of the near profile"]),
        profile("near", "base", **stated["near profile"]),
        profile("far", **stated["far profile"]),
        # The last profile named is the nearest.
        writer("box", "w", "far", "near", more={"overlay": settings(**stated["overlay"])}, **stated["explicit"]),
    )


@pytest.mark.parametrize("number", range(len(LAYERS)))
def test_nearer_layers_win(number):
    """Every choice of layers: the nearest of them is the one that holds."""
    for names in combinations(tuple(LAYERS)[:-1], number):
        endpoint = with_layers(names)
        nearest = next(name for name in LAYERS if name in names or name == "preset")
        assert (text(endpoint, "copies"), origin(endpoint, "copies")) == LAYERS[nearest], names


def test_an_unstated_policy_has_its_default():
    endpoint = first(writer("box"))
    assert (text(endpoint, "delay"), origin(endpoint, "delay")) == ("infinite", "default")
    assert (text(endpoint, "copies"), origin(endpoint, "copies")) == ("20", "preset standard")


def test_a_preset_by_name_is_a_layer_like_a_profile():
    endpoint = first(writer("box", "w", "careful", copies="3"))
    assert {name: (text(endpoint, name), origin(endpoint, name)) for name in ("care", "sealed", "copies", "delay")} == {
        "care": ("insured", "preset careful"),
        "sealed": ("true", "preset careful"),
        "copies": ("3", "explicit"),
        "delay": ("infinite", "default"),
    }
    assert text(first(writer("box", "w", "Value")), "care") == "insured"


def test_values_have_the_place_where_they_were_stated():
    stated = Endpoint(
        id="w",
        role="publisher",
        topic="box",
        participant="w",
        settings={"care": Setting("signed", place(3, 5))},
        profiles=(ProfileRef("p"),),
        place=place(2),
    )
    endpoint = first(stated, replace_places(profile("p", delay="1s"), place(7)))
    assert (origin(endpoint, "care"), endpoint["care"].place) == ("explicit", place(3, 5))
    assert (origin(endpoint, "delay"), endpoint["delay"].place) == ("profile p", place(7))
    assert (origin(endpoint, "sealed"), endpoint["sealed"].place) == ("default", place(2))


def replace_places(made: Profile, where: Place) -> Profile:
    return replace(made, settings={name: Setting(each.text, where) for name, each in made.settings.items()})


def test_equal_settings_are_one_profile_and_keep_their_own_places():
    def at(name: str, line: int) -> Endpoint:
        return replace(writer("box", name), settings={"care": Setting("signed", place(line))}, place=place(line))

    one, other = every(at("a", 1), at("b", 9))
    assert (one["care"].place, other["care"].place) == (place(1), place(9))


# Spellings


def test_names_are_read_in_every_spelling():
    assert text(first(writer("box", Treatment="CARE_SIGNED")), "care") == "signed"
    assert text(first(writer("box", DELAY="PT2S")), "delay") == "2s"


def test_a_dialect_has_its_own_names_codes_and_units():
    form = {"dialect": "form"}
    endpoint = first(writer("box", more=form, Sorgfalt="2", delay="1.5", copies="0", Colour="red"))
    assert text(endpoint, "care") == "signed"
    assert text(endpoint, "delay") == "1500ms"
    assert (text(endpoint, "copies"), origin(endpoint, "copies")) == ("20", "preset standard")
    assert not findings(writer("box", more=form, Colour="red", delay="0.0"))


def test_the_units_of_a_dialect_are_for_what_is_written_in_it():
    """A profile is read in the dialect of the endpoint that uses it; defaults and presets are the pack's."""
    parts = [profile("p", delay="2"), writer("box", "w", "p", more={"dialect": "form"}), reader("box", "r", "p")]
    assert text(first(*parts), "delay") == "2s"
    assert [finding.code for finding in findings(*parts)] == ["CQ203"]


def test_an_unknown_dialect_is_read_like_yaml():
    assert text(first(writer("box", more={"dialect": "stone"}, delay="2s")), "delay") == "2s"


def test_a_map_states_the_fields_of_a_policy():
    """Where a policy has several fields they may be written as one map."""
    pack = RulePack("p", "P", (Policy("limits.most", Count(), "1"), Policy("limits.hard", Flag(), "false")), ())
    report = check_pair("p", {"limits": "{most: 5, hard: true}"}, packs=[pack])
    assert [(each.policy, each.offered.value, each.offered.origin) for each in report.policies if each.offered] == [
        ("limits.most", "5", "explicit"),
        ("limits.hard", "true", "explicit"),
    ]


# Options


def test_a_participant_has_the_options_of_the_system_unless_it_states_its_own():
    parts = [writer("box", "a/w", care="usual"), writer("box", "b/w", care="usual"), participant("b", CARRIER="ship")]
    assert [text(each, "care") for each in every(*parts, options={"carrier": "bike"})] == ["plain", "insured"]


def test_an_unset_option_takes_the_assumption_of_the_pack():
    usual = "usual (plain with bike; signed with train; insured with ship)"
    assert text(first(writer("box", care="usual")), "care") == usual
    report = checked(writer("box", care="usual"), reader("box", care="signed"))
    assert [(each.option, each.values) for each in report.assumed] == [("post.carrier", ("bike", "train", "ship"))]


@pytest.mark.parametrize(
    ("carrier", "care"), [("bike", "plain"), ("train", "signed"), ("ship", "insured"), ("pigeon", "insured")]
)
def test_a_word_may_mean_another_value_under_each_option(carrier, care):
    assert text(first(writer("box", care="usual"), options={"carrier": carrier}), "care") == care


def test_a_word_that_makes_no_difference_depends_on_nothing():
    care = Policy("care", Choice("plain", "signed"), "plain", words={"usual": by_option("carrier", otherwise="signed")})
    pack = replace(POST, policies=(care, CARRIER), rules=(), presets={}, base_preset=None, conventions=(), dialects={})
    assert text(facts(writer("box", care="usual"), packs=[pack]), "care") == "signed"


def test_a_policy_that_the_carrier_ignores_has_its_default_and_saying_it_is_a_warning():
    pair = [writer("box", delay="1s"), reader("box")]
    ends = every(*pair, options={"carrier": "pigeon"})
    assert [text(endpoint, "delay") for endpoint in ends] == ["infinite", "infinite"]
    assert origin(ends[0], "delay") == "ignored by the middleware"
    (finding,) = findings(*pair, options={"carrier": "pigeon"})
    assert (finding.code, finding.severity) == ("CQ205", "warning")
    assert finding.message == "publisher `writer` states `delay`, which carrier pigeon ignores"
    assert not findings(writer("box", delay="1s"), options={"carrier": "ship"})
    assert not findings(writer("box", delay="infinite"), options={"carrier": "pigeon"})


def test_a_policy_that_never_stops_a_match_keeps_its_value_and_its_rules_are_not_asked():
    pair = [writer("box", sealed="false"), reader("box", sealed="true")]
    assert codes(checked(*pair, options={"carrier": "bike"})) == ["POST103"]
    assert codes(checked(*pair, options={"carrier": "pigeon"})) == []
    assert text(every(*pair, options={"carrier": "pigeon"})[1], "sealed") == "true"
    # Pigeons on one side are enough.
    assert codes(checked(*pair, participant("writer", carrier="pigeon"), options={"carrier": "bike"})) == []


def test_a_zero_may_stand_for_a_word():
    assert text(first(writer("box", delay="0s")), "delay") == "infinite"
    assert text(first(writer("box", delay="Unspecified")), "delay") == "infinite"


def test_a_word_may_depend_on_the_role():
    ends = every(writer("box", care="best"), reader("box", care="best"))
    assert [(text(each, "care"), origin(each, "care")) for each in ends] == [
        ("insured", "explicit"),
        ("insured", "settled from best"),
    ]


# Observed endpoints


def test_nothing_is_filled_in_for_what_was_not_observed():
    seen = writer("box", more={"observed": True}, care="signed")
    assert text(first(seen), "care") == "signed"
    report = checked(seen, reader("box", delay="1s"))
    assert report.verdict == "unknown"
    assert "discovery did not report delay" in only(report, "POST102").message


def test_what_the_carrier_ignores_is_known_even_of_observed_endpoints():
    seen = writer("box", more={"observed": True})
    assert text(first(seen, options={"carrier": "pigeon"}), "delay") == "infinite"


# Topics


def test_facts_of_a_topic_hold_for_everybody_on_it_and_win_over_conventions():
    parts = [writer("a/urgent"), reader("b/urgent"), box("b/urgent", urgent="false")]
    one, other = every(*parts)
    assert (text(one, "urgent"), origin(one, "urgent")) == ("true", "convention of */urgent")
    assert (text(other, "urgent"), origin(other, "urgent")) == ("false", "topic")


def test_a_topic_entry_may_be_for_one_protocol_only():
    entry = replace(box("t", urgent="true"), protocol="other")
    assert "urgent" not in first(writer("t"), entry)
    assert text(first(writer("t"), replace(entry, protocol="post")), "urgent") == "true"


# What is wrong, and where

WRONG: dict[str, tuple[list[Any], dict[str, Any], str, str, str | None]] = {
    "unknown setting": (
        [writer("box", car="signed")],
        {},
        "CQ202",
        "publisher `writer` states `car`, which Post does not know",
        "did you mean `care`? known: care, copies, delay, returned, sealed, stamp, streets",
    ),
    "unknown setting of a profile": (
        [profile("p", colour="red"), writer("box", "w", "p")],
        {},
        "CQ202",
        "profile `p` states `colour`, which Post does not know",
        "known: care, copies",
    ),
    "unknown setting of a participant": (
        [writer("box", "w"), participant("w", carier="ship")],
        {},
        "CQ202",
        "participant `w` states `carier`, which Post does not know",
        "did you mean `carrier`?",
    ),
    "unknown fact of a topic": (
        [writer("t"), box("t", care="plain")],
        {},
        "CQ202",
        "topic `t` states `care`",
        "write it at each endpoint, `TOPIC: {care: plain}`, or in a profile that endpoints use",
    ),
    "unknown option": (
        [writer("t")],
        {"options": {"vehicle": "x"}},
        "CQ202",
        "options of `post` states `vehicle`",
        "known:",
    ),
    "no value": (
        [writer("box", care="express")],
        {},
        "CQ203",
        "publisher `writer`: `care` `express` is not one of its values",
        "expected plain < signed < insured, or usual, best, unknown",
    ),
    "no unit": (
        [reader("box", delay="5")],
        {},
        "CQ203",
        "subscriber `reader`: `delay` `5` has no unit",
        "expected a unit after it",
    ),
    "no value in an overlay": (
        [writer("box", more={"overlay": settings(copies="101")})],
        {},
        "CQ203",
        "`copies` `101` is out of range",
        "expected a whole number from 1 to 100, or all",
    ),
    "no value of an option": (
        [writer("t")],
        {"options": {"carrier": "plane"}},
        "CQ203",
        "option `carrier`: `plane`",
        "expected bike",
    ),
    "an option of tomorrow": (
        [writer("t")],
        {"options": {"year": "y2030"}},
        "CQ208",
        "option `year`: `y2030` is not one of its values; `y2010` stands in",
        "expected y1990 < y2000 < y2010",
    ),
    "unknown profile": (
        [writer("box", "w", "carefull")],
        {},
        "CQ204",
        "profile `carefull` is neither defined nor a preset of Post",
        "did you mean `careful`? known: as_usual, careful, modern, standard",
    ),
    "a type for a profile": (
        [writer("box", "w", "mail/Letter")],
        {},
        "CQ204",
        "profile `mail/Letter` is neither defined",
        "a type is written `{type: mail/Letter}`; known: as_usual",
    ),
    "unknown base": (
        [profile("p", "q"), writer("box", "w", "p")],
        {},
        "CQ204",
        "profile `q` is neither defined",
        "known: as_usual",
    ),
    "a preset of tomorrow": (
        [writer("box", "w", "modern")],
        {"options": {"year": "y1990"}},
        "CQ207",
        "preset `modern` exists from year y2000 on, this participant has year y1990",
        None,
    ),
    "a profile with the name of a preset": (
        [profile("Careful", care="plain", sealed="True"), writer("box", "w", "Careful")],
        {},
        "CQ206",
        "profile `Careful` has the name of a Post preset but other values of care",
        None,
    ),
    "stated twice": (
        [writer("box", care="plain", treatment="signed")],
        {},
        "CQ209",
        "publisher `writer` states `care` twice, as plain and as signed",
        None,
    ),
    "of the other role": (
        [reader("box", returned="true")],
        {},
        "CQ210",
        "subscriber `reader` states `returned`, which only a publisher has",
        None,
    ),
    "no pack": (
        [writer("box")],
        {"protocol": "pigeon_post"},
        "CQ201",
        "no installed pack judges protocol `pigeon_post`",
        None,
    ),
    "no protocol": (
        [writer("box")],
        {"protocol": None},
        "CQ201",
        "no protocol is stated for 1 endpoint,",
        "state `protocol:` in the file",
    ),
    "needs": (
        [reader("box", more={"needs": settings(latest="true")})],
        {},
        "CQ211",
        "no installed pack judges `needs`",
        None,
    ),
}


@pytest.mark.parametrize(("parts", "fields", "code", "message", "help_text"), WRONG.values(), ids=WRONG)
def test_what_is_wrong_is_one_finding_that_says_what_is_allowed(parts, fields, code, message, help_text):
    (finding,) = findings(*parts, **fields)
    assert finding.code == code
    assert message in finding.message
    if help_text is not None:
        assert help_text in (finding.help or "")


RIGHT: dict[str, tuple[list[Any], dict[str, Any]]] = {
    "a known option": ([writer("t")], {"options": {"year": "y2010", "carrier": "bike"}}),
    "a preset that is there": ([writer("box", "w", "modern")], {"options": {"year": "y2000"}}),
    "a preset where nothing is known": ([writer("box", "w", "modern")], {}),
    "a profile with the values of its preset": (
        [profile("careful", care="Insured", copies="3"), writer("box", "w", "careful")],
        {},
    ),
    "the same twice": ([writer("box", care="plain", treatment="plain")], {}),
    "of its role": ([writer("box", returned="true")], {}),
}


@pytest.mark.parametrize(("parts", "fields"), RIGHT.values(), ids=RIGHT)
def test_what_is_right_is_no_finding(parts, fields):
    assert findings(*parts, **fields) == []


def test_an_invalid_profile_is_reported_once_for_all_its_endpoints():
    many = [writer("box", f"w{number}", "p") for number in range(50)]
    assert [finding.code for finding in findings(profile("p", colour="red"), *many)] == ["CQ202"]
    assert [finding.code for finding in findings(*many)] == ["CQ204"]


def test_an_invalid_fact_of_a_topic_is_reported_once_for_all_its_endpoints():
    many = [writer("t", f"w{number}") for number in range(50)] + [reader("t", f"r{number}") for number in range(50)]
    assert [finding.code for finding in findings(box("t", interval="5"), *many)] == ["CQ203"]


def test_the_same_mistake_on_many_endpoints_is_reported_for_each():
    many = [writer("box", f"w{number}", care="express") for number in range(50)]
    assert len({finding.message for finding in findings(*many)}) == 50


def test_an_invalid_value_is_not_known_and_nothing_is_called_compatible():
    report = checked(writer("box", care="express"), reader("box", care="signed"))
    assert report.verdict == "unknown"
    assert codes(report) == ["CQ203"]
    assert report.groups[0].codes == ("CQ203", "POST101")


def test_a_setting_that_the_importer_could_not_read_makes_its_policy_unknown():
    open_ = replace(writer("box"), settings={"care": Setting("${CARE}", place(3), "variable `CARE` is not set")})
    report = checked(open_, reader("box", care="signed"))
    assert (report.verdict, codes(report)) == ("unknown", ["CQ217"])
    assert report.groups[0].codes == ("CQ217", "POST101")
    assert "`care` is not known: variable `CARE` is not set" in report.findings[0].message
    assert report.findings[0].place == place(3)
    # Not even where every value would do: what is not understood may be no value at all.
    assert checked(open_, reader("box", care="plain")).verdict == "unknown"


def test_whether_an_ignored_policy_is_stated_is_not_known_where_it_was_not_read():
    rule = forbids(stated(DELAY), code="POST399", name="delay-stated", because="it changes nothing", severity="warning")
    pack = replace(POST, rules=(*POST.rules, rule))
    for setting, found in ((Setting("?", None, "the file is missing"), []), (Setting("infinite"), ["POST399"])):
        end = writer("box", more={"settings": {"delay": setting}})
        assert codes(checked(end, reader("box"), packs=[pack], options={"carrier": "pigeon"})) == found


def test_a_nearer_value_wins_over_one_that_was_not_read():
    base = Profile("p", {"care": Setting("?", None, "the file is missing")})
    report = checked(base, writer("box", "w", "p", care="signed"), reader("box", care="signed"))
    assert (report.verdict, codes(report)) == ("compatible", [])


@pytest.mark.parametrize(
    ("stated", "shown"),
    [
        (Setting("plain", unknown="two files state it"), "unknown"),
        (Setting("registered", unknown="two files state it"), "unknown"),
        (Setting("best", unknown="two files state it"), "unknown"),
        (Setting("$(CARE)", unknown="variable `CARE` is not set"), "$(CARE)"),
        (Setting("plian"), "plian"),
        (Setting("unknown"), "unknown"),
    ],
)
def test_a_value_that_is_not_known_is_never_shown_as_one(stated, shown):
    assert facts(writer("box", more={"settings": {"care": stated}}))["care"].value == shown


def test_an_unread_base_makes_unknown_what_no_nearer_layer_states():
    base = Profile("p", {EVERY_OTHER: Setting("", place(2), "base profile `B` is not in the input")})
    report = checked(base, writer("box", "w", "p", care="signed"), reader("box", care="signed", delay="1s"))
    assert (report.verdict, codes(report)) == ("unknown", ["CQ217"])
    report = checked(base, writer("box", "w", "p", care="plain"), reader("box", care="signed"))
    assert report.verdict == "incompatible"


def test_one_cause_is_one_finding_whatever_it_concerns():
    cause = Setting("", place(2), "base profile `B` is not in the input")
    many = [writer("box", f"w{number}", "p") for number in range(40)]
    report = checked(Profile("p", {EVERY_OTHER: cause}), *many, reader("box", care="signed"))
    (finding,) = [each for each in report.findings if each.severity != "note"]
    assert (finding.code, len(finding.sides[0].members)) == ("CQ217", 40)
    wrong = Profile("p", {"care": Setting("express", place(2))})
    (finding,) = [each for each in checked(wrong, *many, reader("box")).findings if each.severity != "note"]
    assert (finding.code, len(finding.sides[0].members)) == ("CQ203", 40)
    assert finding.message.startswith("profile `p`: `care`")


def test_what_may_be_one_of_a_few_values_depends_on_one_assumption():
    unclear = Cases("what the zeros mean", (("chosen", "plain"), ("nobody edited them", "signed")))
    zero = {"care": Setting("0", None, unclear)}
    ends = replace(writer("box"), settings=zero), replace(reader("box"), settings=zero)
    assert checked(*ends).verdict == "compatible"
    report = checked(ends[0], reader("box", care="signed"))
    assert report.verdict == "unknown"
    assert dict(only(report, "POST101").worlds) == {
        "what the zeros mean=chosen": "incompatible",
        "what the zeros mean=nobody edited them": "compatible",
    }
    assert checked(ends[0], reader("box", care="plain")).verdict == "compatible"


def test_one_of_a_few_that_is_no_value_is_reported_as_such():
    unclear = Cases("what the zeros mean", (("chosen", "express"), ("edited by hand", "signed")))
    system = world(
        replace(writer("box"), settings={"care": Setting("0", place(3), unclear)}), reader("box", care="signed")
    )
    report = checked(system)
    finding = only(report, "CQ203")
    assert "`express` is not one of its values" in finding.message
    assert (finding.place, report.verdict) == (place(3), "unknown")


def test_places_of_what_is_wrong_are_those_where_it_stands():
    wrong = replace(writer("box"), settings={"care": Setting("express", place(3, 7)), "colour": Setting("x", place(4))})
    found = {finding.code: finding.place for finding in findings(wrong)}
    assert found == {"CQ203": place(3, 7), "CQ202": place(4)}
    bad_profile = replace_places(profile("p", care="express"), place(9))
    (finding,) = findings(bad_profile, replace(writer("box", "w", "p"), place=place(1)))
    assert finding.place == place(9)
    referring = replace(writer("box"), profiles=(ProfileRef("q", place(5)),))
    assert findings(referring)[0].place == place(5)


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 0, 2)])
def test_a_circle_of_profiles_is_the_same_finding_in_any_order(order):
    users = [writer("box", f"{name}/w", name) for name in "abc"]
    ring = [profile("a", "b", care="signed"), profile("b", "c", copies="3"), profile("c", "a", delay="1s")]
    parts = [*ring, *(users[index] for index in order)]
    assert [finding.message for finding in findings(*parts)] == [
        "profiles are based on each other in a circle: a → b → c → a",
    ]
    # Each still has the values of all of them.
    for endpoint in every(*parts):
        assert [text(endpoint, name) for name in ("care", "copies", "delay")] == ["signed", "3", "1s"]


def test_a_profile_may_be_based_on_itself_by_mistake():
    (finding,) = findings(profile("a", "a"), writer("box", "w", "a"))
    assert finding.message == "profiles are based on each other in a circle: a → a"


def test_a_preset_is_asked_for_of_every_participant_that_uses_it():
    parts = [profile("p", "modern"), writer("box", "new/w", "p"), writer("box", "old/w", "p")]
    parts += [participant("new", year="y2010"), participant("old", year="y1990")]
    for order in (parts, [*parts[:1], *reversed(parts[1:])]):
        assert [finding.message for finding in findings(*order)] == [
            "preset `modern` exists from year y2000 on, this participant has year y1990",
        ]


def test_a_long_chain_of_profiles_is_followed_to_its_end():
    chain = [
        profile(f"p{number}", f"p{number + 1}", **({"care": "signed"} if number == 4999 else {}))
        for number in range(5000)
    ]
    endpoint = first(*chain, profile("p5000", delay="2s"), writer("box", "w", "p0"))
    assert [text(endpoint, name) for name in ("care", "delay")] == ["signed", "2s"]


def test_profiles_that_share_their_bases_over_and_over_are_read_once():
    ladder = [profile(f"{side}{level}", f"l{level + 1}", f"r{level + 1}") for level in range(40) for side in "lr"]
    endpoint = first(*ladder, profile("l40", care="signed"), profile("r40", care="insured"), writer("box", "w", "l0"))
    assert text(endpoint, "care") == "insured"


def test_a_profile_reached_twice_is_no_circle():
    diamond = [profile("top", care="signed"), profile("l", "top"), profile("r", "top"), profile("bottom", "l", "r")]
    assert not findings(*diamond, writer("box", "w", "bottom"))


# Whole systems


def test_the_protocol_of_an_endpoint_wins_over_its_participants_and_the_systems():
    def read_as_post(*parts: Any, **fields: Any) -> bool:
        return "CQ201" not in codes(
            check(world(*parts, protocol=fields.pop("stated", "nothing")), packs=[POST], **fields)
        )

    assert read_as_post(writer("box", more={"protocol": "post"}))
    assert read_as_post(writer("box"), participant("writer", {"protocol": "post"}))
    assert read_as_post(writer("box"), stated=None, protocol="post")
    assert not read_as_post(writer("box"), stated=None)
    assert not read_as_post(writer("box"))


def test_equal_ids_of_two_sources_are_made_unique():
    report = checked(writer("box", "w"), writer("box", "w"), writer("box", "w~2"), reader("box"))
    assert sorted(name for each in report.groups for name in each.publishers) == ["w", "w~2", "w~2~2"]


def test_what_a_participant_states_is_read_even_where_it_has_no_endpoint():
    assert [f.code for f in findings(participant("idle", colour="red"))] == ["CQ202"]


def test_a_participant_finds_its_broker():
    """The named one, or the only one."""

    pack = replace(
        POST,
        policies=(
            *POLICIES,
            Policy("limit", Count(), "5", level="broker"),
            Policy("broker", Text(), None, level="participant"),
        ),
        rules=(requires(parse("offered(copies) <= broker(limit)"), code="POST801", name="a", because="b"),),
    )
    system = world(writer("box", "w", copies="7"), reader("box"))

    def speaks(*brokers: Broker) -> bool:
        system.brokers = {broker.id: broker for broker in brokers}
        return "POST801" in codes(checked(system, packs=[pack]))

    small, large = Broker("small", settings=settings(limit="1")), Broker("large", settings=settings(limit="9"))
    assert speaks()
    assert not speaks(large)
    assert speaks(small)
    assert not speaks(small, large)  # neither is named, so no value of a broker is known
    report = checked(system, packs=[pack])
    assert (report.verdict, "CQ216" in codes(report)) == ("unknown", True)
    system.participants["w"] = Participant("w", settings=settings(broker="large"))
    assert not speaks(small, large)


def test_a_wrong_name_is_answered_with_the_nearest():
    assert suggestion("Car", ["care", "copies"]) == "did you mean `care`? known: care, copies"
    assert suggestion("zzz", []) == "known: none"


def test_the_order_of_settings_changes_nothing():
    stated = {"care": "signed", "delay": "2s", "copies": "7"}
    backwards = dict(reversed(stated.items()))
    report = checked(writer("box", "a", **stated), writer("box", "b", **backwards), reader("box"))
    assert [each.publishers for each in report.groups] == [("a", "b")]


def test_findings_of_a_report_name_the_origin_of_each_value():
    report = checked(profile("p", care="plain"), writer("box", "w", "p"), reader("box", care="signed"))
    finding = only(report, "POST101")
    assert [(side.role, fact.policy, fact.value, fact.origin) for side in finding.sides for fact in side.facts] == [
        ("subscriber", "care", "signed", "explicit"),
        ("publisher", "care", "plain", "profile p"),
    ]


def test_equal_endpoints_of_different_systems_keep_their_own_places():
    systems = [
        world(
            writer("box", more={"settings": {"care": Setting("plain", place(line))}, "place": place(line)}),
            reader("box", care="signed"),
            box("box", interval="1s"),
        )
        for line in (7, 8)
    ]
    for line, system in zip((7, 8), systems, strict=True):
        (finding,) = [each for each in check(system, packs=[POST]).findings if each.code == "POST101"]
        fact = next(each for side in finding.sides for each in side.facts if each.value == "plain")
        assert fact.place == place(line)


def test_equal_needs_of_two_endpoints_are_edited_where_each_states_them():
    text = """
cqos: 1
protocol: mqtt
participants:
  sensor: {publishes: {a/b: {qos: 2}}}
  viewer:
    subscribes:
      a/+: {qos: 2, needs: {duplicate_free: true}}
      a/#: {qos: 2, needs: {duplicate_free: true}}
"""
    (finding,) = [each for each in check(text.encode()).findings if each.code == "MQTT616"]
    (fix,) = [each for each in finding.remedies if each.policy == "need.duplicate_free"]
    assert sorted(edit.place.line or 0 for edit in fix.edits) == [8, 9]


def test_what_is_said_of_a_setting_names_the_endpoint_that_states_it_and_its_place():
    for line in (7, 8):
        ends = [
            writer("box", name, copies=copies, more={"settings": {**settings(copies=copies), **wrong(at)}})
            for name, copies, at in (("one", "1", line), ("other", "2", line + 10))
        ]
        found = {each.sides[0].members: each for each in findings(*ends)}
        assert {members: each.place for members, each in found.items()} == {
            ("one",): place(line),
            ("other",): place(line + 10),
        }
        assert all(f"`{name}`" in each.message for (name,), each in found.items())


def wrong(line: int) -> Any:
    return {"care": Setting("express", place(line))}


def test_what_one_system_read_is_not_what_another_says_of_its_topic():
    for interval, found in (("1s", []), ("2s", ["POST303"]), ("1s", [])):
        assert codes(checked(writer("box", delay="1s"), reader("box"), box("box", interval=interval))) == found


@pytest.mark.parametrize(
    ("name", "care", "copies", "delay"),
    [("car", "unknown", "3", "infinite"), ("wrapping", "unknown", "3", "unknown")],
)
def test_a_misspelt_name_makes_unknown_what_it_may_have_meant(name, care, copies, delay):
    found = first(writer("box", copies="3", **{name: "insured"}))
    assert [text(found, each) for each in ("care", "copies", "delay")] == [care, copies, delay]


@pytest.mark.parametrize("name", ["car", "wrapping", "care2", "*"])
@pytest.mark.parametrize("stated", [{}, {"care": "insured"}])
def test_no_pair_is_compatible_beside_a_name_that_is_not_understood(name, stated):
    wrong = {name: "signed", **stated}
    for ends in (
        [writer("box", **wrong), reader("box", care="plain")],
        [writer("box", care="insured"), reader("box", **wrong)],
        [writer("box", "w", "p", care="insured"), reader("box"), profile("p", **wrong)],
        [writer("box", "a/w", care="insured"), reader("box"), participant("a", towm="1")],
    ):
        report = checked(*ends)
        assert report.verdict == "unknown", str(report)
        assert "CQ202" in report.groups[0].codes
    assert checked(writer("box", care="plain"), reader("box", care="signed", wrapping="x")).verdict == "incompatible"


def of_unknown(where, reported):
    """A system in which something is not known, at a topic, a participant or an option; ``reported`` by its reader, or not."""
    unknown = Setting("", Place("f.yml", 3, 1), unknown="nobody knows", reported=reported)
    system = System(protocol="ros2", participants={"a": Participant("a")})
    if where == "topic":
        system.topics["t"] = Topic("t", {"period": unknown})
    elif where == "option":
        system.options["ros2"] = {"rmw": unknown}
    else:
        system.participants["a"].settings["domain"] = unknown
    system.endpoints.append(Endpoint(id="p", role="publisher", topic="t", participant="a"))
    system.endpoints.append(Endpoint(id="q", role="subscriber", topic="t", participant="a"))
    return system


@pytest.mark.parametrize("where", ["topic", "participant", "option"])
def test_what_a_reader_reports_of_one_system_hides_nothing_in_another(where):
    alone = [each.code for each in check(of_unknown(where, "")).findings]
    assert "CQ217" in alone
    assert "CQ217" not in [each.code for each in check(of_unknown(where, "CQ041")).findings]
    assert [each.code for each in check(of_unknown(where, "")).findings] == alone
