"""Formulas as constraints of CP-SAT: the choices of least weight, and conflicting sets where nothing is possible."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import field
from typing import Any, Final, NamedTuple

from cqos_core.model.dataclass import dataclass
from cqos_core.model.problems import CqosError
from cqos_planning.formulas import AllOf, AnyOf, Formula, Table, Variable

_SECONDS: Final = 120.0


class Solution(NamedTuple):
    """Choices by place.

    Attributes:
        chosen: number of the choice, of places that change.
        weight: in total.
        proven: no choices have less.
        given_up: units that are not reached.
    """

    chosen: Mapping[Hashable, int]
    weight: int
    proven: bool
    given_up: frozenset[Hashable] = frozenset()


@dataclass(frozen=True, slots=True)
class Task:
    """The input of the solver.

    Attributes:
        weights: per place the weight of each choice; choice 0 leaves it as it is.
        formulas: conditions that have to hold, each with its name in a conflicting set.
        pins: places that must not change, each with its cause.
        cuts: combinations of choices that a check refused, each with its name.
        units: by name of a formula or cut, the parts of the goal with which it is given up; the others always have to hold.
        worth: per unit, how much is lost where it is given up.
        rests_on: units that are reached only with another one.
        most: the greatest weight; None: any.
    """

    weights: Mapping[Hashable, Sequence[int]]
    formulas: Sequence[tuple[Hashable, Formula]]
    pins: Mapping[Hashable, Hashable] = field(default_factory=dict)
    cuts: Sequence[tuple[Hashable, Mapping[Hashable, int]]] = ()
    units: Mapping[Hashable, Sequence[Hashable]] = field(default_factory=dict)
    worth: Mapping[Hashable, int] = field(default_factory=dict)
    rests_on: Sequence[tuple[Hashable, Hashable]] = ()
    most: int | None = None


def solve(task: Task, *, give_up: bool = False) -> Solution | None:
    """Return the choices of least weight; None where nothing is possible.

    Args:
        task: the task.
        give_up: units may be given up, of the least worth; of equal worth the least weight decides.

    Raises:
        CqosError: OR-tools is not installed, or found no answer in time.
    """
    problem = _Problem(task, give_up=give_up)
    weighted = [
        weight * literal
        for place, weights in task.weights.items()
        for weight, literal in zip(weights, problem.places[place], strict=True)
        if weight
    ]
    total = sum(weighted)
    if task.most is not None:
        problem.model.add(total <= task.most)
    heaviest = 1 + sum(max(weights) for weights in task.weights.values())
    lost = sum(heaviest * task.worth[unit] * literal for unit, literal in problem.given_up.items())
    problem.model.minimize(total + lost)
    status, solver = problem.run()
    if status == "INFEASIBLE":
        return None
    if status not in {"OPTIMAL", "FEASIBLE"}:
        raise CqosError(f"the solver found no answer within {_SECONDS:.0f} s", "repair fewer files at a time")
    chosen = {
        place: number
        for place, literals in problem.places.items()
        for number, literal in enumerate(literals)
        if number and solver.boolean_value(literal)
    }
    weight = sum(weights[chosen.get(place, 0)] for place, weights in task.weights.items())
    given_up = frozenset(unit for unit, literal in problem.given_up.items() if solver.boolean_value(literal))
    return Solution(chosen, weight, status == "OPTIMAL", given_up)


def conflict(task: Task, without: Collection[Hashable] = ()) -> list[Hashable]:
    """Return names of parts that exclude each other; without any one of them, the others can be reached.

    Args:
        task: a task without solution.
        without: units to leave out; the result is empty where the rest can be reached.
    """
    stated = [*(name for name, _ in task.formulas), *task.pins.values(), *(name for name, _ in task.cuts)]
    whole = [name for name in dict.fromkeys(stated) if not any(unit in without for unit in task.units.get(name, ()))]
    left = _core(task, whole) or []
    for name in [*left]:
        fewer = _core(task, [each for each in left if each != name]) if name in left else None
        left = left if fewer is None else fewer
    return left


def _core(task: Task, names: Sequence[Hashable]) -> list[Hashable] | None:
    """Return some of the named parts that exclude each other; None where all of them can be reached."""
    problem = _Problem(task, names=frozenset(names))
    problem.model.add_assumptions([problem.guards[name] for name in names if name in problem.guards])
    status, solver = problem.run()
    if status != "INFEASIBLE":
        return None
    by_index = {guard.index: name for name, guard in problem.guards.items()}
    found = {by_index[index] for index in solver.sufficient_assumptions_for_infeasibility()}
    return [name for name in names if name in found]


def load() -> Any:
    """Return the module of CP-SAT.

    Raises:
        MissingError: it is not installed, with the line that installs it.
    """
    try:
        from ortools.sat.python import cp_model
    except ImportError as error:
        from cqos_core.model.optional_features import missing

        raise missing("planning", f"plans need OR-tools, which is not installed ({error})") from None
    return cp_model


class _Problem:
    """A task in terms of CP-SAT; with ``names`` only these parts, and each holds only where its guard does."""

    def __init__(self, task: Task, *, names: Collection[Hashable] | None = None, give_up: bool = False) -> None:
        self.cp = load()
        self.model = self.cp.CpModel()
        self.guards: dict[Hashable, Any] = {}
        self.places: dict[Hashable, list[Any]] = {}
        self.names = names
        self.units = task.units if give_up else {}
        self.given_up = {unit: self.model.new_bool_var("") for unit in (task.worth if give_up else ())}
        self._variables: dict[Variable, list[Any]] = {}
        self._parts: dict[Formula, Any] = {}
        for place, weights in task.weights.items():
            self.places[place] = [self.model.new_bool_var("") for _ in weights]
            self.model.add_exactly_one(self.places[place])
        for unit, needed in task.rests_on if give_up else ():
            self.model.add_implication(self.given_up[needed], self.given_up[unit])
        for name, formula in task.formulas:
            if self._is_asked(name):
                self.require(formula, self._unless(name))
        for place, name in task.pins.items():
            if self._is_asked(name):
                self.model.add_bool_or([*self._unless(name), self.places[place][0]])
        for name, choices in task.cuts:
            if not self._is_asked(name):
                continue
            other = [~self.places[place][number] for place, number in choices.items()]
            self.model.add_bool_or([*self._unless(name), *other])

    def run(self) -> tuple[str, Any]:
        """Solve, always in the same way."""
        solver = self.cp.CpSolver()
        solver.parameters.num_workers = 1
        solver.parameters.random_seed = 1
        solver.parameters.linearization_level = 2  # 500 endpoints in 0.4 s, and without it not in 120 s
        solver.parameters.max_time_in_seconds = _SECONDS
        status = solver.solve(self.model)
        return solver.status_name(status), solver

    def _is_asked(self, name: Hashable) -> bool:
        return self.names is None or name in self.names

    def _unless(self, name: Hashable) -> list[Any]:
        if self.names is None:
            return [self.given_up[unit] for unit in self.units.get(name, ())]
        if name not in self.guards:
            self.guards[name] = self.model.new_bool_var("")
        return [~self.guards[name]]

    def require(self, formula: Formula, unless: Sequence[Any]) -> None:
        """Require a formula, unless one of some literals is true."""
        match formula:
            case bool():
                if not formula:
                    self.model.add_bool_or(list(unless))
            case AllOf(parts):
                for part in parts:
                    self.require(part, unless)
            case AnyOf(parts):
                self.model.add_bool_or([*unless, *(self._literal(part) for part in parts)])
            case Table(variables, excluded):
                choices = [self._choices(each) for each in variables]
                for row in sorted(excluded):
                    others = [~choice[number] for choice, number in zip(choices, row, strict=True)]
                    self.model.add_bool_or([*unless, *others])

    def _literal(self, formula: Formula) -> Any:
        """Return a literal that implies a formula."""
        if formula not in self._parts:
            literal = self._parts[formula] = self.model.new_bool_var("")
            self.require(formula, [~literal])
        return self._parts[formula]

    def _choices(self, variable: Variable) -> list[Any]:
        """Return a literal for each choice of a variable."""
        found = self._variables.get(variable)
        if found is None:
            found = self._variables[variable] = self._made(variable)
        return found

    def _made(self, variable: Variable) -> list[Any]:
        own = [self.places[place] for place in variable.places]
        if variable.any_change:
            changed = self.model.new_bool_var("")
            self.model.add_bool_or([~changed, *(~each[0] for each in own)])
            for each in own:
                self.model.add_implication(~each[0], changed)
            return [~changed, changed]
        if len(own) == 1 and variable.numbers[0] == (*range(variable.size),):
            return own[0]
        literals = [self.model.new_bool_var("") for _ in range(variable.size)]
        self.model.add_exactly_one(literals)
        for depth, place in enumerate(own):
            above = [~each[0] for each in own[:depth]]  # what is nearer decides
            for choice, number in zip(place[1:], variable.numbers[depth][1:], strict=True):
                self.model.add_bool_or([*above, ~choice, literals[number]])
        self.model.add_bool_or([*(~each[0] for each in own), literals[0]])
        return literals
