"""Random runs of the simulator contradict no finding about behaviour: of all cases, and of random models."""

from __future__ import annotations

import json
import os
from random import Random

import pytest

from tests.behaviour.model_text import model
from tests.behaviour.test_cases import cases
from tests.oracle.checks import CHECKED, NEVER, RATES, Oracle, holds, possible_faults
from tests.oracle.message_models import with_messages
from tests.oracle.random_models import random_model
from tests.oracle.record import DOCUMENT, REASONS, RECORDED, document, drawn
from tests.oracle.wild_models import wild_model

LONG = os.environ.get("CQOS_HYPOTHESIS") == "explore"
RUNS = 10_000 if LONG else 12
MODELS = 1_000 if LONG else 12
MODEL_RUNS = 200 if LONG else 12
WILD_STEPS = 600


@pytest.mark.explored
def test_no_run_of_a_case_contradicts_a_finding():
    wrong, seen = [], set()
    for each in cases():
        oracle = drawn(each.values[0])
        for number in range(RUNS if oracle.claims else 0):
            log = oracle.run(number)
            answers = {claim: holds(claim, log) for claim in oracle.claims}
            wrong += [f"{each.id}: {claim}: run {number}" for claim, answer in answers.items() if answer is False]
            seen |= {claim.code for claim, answer in answers.items() if answer}
    assert wrong == []
    assert seen >= {*NEVER, *RATES, "BP106", "BP107", "BP109", "BP118"}


@pytest.mark.explored
def test_no_run_of_a_random_model_contradicts_a_finding():
    wrong, claims = [], 0
    for seed in range(MODELS):
        oracle = Oracle(model(random_model(Random(seed))))  # noqa: S311
        claims += len(oracle.claims)
        for number in range(MODEL_RUNS if oracle.claims else 0):
            log = oracle.run(number)
            wrong += [f"model {seed}: {claim}: run {number}" for claim in oracle.claims if holds(claim, log) is False]
    assert wrong == []
    assert claims > MODELS / 3


@pytest.mark.explored
def test_no_run_of_a_wild_model_contradicts_a_finding():
    wrong, claims = [], 0
    for seed in range(MODELS):
        oracle = Oracle(model(wild_model(Random(seed))))  # noqa: S311
        claims += len(oracle.claims)
        for number in range(MODEL_RUNS // 3 if oracle.claims else 0):
            log = oracle.run(number, steps=WILD_STEPS)
            wrong += [f"model {seed}: {claim}: run {number}" for claim in oracle.claims if holds(claim, log) is False]
    assert wrong == []
    assert claims > MODELS


@pytest.mark.explored
def test_no_run_of_a_random_model_with_message_flows_contradicts_a_finding():
    wrong, claims = [], 0
    for seed, make in ((seed, make) for seed in range(MODELS) for make in (random_model, wild_model)):
        random = Random(seed)  # noqa: S311
        oracle = Oracle(model(with_messages(random, make(random))))
        claims += len(oracle.claims)
        for number in range(MODEL_RUNS // 2 if oracle.claims else 0):
            log = oracle.run(number, steps=WILD_STEPS)
            wrong += [f"model {seed}: {claim}: run {number}" for claim in oracle.claims if holds(claim, log) is False]
    assert wrong == []
    assert claims > MODELS


def test_the_simulator_shows_a_contradiction_where_there_is_one():
    """A claim that is wrong on purpose: a throw that the model reaches never fires, by this claim."""
    oracle = Oracle(model({"A": "s: start\n p: end x\n s -> p", "B": "c: start x"}))
    never = oracle.claim("BP111", ("p",))
    assert never is not None
    assert never in possible_faults(oracle)
    assert holds(never, oracle.run(0)) is False
    assert set(CHECKED) >= {"BP101", "BP110"}


def test_every_silent_twin_has_a_run_or_a_reason():
    without = json.loads(RECORDED.read_text(encoding="utf-8"))["examples"]["without"]
    assert {each.split(": ")[-2] for each in without} <= REASONS.keys()


def test_the_page_is_what_was_recorded():
    assert DOCUMENT.read_text(encoding="utf-8") == document(), "run: python -m tests.oracle.record"
