"""What system files mean: how documents become participants, endpoints, settings, and what instances multiply."""

from textwrap import dedent

import pytest

from cqos_core.model.problems import InputError
from cqos_core.model.settings import Place, Setting
from cqos_core.model.source import ReadContext, Source
from cqos_core.model.system import Bound
from cqos_core.plugins import load_plugins, named

read = named(load_plugins().importers["yaml"].reader)
MOST_INSTANCES = 100_000


def system(text, **files):
    """Read ``text``; ``files`` are what it can include, as ``name=text`` for ``name.yaml``."""

    def open_file(name, relative_to):
        return Source(name, document(files[name.removesuffix(".yaml")]))

    return read(Source("s.yaml", document(text)), ReadContext(open_file))


def document(text):
    return ("cqos: 1\n" + dedent(text).removeprefix("\n")).encode()


def problems(text, **files):
    with pytest.raises(InputError) as refused:
        system(text, **files)
    return [str(problem).removeprefix("s.yaml:") for problem in refused.value.problems]


def texts(settings):
    return {name: setting.text for name, setting in settings.items()}


def ids(text, **files):
    return [endpoint.id for endpoint in system(text, **files).endpoints]


class TestEndpoints:
    def test_a_topic_stands_for_its_profile_its_settings_or_nothing(self):
        endpoints = system("""
            participants:
              a:
                publishes: {t: fast, u: {profile: [slow, fast], depth: 3}, v: }
            """).endpoints
        assert [[ref.name for ref in endpoint.profiles] for endpoint in endpoints] == [
            ["fast"],
            ["slow", "fast"],
            [],
        ]
        assert [texts(endpoint.settings) for endpoint in endpoints] == [{}, {"depth": "3"}, {}]

    def test_structural_keys_are_no_settings(self):
        (endpoint,) = system("""
            participants:
              a:
                subscribes:
                  t: {id: x, type: T, needs: {latest: true}, external: true, starts_after: [b, c], label: L,
                      observed: true, protocol: p, depth: 1}
            """).endpoints
        assert endpoint.id == "x"
        assert endpoint.type == "T"
        assert texts(endpoint.needs) == {"latest": "true"}
        assert endpoint.external
        assert endpoint.observed
        assert endpoint.starts_after == ("b", "c")
        assert (endpoint.label, endpoint.protocol, endpoint.dialect) == ("L", "p", "yaml")
        assert texts(endpoint.settings) == {"depth": "1"}

    @pytest.mark.parametrize(
        ("key", "role", "kind", "word"),
        [
            ("publishes", "publisher", "message", "publisher"),
            ("subscribes", "subscriber", "message", "subscriber"),
            ("serves", "subscriber", "service_server", "service_server"),
            ("calls", "publisher", "service_client", "service_client"),
            ("action_servers", "subscriber", "action_server", "action_server"),
            ("action_clients", "publisher", "action_client", "action_client"),
        ],
    )
    def test_role_kind_and_id(self, key, role, kind, word):
        (endpoint,) = system(f"participants: {{a: {{{key}: {{t: }}}}}}").endpoints
        assert (endpoint.role, endpoint.kind, endpoint.id) == (role, kind, f"a/{word}/t")

    def test_several_on_one_topic_are_numbered_from_the_second_on(self):
        assert ids("participants: {a: {publishes: {t: [x, {id: mine}, y, z]}}}") == [
            "a/publisher/t",
            "mine",
            "a/publisher/t#2",
            "a/publisher/t#3",
        ]

    def test_a_made_up_id_gives_way_to_one_that_looks_like_its_number(self):
        assert ids('participants: {a: {publishes: {"t#2": , t: [x, y, z]}}}') == [
            "a/publisher/t#2",
            "a/publisher/t",
            "a/publisher/t#3",
            "a/publisher/t#4",
        ]

    def test_places_are_those_of_keys_and_values(self):
        (endpoint, *several) = system("""
            participants:
              a:
                publishes:
                  t: {depth: 3}
                  u:
                    - x
                    - y
            """).endpoints
        assert endpoint.place == Place("s.yaml", 5, 7)
        assert endpoint.settings["depth"] == Setting("3", Place("s.yaml", 5, 18))
        assert [other.place for other in several] == [Place("s.yaml", 7, 11), Place("s.yaml", 8, 11)]

    def test_a_document_can_be_a_snapshot(self):
        text = "observed: true\nparticipants: {a: {publishes: {t: , u: {observed: false}}}}"
        assert [endpoint.observed for endpoint in system(text).endpoints] == [True, False]


class TestSettings:
    @pytest.mark.parametrize(
        ("written", "text"),
        [
            ("reliable", "reliable"),
            ('"2 s"', "2 s"),
            ("yes", "yes"),
            ("True", "True"),
            ("0o17", "0o17"),
            ("1:30", "1:30"),
            ("2027-01-01", "2027-01-01"),
            ("!!str 5", "5"),
            ('"null"', "null"),
            ("[a, 'b c', \"d, e\", 1, '1', null, ~, '']", '[a, b c, "d, e", 1, "1", null, ~, ""]'),
            ("{sec: 2, nsec: 0}", "{sec: 2, nsec: 0}"),
            ("{a: [x, {b: c}], 'd e': 'f: g'}", '{a: [x, {b: c}], d e: "f: g"}'),
            ("|\n      two\n      lines\n", "two\nlines\n"),
        ],
    )
    def test_values_become_text_in_flow_form(self, written, text):
        assert texts(system(f"profiles:\n  p:\n    s: {written}").profiles["p"].settings) == {"s": text}

    @pytest.mark.parametrize("nothing", ["", "~", "null", "Null"])
    def test_nothing_is_not_stated(self, nothing):
        assert system(f"profiles:\n  p:\n    s: {nothing}").profiles["p"].settings == {}


class TestParticipants:
    def test_other_keys_connection_and_options_are_settings(self):
        (participant,) = system("""
            participants:
              a:
                rmw: quick
                partitions: [x, y]
                client: {keep_alive: 30s, will: {topic: bye}}
                options: {mode: strict}
                remap: {/x: /y}
                external: true
                starts_after: b
                label: A
            """).participants.values()
        assert texts(participant.settings) == {
            "rmw": "quick",
            "partitions": "[x, y]",
            "keep_alive": "30s",
            "will": "{topic: bye}",
            "mode": "strict",
        }
        assert participant.remap == {"/x": "/y"}
        assert (participant.external, participant.starts_after, participant.label) == (True, ("b",), "A")

    def test_a_group_is_a_profile_of_its_endpoints(self):
        read_system = system("""
            participants:
              a:
                publishers:
                  logs: {profile: base, partition: [x], publishes: {t: near, u: }}
                  bare: {profile: base, publishes: {v: }}
            """)
        (group,) = read_system.profiles.values()
        assert (group.name, texts(group.settings)) == ("a/publishers/logs", {"partition": "[x]"})
        assert [ref.name for ref in group.base] == ["base"]
        assert [[ref.name for ref in endpoint.profiles] for endpoint in read_system.endpoints] == [
            ["a/publishers/logs", "near"],
            ["a/publishers/logs"],
            ["base"],
        ]

    def test_protocol_is_stated_only_where_it_differs_from_the_systems(self):
        participants = system("protocol: p\nparticipants: {a: {}, b: {protocol: q}, c: {protocol: p}}").participants
        assert [participant.protocol for participant in participants.values()] == [None, "q", None]


class TestWholeSystem:
    def test_topics_profiles_brokers_and_bridges(self):
        read_system = system("""
            topics: {t: pkg/T, u: {period: 1s, external: true, protocol: p}}
            profiles: {p: {profile: q, depth: 1}}
            brokers: {b: {protocol: p, profile: q, maximum_qos: 1}}
            bridges: {x: {carries: [liveliness], routes: [{from: {participant: a, topic: t}, to: {participant: b, qos: 1}}]}}
            """)
        assert texts(read_system.topics["t"].settings) == {"type": "pkg/T"}
        topic = read_system.topics["u"]
        assert (texts(topic.settings), topic.external, topic.protocol) == ({"period": "1s"}, True, "p")
        assert [ref.name for ref in read_system.profiles["p"].base] == ["q"]
        broker = read_system.brokers["b"]
        assert (broker.protocol, [ref.name for ref in broker.profiles], texts(broker.settings)) == (
            "p",
            ["q"],
            {"maximum_qos": "1"},
        )
        bridge = read_system.bridges["x"]
        (route,) = bridge.routes
        assert bridge.carries == ("liveliness",)
        assert (route.source.role, route.source.participant, route.source.topic) == ("subscriber", "a", "t")
        assert (route.target.role, route.target.participant, route.target.topic) == ("publisher", "b", None)
        assert texts(route.target.settings) == {"qos": "1"}
        assert (route.only, route.but, route.source.kind) == ((), (), "message")

    def test_routes_name_what_they_carry_by_regular_expressions(self):
        read_system = system("""
            bridges:
              x:
                routes:
                  - {from: {participant: a, topic: "/*"}, to: {participant: b}, only: [/tf, ".*/pose"], but: [/x]}
                  - {from: {participant: a, topic: "/*"}, to: {participant: b}, kind: action}
            """)
        named, calling = read_system.bridges["x"].routes
        assert (named.only, named.but) == (("/tf", ".*/pose"), ("/x",))
        assert (calling.source.kind, calling.target.kind) == ("action_server", "action_client")

    def test_checks_and_accepted_findings(self):
        read_system = system("""
            checks:
              - name: c
                where: {role: subscriber, topic: "t*"}
                require: {a: x, b: {at_least: 1, at_most: 2}, c: {one_of: [x, "1"]}, d: {not: [y]}, e: [z], f: {not: w}}
                because: so
                severity: note
            accept:
              - {rule: X101, topic: t, endpoint: e, until: 2027-01-31, because: known}
            severities: {X101: off}
            options: {p: {mode: strict}}
            """)
        (rule,) = read_system.checks
        assert rule.where == (("role", "subscriber"), ("topic", "t*"))
        assert [(bound.policy, bound.relation, bound.values) for bound in rule.require] == [
            ("a", "exactly", ("x",)),
            ("b", "at_least", ("1",)),
            ("b", "at_most", ("2",)),
            ("c", "one_of", ("x", "1")),
            ("d", "not", ("y",)),
            ("e", "exactly", ("[z]",)),
            ("f", "not", ("w",)),
        ]
        assert rule.require[0] == Bound("a", "exactly", ("x",), Place("s.yaml", 5, 18))
        assert (rule.because, rule.severity, rule.sentence) == ("so", "note", None)
        (accepted,) = read_system.accept
        assert (accepted.rule, accepted.topic, accepted.endpoint, accepted.until) == (
            "X101",
            "t",
            "e",
            "2027-01-31",
        )
        assert read_system.severities == {"X101": "off"}
        assert texts(read_system.options["p"]) == {"mode": "strict"}

    def test_sources_are_kept_for_excerpts(self):
        read_system = system("include: more.yaml", more="system: m")
        assert list(read_system.sources) == ["s.yaml", "more.yaml"]
        assert read_system.sources["more.yaml"] == document("system: m")


class TestInclude:
    def test_included_parts_keep_their_places_and_the_including_file_comes_first(self):
        read_system = system(
            """
            include: [more.yaml]
            system: whole
            protocol: p
            participants: {a: {}}
            """,
            more="system: part\nprotocol: q\nparticipants: {b: {}, c: {protocol: p}}\nbrokers: {x: {}}",
        )
        assert (read_system.name, read_system.protocol) == ("whole", "p")
        assert [participant.protocol for participant in read_system.participants.values()] == [
            None,
            "q",
            None,
        ]
        assert read_system.participants["b"].place == Place("more.yaml", 4, 16)
        assert read_system.brokers["x"].protocol == "q"

    def test_an_included_protocol_does_not_reach_the_including_file(self):
        read_system = system("include: more.yaml\nparticipants: {a: {}}", more="protocol: q\nparticipants: {b: {}}")
        assert read_system.protocol is None
        assert [participant.protocol for participant in read_system.participants.values()] == [None, "q"]

    def test_a_file_that_two_include_is_read_once(self):
        text = "include: [left.yaml, right.yaml]"
        assert ids(text, left="include: base.yaml", right="include: base.yaml", base=SMALL) == ["a/publisher/t"]

    def test_variables_hold_in_every_file(self):
        assert ids("include: more.yaml\ninstances: {n: 2}", more='participants: {"a${n}": {publishes: {t: }}}') == [
            "a1/publisher/t",
            "a2/publisher/t",
        ]

    def test_problems_of_all_files_are_reported_in_their_order(self):
        found = problems("include: more.yaml\nsystem: [x]\nwhat: x", more="observed: 3")
        assert [problem.split(" ")[0] for problem in found] == ["3:9:", "4:1:", "more.yaml:2:11:"]

    def test_bytes_without_a_folder_cannot_include(self):
        with pytest.raises(InputError) as refused:
            read(Source("<bytes>", document("include: x.yaml")), ReadContext())
        assert [problem.code for problem in refused.value.problems] == ["CQ007"]
        assert str(refused.value).startswith("<bytes>:2:10: ")

    def test_endless_includes_end(self):
        def open_file(name, relative_to):
            return Source(f"{relative_to}x", document("include: next.yaml"))

        with pytest.raises(InputError, match="more than 1000 files"):
            read(Source("s.yaml", document("include: next.yaml")), ReadContext(open_file))


SMALL = "participants: {a: {publishes: {t: }}}"


class TestInstances:
    def test_a_participant_is_multiplied_with_all_that_is_in_it(self):
        read_system = system("""
            instances: {n: [one, two]}
            participants:
              "robot_${n}": {namespace: "/${n}", label: "robot ${n}", publishes: {"/${n}/pose": "p_${n}"}}
            """)
        assert list(read_system.participants) == ["robot_one", "robot_two"]
        two = read_system.participants["robot_two"]
        assert (two.template, two.label, texts(two.settings)) == (
            "robot_${n}",
            "robot two",
            {"namespace": "/two"},
        )
        endpoint = read_system.endpoints[1]
        assert (endpoint.id, endpoint.template) == (
            "robot_two/publisher/two/pose",
            "robot_${n}/publisher/${n}/pose",
        )
        assert (endpoint.topic, endpoint.participant, endpoint.profiles[0].name) == (
            "/two/pose",
            "robot_two",
            "p_two",
        )

    def test_an_endpoint_is_multiplied_within_its_participant(self):
        read_system = system(
            "instances: {n: 2}\nparticipants: {fleet: {subscribes: {'/${n}/pose': }, publishes: {t: }}}"
        )
        assert [(endpoint.id, endpoint.template) for endpoint in read_system.endpoints] == [
            ("fleet/publisher/t", None),
            ("fleet/subscriber/1/pose", "fleet/subscriber/${n}/pose"),
            ("fleet/subscriber/2/pose", "fleet/subscriber/${n}/pose"),
        ]

    def test_several_variables_make_every_combination(self):
        text = "instances: {x: [a, b], y: 2}\nparticipants: {'${x}': {publishes: {'t${y}': , '${x}': }}}"
        assert ids(text) == [f"{x}/publisher/{topic}" for x in "ab" for topic in ("t1", "t2", x)]

    def test_copies_that_differ_in_settings_only_are_numbered(self):
        read_system = system("instances: {n: 2}\nparticipants: {a: {publishes: {t: [{depth: '${n}'}, {depth: 7}]}}}")
        assert [(e.id, e.template, texts(e.settings)) for e in read_system.endpoints] == [
            ("a/publisher/t", "a/publisher/t", {"depth": "1"}),
            ("a/publisher/t#2", "a/publisher/t", {"depth": "2"}),
            ("a/publisher/t#3", None, {"depth": "7"}),
        ]

    def test_variables_within_lists_maps_needs_and_given_ids(self):
        endpoints = system("""
            instances: {n: 2}
            participants:
              a:
                subscribes: {t: {id: "t${n}", partition: ["p${n}", q], where: {x: "${n}"}, needs: {max_age: "${n}s"}}}
            """).endpoints
        assert [endpoint.id for endpoint in endpoints] == ["t1", "t2"]
        assert texts(endpoints[1].settings) == {"partition": '["p2", q]', "where": '{x: "2"}'}
        assert texts(endpoints[1].needs) == {"max_age": "2s"}

    def test_start_order_lists_all_instances_or_ones_own(self):
        read_system = system("""
            instances: {n: 2}
            participants:
              "d${n}": {starts_after: "s${n}"}
              station: {starts_after: ["d${n}", x]}
            """)
        assert read_system.participants["d2"].starts_after == ("s2",)
        assert read_system.participants["station"].starts_after == ("d1", "d2", "x")

    def test_named_things_are_multiplied_by_their_names(self):
        read_system = system("""
            instances: {n: 2}
            profiles: {"p${n}": {profile: "q${n}", depth: "${n}"}}
            topics: {"t${n}": {period: "${n}s"}}
            brokers: {"b${n}": {}}
            bridges: {"x${n}": {routes: [{from: {participant: a, topic: "t${n}"}, to: {participant: b}}]}}
            checks: [{name: "c${n}", where: {topic: "t${n}"}, require: {depth: "${n}"}, because: so}]
            accept: [{rule: X, endpoint: "e${n}", because: so}]
            """)
        assert texts(read_system.profiles["p2"].settings) == {"depth": "2"}
        assert read_system.profiles["p2"].base[0].name == "q2"
        assert texts(read_system.topics["t2"].settings) == {"period": "2s"}
        assert list(read_system.brokers) == ["b1", "b2"]
        assert read_system.bridges["x2"].routes[0].source.topic == "t2"
        assert read_system.checks[1].where == (("topic", "t2"),)
        assert read_system.checks[1].require[0].values == ("2",)
        assert [accepted.endpoint for accepted in read_system.accept] == ["e1", "e2"]

    def test_groups_follow_their_participant(self):
        read_system = system("""
            instances: {n: 2, g: [x, y]}
            participants:
              "a${n}": {publishers: {"${g}": {partition: ["${n}${g}"], publishes: {"t${g}": }}}}
            """)
        assert {name: texts(profile.settings) for name, profile in read_system.profiles.items()} == {
            f"a{n}/publishers/{g}": {"partition": f'["{n}{g}"]'} for n in "12" for g in "xy"
        }
        assert [(endpoint.id, endpoint.profiles[0].name) for endpoint in read_system.endpoints] == [
            (f"a{n}/publisher/t{g}", f"a{n}/publishers/{g}") for n in "12" for g in "xy"
        ]

    def test_an_escaped_variable_is_text(self):
        read_system = system("instances: {n: 2}\nparticipants: {'$${n}': {x: '$${n}', publishes: {'$${': }}}")
        assert texts(read_system.participants["${n}"].settings) == {"x": "${n}"}
        assert [endpoint.id for endpoint in read_system.endpoints] == ["${n}/publisher/${"]

    def test_places_of_copies_are_those_of_the_template(self):
        endpoints = system("instances: {n: 2}\nparticipants: {'a${n}': {publishes: {t: }}}").endpoints
        assert {endpoint.place for endpoint in endpoints} == {Place("s.yaml", 3, 38)}

    def test_copies_with_one_name_are_refused(self):
        assert problems("instances: {x: [a, aa], y: [a, aa]}\nparticipants: {'${x}${y}': {}}") == [
            "3:16: participant `aaa` is stated twice, first at s.yaml:3:16 (keep one of them)"
        ]

    def test_as_many_as_allowed_are_made(self):
        assert len(system(f"instances: {{n: {MOST_INSTANCES}}}\nprofiles: {{'p${{n}}': }}").profiles) == MOST_INSTANCES

    def test_what_is_made_together_is_bounded(self):
        text = f"instances: {{n: {MOST_INSTANCES}}}\nprofiles: {{'p${{n}}': , 'q${{n}}': }}"
        assert problems(text) == [
            (
                "3:23: `instances` would make more than 100000 copies"
                " (list fewer instances, or mention fewer variables together)"
            )
        ]

    def test_the_length_of_what_is_made_is_bounded(self):
        long = "x" * 10_000
        text = f"instances: {{n: {MOST_INSTANCES}}}\nprofiles: {{'p${{n}}': {{s: '{long}${{n}}'}}}}"
        (problem,) = problems(text)
        assert "more than 100000000 characters" in problem

    def test_unknown_variable_is_reported_at_its_place(self):
        assert problems("instances: {drone: 2}\nparticipants: {a: {publishes: {'/fleet/${dron}/x': }}}") == [
            "3:40: there is no variable `${dron}`; did you mean `drone`? (instances: drone)"
        ]

    def test_a_variable_whose_instances_are_wrong_is_not_called_unknown(self):
        assert problems("instances: {n: 0}\nparticipants: {'a${n}': {}}") == [
            "2:16: `n` must stand for 1 to 100000 instances, found 0"
        ]


def test_problems_of_copies_are_cut_too():
    text = "instances: {x: 300, y: 300}\nprofiles: {'${x}${y}': }"
    assert "1000 problems" in problems(text)[-1]


def test_problems_beyond_a_thousand_are_cut():
    text = "profiles:\n" + "".join(f"  p{number}: x\n" for number in range(5000))
    found = problems(text)
    assert len(found) == 1001
    assert "1000 problems" in found[-1]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a: {publishes: {scan: {reliability:\u00a0best_effort}}}", "U+00A0 NO-BREAK SPACE"),
        ("a: {publishes: {scan: {reliability: best\u200b_effort}}}", "U+200B ZERO WIDTH SPACE"),
        ("a: {publishes: {scan: {\ufeffreliability: reliable}}}", "U+FEFF ZERO WIDTH NO-BREAK SPACE"),
        ("a: {publishes: {scan: {needs: {latest: true}}}}", "a publisher has no key `needs`"),
        ("a: {publishers: {scan: {reliability: best_effort}}}", "none here has `publishes`"),
        ("a: {subscribers: {scan: {}}}", "none here has `subscribes`"),
    ],
)
def test_what_would_be_lost_silently_is_refused_where_it_stands(text, said):
    with pytest.raises(InputError) as caught:
        read(Source("s.yaml", f"cqos: 1\nparticipants:\n  {text}\n".encode()), ReadContext())
    assert said in str(caught.value)
    assert caught.value.problems[0].place.line == 3


def test_an_odd_character_in_quotes_belongs_to_the_text():
    text = 'cqos: 1\nparticipants: {a: {label: "5\u00a0m"}}  # 5\u00a0m\n'
    assert read(Source("s.yaml", text.encode()), ReadContext()).participants["a"].label == "5\u00a0m"
