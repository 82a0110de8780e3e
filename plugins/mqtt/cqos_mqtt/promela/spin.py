"""Asks SPIN about the model of a pair, and reads its counterexamples back; see `cqos_core.packs.prover.Prover`."""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Final

from cqos_core.packs.prover import FAULTS, Event, NotRunnableError, Outcome, Plan
from cqos_mqtt.promela.constants import MESSAGES, Scene, model, needs_of, scenes
from cqos_mqtt.runnable_pairs import ensure_runnable

_DEPTHS: Final = (80, 120, 160, 220, 300)
"""Bounds of the search for a shorter counterexample, once there is one."""
_DEEPEST: Final = 100_000
_PATIENCE: Final = 600
"""Seconds that one verification may take."""
_COMPILER: Final = ("gcc", "-O0", "-w", "-DNOFAIR", "-DVECTORSZ=2048", "-DMEMLIM=2000", "-o", "pan", "pan.c")
_STEP: Final = re.compile(r"^\s*@ (\w+) (\w+)(?: (\d+))?$", re.MULTILINE)
_ANSWER: Final = re.compile(r"errors: (\d+)")
_SAID: Final = {
    "sends": "sends message {}",
    "sends_again": "sends message {} again",
    "sends_anew": "publishes message {} once more in its new session",
    "is_not_connected": "is not connected; message {} is lost",
    "forgets": "forgets message {}, which is not acknowledged",
    "notices_break": "notices that its connection is broken",
    "resumes_session": "connects; its session goes on",
    "begins_session": "connects; its session is new",
    "subscribes": "subscribes",
    "gets": "gets message {}",
    "gets_will": "gets the Will",
    "killed": "is killed",
    "started": "starts again",
    "leaves": "disconnects and is away",
    "takes_again": "takes messages again",
    "lost": "is lost, and no packet says so",
    "loses": "loses message {} on its way",
    "loses_answer": "loses the answer to message {}",
    "cut": "is cut",
    "restored": "works again",
    "stopped": "ends in order",
    "saves": "saves its state",
    "drops": "drops message {}, which has QoS 0",
    "has_no_room": "has no room for message {} and drops it",
    "has_no_subscription": "has no subscription for message {}",
    "sends_to_other_member": "sends message {} to another member of the share group",
    "expires": "drops message {}, which has expired",
    "ends_session": "ends the session of the subscriber, with {} messages in it",
    "keeps_what_waits": "keeps what waits for longer than the subscriber allows",
    "notices_loss": "notices that the publisher is gone",
    "sends_will": "sends the Will of the publisher",
    "has_no_will": "has no Will for the subscriber",
}
"""What the model prints, in words."""


class Spin:
    """Answers for all runs of a model, where other provers show one run of a program."""

    title = "SPIN"
    faults = frozenset(FAULTS)
    assumes: Mapping[str, str] = MappingProxyType({})

    def __init__(self, messages: int = MESSAGES, *, shows: bool = True) -> None:
        """``messages``: how many the model sends; fewer take less time. ``shows``: whether to read counterexamples back."""
        self.messages, self.shows = messages, shows

    def missing(self) -> str | None:
        """Say how to install SPIN and a C compiler where they are not there."""
        absent = [program for program in ("spin", "gcc") if shutil.which(program) is None]
        return (
            f"not installed: {' and '.join(absent)}; install the packages `spin` and `gcc` of your system"
            if absent
            else None
        )

    def prove(self, plan: Plan, report: Callable[[Event], None] = lambda _event: None) -> Outcome:
        """Check each guarantee in all runs of the model.

        Raises:
            NotRunnableError: SPIN or a compiler is missing or fails, or the model has no such publication.
        """
        if missing := self.missing():
            raise NotRunnableError(missing)
        ensure_runnable(plan)
        answers: dict[str, bool] = {}
        events: list[Event] = []
        fault = "connected" if plan.fault is None else plan.fault.kind
        with tempfile.TemporaryDirectory(prefix="cqos-spin-") as name:
            for scene, words in scenes(fault, needs_of(plan)).items():
                search = _Search(Path(name), plan, scene, self.messages)
                for word in words:
                    answers[word] = search.holds(word)
                    if answers[word] or not self.shows or (plan.needs and word not in plan.needs):
                        continue
                    for event in (Event(None, "SPIN", f"breaks {word}"), *search.counterexample(word)):
                        events.append(event)
                        report(event)
        return Outcome(f"SPIN {version()}", tuple(events), matched=True, answers=answers)


SPIN: Final = Spin()


class _Search:
    """The verifier of one scene, as a program in a folder of its own."""

    def __init__(self, folder: Path, plan: Plan, scene: Scene, messages: int) -> None:
        self.folder = folder
        (folder / "model.pml").write_text(model(plan), encoding="utf-8")
        for each in folder.glob("pan*"):
            each.unlink()
        _output(folder, ["spin", f"-DALL={messages}", *scene.defines(), "-a", "model.pml"])
        if not (folder / "pan.c").exists():
            raise NotRunnableError("SPIN does not read the model")
        _output(folder, _COMPILER)

    def holds(self, word: str) -> bool:
        """Return whether all runs keep a guarantee."""
        return not self._broken(word, _DEEPEST)

    def counterexample(self, word: str) -> tuple[Event, ...]:
        """Return the steps of a short run that breaks a guarantee."""
        any(self._broken(word, depth) for depth in (*_DEPTHS, _DEEPEST))
        replay = _output(self.folder, ["./pan", "-r", "-N", word])
        return tuple(Event(None, who, _SAID[what].format(number)) for who, what, number in _STEP.findall(replay))

    def _broken(self, word: str, depth: int) -> bool:
        for trail in self.folder.glob("*.trail"):
            trail.unlink()
        said = _output(self.folder, ["./pan", "-a", "-E", "-w20", f"-m{depth}", "-N", word])
        found = _ANSWER.search(said)
        deep = depth == _DEEPEST and "max search depth too small" in said
        if found is None or deep or "violated (next_slot" in said or "reached memory limit" in said.lower():
            raise NotRunnableError(f"SPIN gives no answer on {word}: {' '.join(said.split())[:300]}")
        return found[1] != "0"


def _output(folder: Path, command: Sequence[str]) -> str:
    """Run a program in a folder, and return what it prints."""
    try:
        done = subprocess.run(  # noqa: S603 - the programs of SPIN and the compiler
            command, cwd=folder, capture_output=True, text=True, errors="replace", check=False, timeout=_PATIENCE
        )
    except subprocess.TimeoutExpired:
        raise NotRunnableError(f"`{command[0]}` takes longer than {_PATIENCE} s") from None
    if command[0] == "gcc" and done.returncode:
        raise NotRunnableError(f"the compiler refuses the verifier: {' '.join(done.stderr.split())[:300]}")
    return done.stdout + done.stderr


def version() -> str:
    """Return the version of SPIN; empty where it is not installed."""
    if shutil.which("spin") is None:
        return ""
    said = subprocess.run(["spin", "-V"], capture_output=True, text=True, check=False).stdout  # noqa: S607
    found = re.search(r"Version (\S+)", said)
    return found[1] if found else ""
