"""Overlays: settings of other files, laid over what endpoints state, or under it where they leave a value open."""

from dataclasses import replace

import pytest

from cqos_core import Overlay, Place, Setting, Verdict
from cqos_core.packs import TopicMatching
from tests.made_up_protocol import POST, checked, codes, facts, only, reader, world, writer


def overlay(more=None, **stated):
    settings = {name: Setting(text, Place("over.yaml", 7, 3)) for name, text in stated.items()}
    return replace(Overlay("over.yaml", settings, place=Place("over.yaml", 5, 1)), **(more or {}))


def usual(more=None, **stated):
    """An overlay that says what `usual` means."""
    return overlay({"fills": ("usual", "unspecified"), **(more or {})}, **stated)


def care(*parts, overlays=(), **fields):
    """The care of every endpoint, as it is printed."""
    system = world(*parts, overlays=list(overlays), **fields)
    return [facts(system, of=each.id)["care"].value for each in system.endpoints]


class TestOver:
    def test_it_wins_over_what_is_stated(self):
        assert care(writer("box", care="plain"), overlays=[overlay(care="signed")]) == ["signed"]

    def test_what_is_stated_beside_the_endpoint_wins_over_it(self):
        own = writer("box", care="plain", more={"overlay": {"care": Setting("insured")}})
        assert care(own, overlays=[overlay(care="signed")]) == ["insured"]

    def test_the_last_one_wins(self):
        assert care(writer("box"), overlays=[overlay(care="signed"), overlay(care="insured")]) == ["insured"]

    def test_findings_show_where_it_stands(self):
        report = checked(
            writer("box"), reader("box", care="signed"), overlays=[overlay({"role": "publisher"}, care="plain")]
        )
        (fact,) = [fact for side in only(report, "POST101").sides for fact in side.facts if fact.origin == "over.yaml"]
        assert fact.place == Place("over.yaml", 7, 3)

    @pytest.mark.parametrize(
        "more",
        [
            {"role": "subscriber"},
            {"topic": "box[0-9]"},
            {"participant": "other"},
            {"entity": "other"},
            {"protocol": "other"},
            {"when": ("carrier", "train")},
            {"when": ("weather", "rain")},
        ],
    )
    def test_it_covers_only_what_it_is_meant_for_and_says_so(self, more):
        over = overlay(more, care="signed")
        assert care(writer("box", care="plain"), overlays=[over], options={"carrier": "bike"}) == ["plain"]
        report = checked(writer("box"), overlays=[over], options={"carrier": "bike"})
        finding = only(report, "CQ214")
        assert (finding.place, finding.severity) == (Place("over.yaml", 5, 1), "warning")

    @pytest.mark.parametrize(
        "more", [{"entity": "writer/1"}, {"topic": "b*"}, {"when": ("carrier", "bike")}, {"participant": "writer"}]
    )
    def test_it_covers_what_it_is_meant_for(self, more):
        parts = (writer("box", "writer/1", care="plain"),)
        assert care(*parts, overlays=[overlay(more, care="signed")], options={"carrier": "bike"}) == ["signed"]

    @pytest.mark.parametrize(("carrier", "reported"), [("bike", 0), ("pigeon", 0), ("train", 1)])
    def test_one_that_holds_under_several_values_is_reported_once_where_none_of_them_holds(self, carrier, reported):
        overlays = [overlay({"when": ("carrier", each)}, care="signed") for each in ("bike", "pigeon")]
        report = checked(writer("box"), overlays=overlays, options={"carrier": carrier})
        found = [each.message for each in report.findings if each.code == "CQ214"]
        assert len(found) == reported
        assert all("carrier bike or pigeon" in message for message in found)

    def test_its_own_dialect_reads_it(self):
        over = overlay({"dialect": "form"}, sorgfalt="2", delay="3")
        report = checked(
            writer("box"), reader("box", care="insured", delay="2s"), overlays=[replace(over, role="publisher")]
        )
        assert "delay 3s" in only(report, "POST102").message
        assert "care signed" in only(report, "POST101").message

    def test_what_was_observed_is_not_changed_which_is_a_note_where_it_covers_nothing_else(self):
        over = overlay(care="signed")
        seen = writer("box", care="plain", more={"observed": True})
        assert care(seen, overlays=[over]) == ["plain"]
        finding = only(checked(seen, overlays=[over]), "CQ214")
        assert finding.severity == "note"
        assert "covers only endpoints that were observed" in finding.message
        assert "CQ214" not in codes(checked(seen, writer("box", name="designed"), overlays=[over]))

    def test_a_pack_says_what_a_pattern_of_participants_means(self):
        meeting = TopicMatching(address=lambda name, _: f"/{name}", covers=lambda pattern, name: pattern == name[:2])
        pack = replace(POST, topic_matching=meeting)
        parts = (writer("box", "anna/1", care="plain"), writer("box", "bert/1", care="plain"))
        report = checked(
            *parts,
            reader("box", care="signed"),
            overlays=[overlay({"participant": "/a"}, care="signed")],
            packs=[pack],
        )
        assert only(report, "POST101").sides[1].members == ("bert/1",)


class TestUnder:
    def test_it_takes_the_place_of_its_words_only(self):
        parts = (writer("box", "a", care="usual"), writer("box", "b", care="plain"), writer("box", "c", "as_usual"))
        options = {"carrier": "train"}
        assert care(*parts, options=options) == ["signed", "plain", "signed"]
        assert care(*parts, overlays=[usual(care="insured")], options=options) == ["insured", "plain", "insured"]

    def test_a_zero_may_be_such_a_word(self):
        for text, shown in (("0", "delay 5s"), ("unspecified", "delay 5s"), ("7s", "delay 7s")):
            parts = (writer("box", delay=text), reader("box", delay="2s"))
            assert (
                shown in only(checked(*parts, overlays=[usual({"role": "publisher"}, delay="5s")]), "POST102").message
            )

    def test_what_is_laid_over_wins_over_it_and_can_leave_it_open_too(self):
        over, under = overlay(care="plain"), usual(care="insured")
        assert care(writer("box", care="usual"), overlays=[over, under]) == ["plain"]
        assert care(writer("box", care="plain"), overlays=[under, overlay(care="usual")]) == ["insured"]

    @pytest.mark.parametrize("more", [{}, {"when": ("carrier", "train")}])
    def test_a_later_one_takes_its_place_unless_it_says_what_is_to_be_filled(self, more):
        under, later = usual(more, care="insured"), usual(more, care="plain")
        loose = usual(more, care="usual")  # gives way to what another one fills in
        writers = (writer("box", care="usual"),)
        for laid, decides in (([under, later], later), ([later, under], under), ([loose, under], under)):
            assert care(*writers, overlays=laid) == care(*writers, overlays=[decides])
        assert care(*writers, overlays=[under, loose]) == care(*writers, overlays=[under])
        assert "CQ215" not in codes(checked(*writers, overlays=[under, loose]))

    def test_an_overlay_that_gives_way_everywhere_is_one_warning(self):
        parts = (writer("box", "a", care="plain"), writer("box", "b", care="signed"))
        finding = only(checked(*parts, overlays=[usual(care="insured")]), "CQ215")
        assert finding.message == "over.yaml sets `care` to insured, but all endpoints that it covers have their own"
        assert (finding.place, finding.severity) == (Place("over.yaml", 7, 3), "warning")

    def test_one_that_it_decides_for_is_enough(self):
        parts = (writer("box", "a", care="plain"), writer("box", "b", care="usual"))
        assert "CQ215" not in codes(checked(*parts, overlays=[usual(care="insured")]))

    def test_that_it_says_the_same_needs_no_word(self):
        assert "CQ215" not in codes(checked(writer("box", care="signed"), overlays=[usual(care="registered")]))


TRAIN = {"when": ("carrier", "train")}


class TestUnderAnAssumption:
    def test_it_holds_in_that_world_only(self):
        shown = "insured (plain with bike, ship; insured with train)"
        assert care(writer("box", care="plain"), overlays=[overlay(TRAIN, care="insured")]) == [shown]

    def test_what_depends_on_the_same_option_is_taken_apart(self):
        shown = "plain (plain with bike, train; insured with ship)"
        assert care(writer("box", care="usual"), overlays=[usual(TRAIN, care="plain")]) == [shown]

    def test_the_verdict_says_what_it_depends_on(self):
        parts = (writer("box", care="plain"), reader("box", care="signed"))
        report = checked(*parts, overlays=[overlay({**TRAIN, "role": "publisher"}, care="insured")])
        assert report.verdict is Verdict.UNKNOWN
        worlds = {world: str(verdict) for world, verdict in only(report, "POST101").worlds.items()}
        assert worlds == {
            "post.carrier=bike": "incompatible",
            "post.carrier=train": "compatible",
            "post.carrier=ship": "incompatible",
        }

    def test_what_it_would_not_change_stays_known(self):
        assert care(writer("box", care="plain"), overlays=[overlay(TRAIN, care="plain")]) == ["plain"]

    def test_several_of_one_assumption_hold_together(self):
        first, last = overlay(TRAIN, care="insured"), overlay(TRAIN, care="signed")
        shown = "signed (plain with bike, ship; signed with train)"
        assert care(writer("box", care="plain"), overlays=[first, last]) == [shown]

    def test_of_a_value_taken_from_peers_nothing_more_is_known(self):
        over = overlay({**TRAIN, "role": "subscriber"}, care="insured")
        report = checked(writer("box", care="plain"), reader("box", care="best"), overlays=[over])
        assert report.verdict is Verdict.UNKNOWN
        assert only(report, "POST101").message.endswith("is not known: it depends on option carrier")

    def test_an_assumption_that_is_out_of_play_does_not_hold(self):
        report = checked(writer("box"), overlays=[overlay({"when": ("carrier", "pigeon")}, care="signed")])
        assert "CQ214" in codes(report)

    def test_an_option_without_a_valid_value_leaves_it_open(self):
        parts = (writer("box", care="plain"), reader("box", care="signed"))
        over = overlay({**TRAIN, "role": "publisher"}, care="insured")
        report = checked(*parts, overlays=[over], options={"carrier": "snail"})
        assert report.verdict is Verdict.UNKNOWN
        assert care(*parts, overlays=[over], options={"carrier": "snail"}) == ["unknown", "signed"]
