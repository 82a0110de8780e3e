"""Systems written as YAML system files: what is read back is what was written."""

from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import cqos_core as cqos
from cqos_core.analysis.explanation import endpoints_of
from cqos_core.api import context
from cqos_core.files.yaml_design import design_of
from cqos_core.files.yaml_writer import write
from cqos_core.language.values import Anything
from cqos_core.model.settings import Place, Setting
from cqos_core.model.system import (
    Acceptance,
    Bound,
    Bridge,
    Broker,
    Endpoint,
    Overlay,
    Participant,
    Profile,
    ProfileRef,
    Route,
    Scope,
    System,
    TeamRule,
    Topic,
)
from cqos_core.packs.export import ExportContext
from tests.made_up_protocol import CONTEXT, checked, reader, settings, world, writer

ROOT = Path(__file__).resolve().parents[2]
INCIDENTS = ROOT / "examples" / "incidents"
TOGETHER = ROOT / "examples" / "robot_directory"  # its files are one system
EXAMPLES = sorted(
    path
    for path in (ROOT / "examples").rglob("*")
    if path == TOGETHER
    or (
        path.suffix in {".bpmn", ".yaml"}
        and "pack" not in path.name
        and not {TOGETHER, ROOT / "examples" / "robot_workspace", ROOT / "examples" / "modeler_client"}
        & {*path.parents}
        # Beside its system file an incident has parts. Of parameters and overrides nothing is left to write without it.
        and (INCIDENTS not in path.parents or path.name in {"system.yaml", "bridge.yaml", "metadata.yaml"})
    )
)
INSTALLED = ExportContext(context().find_pack, find_rule=context().find_rule)
POST = ExportContext(CONTEXT.find_pack)


def plain(value):
    """A value without the places in it, whether there is room at them, nor what files it came from."""
    if isinstance(value, System):
        value = replace(value, sources={}, notes=[])
    if isinstance(value, (Broker, Endpoint, Participant, Profile)):
        value = replace(value, room=None)
    if isinstance(value, Place):
        return None
    if is_dataclass(value):
        name = "Endpoint" if isinstance(value, Endpoint) else type(value).__name__
        return name, {each.name: plain(getattr(value, each.name)) for each in fields(value)}
    if isinstance(value, dict):
        return {key: plain(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    return value


def by_id(system):
    """A system with its endpoints in an order that does not depend on the file."""
    return replace(system, endpoints=sorted(system.endpoints, key=lambda each: each.id))


def comparable(report):
    """Return all of a report that the form keeps: no places, no edits, no name of the system."""
    pairs = [(pair.topic, pair.publisher, pair.subscriber, pair.verdict) for pair in report.pairs]
    findings = [
        (
            each.code,
            each.severity,
            each.message,
            each.topic,
            each.accepted,
            tuple(
                (side.role, side.members, tuple((f.policy, f.value, f.origin) for f in side.facts))
                for side in each.sides
            ),
            tuple(replace(remedy, edits=()) for remedy in each.remedies),
        )
        for each in report.findings
    ]
    # Without places two findings may be one.
    return report.verdict, pairs, sorted({repr(each) for each in findings}), report.endpoints, report.topics


# Any system, with any text in it

WORDS = """null ~ true no 10 1e3 1:30 ${x} $${x} $ { } [ ] [a] ... --- << *a &a !a @ ` ' " % ? | > 日本 2027-01-01 .inf
    id type profile options label publishes [a,b] a:b #a \\ = <<"""
HOSTILE = [
    "{sec: 2, nsec: 0}",
    "[a, b]",
    "a: b",
    "a #b",
    "- a",
    "? a",
    "\t",
    "\n",
    "a\n  b",
    "\x85",
    "\u2028",
    "\ufeff",
    "\0",
]
TEXTS = st.one_of(
    st.sampled_from([*WORDS.split(), *HOSTILE, "a" * 1200]),
    st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=8),
)
SETTINGS = st.dictionaries(TEXTS, TEXTS.map(Setting), max_size=4)
NEEDS = SETTINGS
REFS = st.lists(TEXTS.map(ProfileRef), max_size=2).map(tuple)
FLAGS = st.booleans()
MAYBE = st.none() | TEXTS
STARTS = st.lists(TEXTS, max_size=2).map(tuple)
RELATIONS = st.sampled_from(["exactly", "at_least", "at_most", "one_of", "not"])


@st.composite
def bounds(draw):
    relation = draw(RELATIONS)
    several = relation in {"one_of", "not"}
    values = draw(st.lists(TEXTS, min_size=1, max_size=3 if several else 1))
    if relation == "not" and len(values) == 1 and values[0].startswith("["):
        values = ["x"]
    return Bound(draw(TEXTS), relation, tuple(values))


@st.composite
def teams(draw):
    where = draw(st.dictionaries(st.sampled_from(["role", "topic", "id", "type"]), TEXTS, max_size=2))
    if "role" in where:
        where["role"] = "publisher"
    order = ("role", "topic", "participant", "protocol", "type", "id")
    required: dict[str, dict[str, Bound]] = {}
    for bound in draw(st.lists(bounds(), max_size=3)):
        required.setdefault(bound.policy, {}).setdefault(bound.relation, bound)
    require = tuple(bound for relations in required.values() for bound in relations.values())
    sentence = draw(TEXTS) if not require else draw(MAYBE)
    severity = draw(st.sampled_from(["error", "warning", "note"]))
    patterns = tuple((key, where[key]) for key in order if key in where)
    return TeamRule(draw(TEXTS), patterns, require, draw(TEXTS), sentence, severity)


@st.composite
def endpoints(draw, participant):
    role = draw(st.sampled_from(["publisher", "subscriber"]))
    kind = draw(
        st.sampled_from(["message", "message", "service_server", "service_client", "action_server", "action_client"])
    )
    if kind != "message":
        role = "subscriber" if kind.endswith("server") else "publisher"
    return Endpoint(
        id=draw(TEXTS),
        role=role,
        topic=draw(TEXTS),
        participant=participant,
        settings=draw(SETTINGS),
        profiles=draw(REFS),
        needs=draw(NEEDS),
        type=draw(MAYBE),
        kind=kind,
        observed=draw(FLAGS),
        external=draw(FLAGS),
        starts_after=draw(STARTS),
        protocol=draw(MAYBE),
        label=draw(MAYBE),
    )


SIDES = st.builds(
    lambda role, participant, topic, given, settings, refs, type_, label, external: Endpoint(
        id=given,
        role=role,
        topic=topic,
        participant=participant,
        settings=settings,
        profiles=refs,
        type=type_,
        label=label,
        external=external,
    ),
    *(st.just("subscriber"), TEXTS, MAYBE, st.just("") | TEXTS, SETTINGS, REFS, MAYBE, MAYBE, FLAGS),
)
EXPRESSIONS = st.sampled_from([(), ("/tf",), (".*/pose", "/x{2}")])
ROUTES = st.lists(
    st.builds(
        lambda source, target, kinds, only, but: Route(
            replace(source, kind=kinds[0]), replace(target, role="publisher", kind=kinds[1]), None, only, but
        ),
        *(SIDES, SIDES, st.sampled_from([("message", "message"), ("action_server", "action_client")])),
        *(EXPRESSIONS, EXPRESSIONS),
    ),
    min_size=1,
    max_size=2,
).map(tuple)


def named(thing):
    """A dictionary of things by their names."""
    return st.lists(TEXTS, unique=True, max_size=3).flatmap(
        lambda names: st.tuples(*(thing(name) for name in names)).map(lambda made: dict(zip(names, made, strict=True)))
    )


@st.composite
def systems(draw):
    system = System(
        name=draw(st.just("") | TEXTS.filter(lambda text: "${" not in text)),
        protocol=draw(st.none() | st.sampled_from(["ros2", "nobody's"])),
        options=draw(
            st.dictionaries(
                st.sampled_from(["ros2", "x"]), SETTINGS.filter(lambda s: s and "${" not in repr(s)), max_size=2
            )
        ),
        profiles=draw(named(lambda name: st.builds(Profile, st.just(name), SETTINGS, REFS))),
        topics=draw(named(lambda name: st.builds(Topic, st.just(name), SETTINGS, FLAGS, MAYBE))),
        brokers=draw(named(lambda name: st.builds(Broker, st.just(name), MAYBE, SETTINGS, REFS))),
        bridges=draw(
            named(lambda name: st.builds(Bridge, st.just(name), ROUTES, st.sampled_from([(), ("liveliness",)])))
        ),
        severities=draw(st.dictionaries(st.sampled_from(["ROS101", "x y"]), st.sampled_from(["off", "note"]))),
        checks=draw(st.lists(teams(), max_size=2, unique_by=lambda each: each.name)),
        accept=draw(
            st.lists(st.builds(Acceptance, TEXTS, TEXTS, MAYBE, MAYBE, st.none() | st.just("2027-01-31")), max_size=2)
        ),
    )
    system.participants = draw(
        named(
            lambda name: st.builds(
                Participant,
                st.just(name),
                MAYBE,
                SETTINGS,
                st.dictionaries(TEXTS, TEXTS, max_size=2),
                FLAGS,
                STARTS,
                label=MAYBE,
            )
        )
    )
    for name in system.participants:
        system.endpoints += draw(st.lists(endpoints(name), max_size=3))
    return system


def without_capitals(system):
    """Names of settings are read whatever their case; those like keys are written with a capital."""
    routes = [end for each in system.bridges.values() for route in each.routes for end in (route.source, route.target)]
    named = (*system.topics.values(), *system.profiles.values(), *system.brokers.values())
    for each in (*system.endpoints, *routes, *named):
        each.settings = {name.lower(): setting for name, setting in each.settings.items()}
    return system


@given(systems())
def test_what_is_written_is_read_back(system):
    before = plain(system)
    exported = write(system, INSTALLED)
    assert plain(system) == before, "the system was changed"
    design = design_of(system, INSTALLED).system
    again = cqos.read(exported.text.encode())
    for each in (design, again):
        without_capitals(each)
        for participant in each.participants.values():
            # A protocol that is the file's own need not be repeated, nor has it to be.
            participant.protocol = participant.protocol or each.protocol
        for broker in each.brokers.values():
            broker.protocol = broker.protocol or each.protocol
    assert again.notes == [], "no trap of YAML is met"
    assert plain(by_id(again)) == plain(by_id(design))


# Systems of a protocol that is judged

POLICIES = {
    "reliability": ["reliable", "best_effort", "system_default", "best_available", "RELIABLE", "unknown"],
    "durability": ["volatile", "transient_local"],
    "deadline": ["1s", "500ms", "infinite", "{sec: 1, nsec: 5}", "oops"],
    "lease_duration": ["2s"],
    "liveliness": ["automatic", "manual_by_topic"],
    "depth": ["1", "0", "10"],
    "history": ["keep_last", "keep_all"],
    "lifespan": ["10s"],
    "colour": ["blue"],
}
STATED = st.fixed_dictionaries({}, optional={name: st.sampled_from(v).map(Setting) for name, v in POLICIES.items()})
NAMES = st.sampled_from(["/scan", "scan", "~/pose", "Scan", "a b", "/map", "ns/${x}"])


@st.composite
def robots(draw):
    system = System(
        "robot", "ros2", {"ros2": draw(st.sampled_from([{}, settings(rmw="fastdds"), settings(distro="foxy")]))}
    )
    system.profiles = {name: Profile(name, draw(STATED)) for name in ("fast", "default")}
    for name in ("a", "/ns/b"):
        system.participants[name] = Participant(name, settings=draw(st.sampled_from([{}, settings(namespace="/x")])))
        for number in range(draw(st.integers(0, 3))):
            role = draw(st.sampled_from(["publisher", "subscriber"]))
            topic = draw(NAMES)
            refs = draw(st.lists(st.sampled_from(["fast", "default", "sensor_data", "nowhere"]), max_size=2))
            system.endpoints.append(
                Endpoint(
                    id=f"{name}/{role}/{topic}#{number}" if draw(FLAGS) else f"{name}{number}",
                    role=role,
                    topic=topic,
                    participant=name,
                    settings=draw(STATED),
                    profiles=tuple(map(ProfileRef, refs)),
                    observed=draw(FLAGS),
                    type=draw(st.sampled_from([None, "std_msgs/String"])),
                )
            )
    return system


@given(robots())
def test_the_report_stays_the_same(system):
    text = write(system, INSTALLED).text
    assert comparable(cqos.check(text.encode())) == comparable(cqos.check(system))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_examples_keep_their_reports(path):
    system = cqos.read(path)
    again = cqos.read(write(system, INSTALLED).text.encode())
    before, after = cqos.check(system), cqos.check(again)
    assert after.verdict == before.verdict
    assert sorted((p.publisher, p.subscriber, p.verdict) for p in after.pairs) == sorted(
        (p.publisher, p.subscriber, p.verdict) for p in before.pairs
    )
    assert not_read(after) == not_read(before)
    if path.suffix == ".yaml":
        assert count_by_code(after) == count_by_code(before)


def not_read(report):
    """What was not read, without places, and how many parts of each kind there are."""
    return [replace(each, place=None) for each in report.coverage.unread], dict(report.coverage.totals)


def count_by_code(report):
    """How many endpoints each code speaks of: findings about instances of one template are one finding or several."""
    found: dict[tuple[str, str], set[str]] = {}
    for each in report.findings:
        found.setdefault((each.code, each.severity), set()).update(each.endpoints or {each.message})
    return found


# What is translated


def test_dialects_become_words():
    system = world(
        writer("t", "w", "shared", more={"dialect": "form"}, sorgfalt="2", delay="5", colour="red", copies="0"),
        reader("t", "r", "shared", more={"dialect": "yaml"}),
        Profile("shared", settings(delay="7s", care="1")),
    )
    design = design_of(system, POST).system
    assert {name: each.text for name, each in design.endpoints[0].settings.items()} == {"care": "signed", "delay": "5s"}
    assert [ref.name for ref in design.endpoints[0].profiles] == ["shared"]
    assert [ref.name for ref in design.endpoints[1].profiles] == ["shared-yaml"]
    assert design.profiles["shared"].settings["care"].text == "plain"
    assert design.profiles["shared-yaml"].settings["care"].text == "1"


def test_names_in_free_text_become_those_they_are_checked_as():
    bpmn = cqos.read(ROOT / "examples" / "smart_agriculture.bpmn")
    bpmn.topics["Req weather data"] = Topic("Req weather data", settings(period="6h"))
    bpmn.accept.append(Acceptance("ROS201", "not wanted", "Resp weather data"))
    design = design_of(bpmn, INSTALLED).system
    assert {each.topic for each in design.endpoints} == {"/req_weather_data", "/resp_weather_data"}
    assert {name: each.name for name, each in design.topics.items()} == {"/req_weather_data": "/req_weather_data"}
    assert design.accept[-1].topic == "/resp_weather_data"


def test_needs_of_a_publisher_are_left_out_and_said():
    system = world(writer("t", "w"), reader("t", "r"))
    for end in system.endpoints:
        end.needs = settings(loss_free="yes")
    exported = write(system, POST)
    assert exported.notes == ("endpoint `w` publishes, and only subscribers have needs: its needs are left out",)
    again = {end.id: set(end.needs) for end in cqos.read(exported.text.encode()).endpoints}
    assert again == {"w": set(), "r": {"loss_free"}}


def test_overlays_are_laid_over_and_said():
    system = world(
        writer("t", "w", delay="1s", care="signed"),
        reader("t", "r"),
        overlays=[
            Overlay("the law", {"delay": Setting("3", Place("law.txt", 3))}, "publisher", dialect="form"),
            Overlay("nobody's", settings(care="plain"), topic="elsewhere"),
            Overlay("by ship", settings(care="plain"), when=("carrier", "ship")),
        ],
    )
    exported = write(system, POST)
    assert "t: {id: w, care: signed, delay: 3s}  # delay from the law (law.txt:3)\n" in exported.text
    assert exported.notes == (
        "endpoint `w`: overlays under an option that is not set are left out",
        "endpoint `r`: overlays under an option that is not set are left out",
        "nobody's covers no endpoint",
    )
    again = checked(cqos.read(exported.text.encode()))
    assert again.verdict == checked(replace(system, overlays=system.overlays[:1])).verdict


def test_notes_name_what_the_form_cannot_hold():
    system = world(writer(None, "nameless"), writer("t", "strange", more={"kind": "telegram"}), writer("t", "w"))
    system.name = "a ${b}"
    system.checks = [TeamRule("empty", (), (), "why")]
    exported = write(system, POST)
    assert exported.expressed == 1
    assert exported.notes == (
        "endpoint `nameless` names no topic, so there is no place for it",
        "endpoint `strange` is a telegram, for which the form has no key",
        "the name of the system `a ${b}` loses its `$`, which would begin a variable",
        "check `empty` requires nothing",
    )
    assert cqos.read(exported.text.encode()).name == "a {b}"


def test_equal_ids_of_several_sources_are_made_unique():
    system = world(writer("t", "w"), writer("u", "w"))
    again = cqos.read(write(system, POST).text.encode())
    assert [each.id for each in again.endpoints] == ["w", "w~2"]


def test_it_is_pleasant_to_read():
    system = world(
        writer("t", "shop/publisher/t", care="signed"),
        writer("t", "shop/publisher/t#2"),
        reader("t", "home/subscriber/t", "careful", more={"observed": True}),
        reader("u", "reader", "careful", "standard", delay="1s", more={"needs": settings(latest=True), "label": "Ann"}),
        Profile("long", settings(**{f"a_rather_long_name_{number}": "and a value" for number in range(4)})),
    )
    system.sources = {"a.yaml": b"", "b\nc.yaml": b""}
    assert (
        write(system, POST).text
        == """\
# From a.yaml, b\\nc.yaml
cqos: 1
system: world
protocol: post

profiles:
  long:
    a_rather_long_name_0: and a value
    a_rather_long_name_1: and a value
    a_rather_long_name_2: and a value
    a_rather_long_name_3: and a value

participants:
  shop:
    publishes:
      t: [{care: signed}, {}]
  home:
    subscribes:
      t: {profile: careful, observed: true}
  reader:
    subscribes:
      u: {id: reader, label: Ann, profile: [careful, standard], delay: 1s, needs: {latest: true}}
"""
    )


def test_unused_parts_of_profiles_are_written_with_a_note():
    base = (ProfileRef("p/part", None, Scope("publisher")),)
    library = System(protocol="ros2", profiles={"p": Profile("p", {}, base), "p/part": Profile("p/part", {})})
    assert write(library, INSTALLED).notes == (
        "which endpoints a part of a profile is meant for cannot be said, so each part is a profile of its own",
    )


FIELDS = ("history", "depth", "reliability", "durability", "deadline", "lifespan", "liveliness", "leaseDuration")


def test_a_value_that_depends_on_an_assumption_is_written_as_not_known():
    zeros = " ".join(f'qos:{name}="0"' for name in FIELDS)
    model = f"""<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" xmlns:qos="http://qos">
      <process id="P"><intermediateThrowEvent id="T" {zeros}><signalEventDefinition signalRef="S"/></intermediateThrowEvent>
      </process><process id="Q"><intermediateCatchEvent id="U" qos:reliability="reliable"><signalEventDefinition
      signalRef="S"/></intermediateCatchEvent></process><signal id="S" name="topic"/></definitions>"""
    system = cqos.read(model.encode(), protocol="ros2")
    text = write(system, INSTALLED).text
    assert "history: keep_last" in text
    assert "it depends on what eight zeros mean: best_effort if they were chosen or reliable if they" in text
    assert cqos.check(system).verdict == cqos.check(text.encode()).verdict == "unknown"


DESIGNS = sorted(path for path in (ROOT / "tests" / "decisive" / "designs").iterdir() if path.is_dir())
NOT_KNOWN = {
    "an XML profile with a base elsewhere": """<dds xmlns="http://www.omg.org/spec/DDS-XML"><qos_library name="L">
      <qos_profile name="P" base_name="Elsewhere::Base"><datawriter_qos><durability><kind>TRANSIENT_LOCAL_DURABILITY_QOS</kind>
      </durability></datawriter_qos><datareader_qos><deadline><period><sec>$(PERIOD)</sec></period></deadline></datareader_qos>
      </qos_profile></qos_library></dds>""",
    "a system file": """{cqos: 1, protocol: dds, options: {dds: {implementation: {unknown: nothing says which}}}, topics: {t: {period: {unknown:
      'the $${X} of it'}}}, participants: {a: {publishes: {t: {'*': {unknown: 'it is generated: "here"'}}}}, b: {subscribes: {t: {}}}}}""",
}


def values(system):
    """Every value of every endpoint, or why it is not known."""
    return {
        each.id: [
            value.cause if isinstance(value, Anything) else value
            for value, _ in zip(each.profile.values, each.pack.policies, strict=False)
        ]
        for each in endpoints_of(system, context())
    }


@pytest.mark.parametrize("design", [*DESIGNS, *NOT_KNOWN.values()], ids=[*(path.name for path in DESIGNS), *NOT_KNOWN])
def test_what_is_written_has_the_same_values_and_the_same_causes_of_not_knowing(design):
    system = cqos.read(design.encode() if isinstance(design, str) else design)
    again = cqos.read(write(system, INSTALLED).text.encode())
    assert values(again) == values(system)


def test_a_value_that_is_not_known_is_read_as_such():
    system = cqos.read(NOT_KNOWN["a system file"].encode())
    assert system.topics["t"].settings["period"].unknown == "the ${X} of it"
    assert "CQ217" in {each.code for each in cqos.check(system).findings}


STATIC = """<dds xmlns="http://www.eprosima.com"><profiles><participant profile_name="p" is_default_profile="true"><rtps><builtin>
<discovery_config><EDP>STATIC</EDP></discovery_config></builtin></rtps></participant></profiles></dds>"""


def test_a_value_that_an_overlay_leaves_unknown_stays_so(tmp_path):
    (tmp_path / "fast.xml").write_text(STATIC)
    (tmp_path / "system.yaml").write_text(
        "cqos: 1\nprotocol: ros2\noptions: {ros2: {rmw: fastdds}}\ninclude: fast.xml\n"
        "participants: {a: {publishes: {/t: {}}}, b: {subscribes: {/t: {}}}}\n"
    )
    system = cqos.read(tmp_path / "system.yaml")
    again = cqos.read(write(system, INSTALLED).text.encode())
    assert cqos.check(system).verdict == "unknown"
    assert values(again) == values(system)
