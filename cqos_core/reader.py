"""What one system states, as policies and values of a pack; what is wrong with it is reported."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cqos_core.policy import Anything, normalise
from cqos_core.problems import InvalidValueError
from cqos_core.reading import can_be_stated, fields_of, ignored_by, read_value, spelled
from cqos_core.remarks import core_finding, suggestion
from cqos_core.resolved import Stated

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cqos_core.pack import Dialect, RulePack
    from cqos_core.policy import Policy, Value
    from cqos_core.report import Finding, Severity
    from cqos_core.resolved import Layer
    from cqos_core.system import Place, Settings


class Reader:
    """Reads what one system states.

    Attributes:
        findings: where reports go.
        remarks: how often something was to be reported, also where it was said already.
    """

    def __init__(self, findings: list[Finding]) -> None:
        """Report to ``findings``."""
        self.findings = findings
        self.remarks = 0
        self._said: set[tuple[str, str, Place | None]] = set()
        self._ignored: dict[tuple[Any, ...], str | None] = {}

    def say(
        self,
        code: str,
        message: str,
        place: Place | None,
        role: str,
        members: Sequence[str] = (),
        help_text: str | None = None,
        severity: Severity | None = None,
    ) -> None:
        """Report under a code of the core."""
        finding = core_finding(
            code, message, place=place, role=role, members=members, help=help_text, severity=severity
        )
        self.remarks += 1
        self.findings.append(finding)

    def say_once(self, code: str, message: str, place: Place | None, help_text: str = "") -> None:
        """Report, unless the same is said already."""
        self.remarks += 1
        finding = core_finding(code, message, place=place, help=help_text or None)
        if finding not in self.findings:
            self.findings.append(finding)

    def recognise(
        self,
        pack: RulePack,
        levels: tuple[str, ...],
        settings: Settings,
        dialect: Dialect | None,
        owner: str,
        role: str,
        members: Sequence[str],
    ) -> dict[int, Stated]:
        """Return settings by index of the policy of ``levels`` that each of their names spells; report the other names."""
        found: dict[int, Stated] = {}
        for name, setting in settings.items():
            if dialect is not None and normalise(name) in dialect.ignore:
                continue
            if fields := fields_of(pack, levels, name, setting):
                found.update(fields)
                continue
            index = next((i for level in levels if (i := pack.find(level, name, dialect)) is not None), None)
            if index is not None and pack.policies[index].derived and not setting.derived:
                message = f"{owner} states `{name}`, which cannot be stated. {pack.policies[index].doc}"
                self.say("CQ202", message, setting.place, role, members, "remove it")
                continue
            if index is None or not can_be_stated(pack.policies[index]):
                known = [
                    policy.name.removeprefix("need.")
                    for policy in pack.policies
                    if policy.level in levels and can_be_stated(policy) and not policy.derived
                ]
                self.say(
                    "CQ202",
                    f"{owner} states `{name}`, which {pack.title} does not know",
                    setting.place,
                    role,
                    members,
                    suggestion(name, known),
                )
                continue
            text = spelled(pack.policies[index], setting.text, dialect)
            if text is None:
                continue
            if index in found and found[index].text != text:
                message = f"{owner} states `{pack.policies[index].name}` twice, as {found[index].text} and as {text}"
                self.say("CQ209", message, setting.place, role, members)
            found[index] = Stated(text, setting, name)
        return found

    def value(
        self,
        pack: RulePack,
        index: int,
        policy: Policy,
        role: str,
        layers: Sequence[Layer],
        options: Mapping[int, Value],
        dialect: Dialect | None,
        owner: str,
        place: Place | None,
        *,
        observed: bool = False,
        member: str | None = None,
    ) -> Value:
        """Return the value of a policy that the nearest of ``layers`` states, else its default; report what is no value."""
        stated = next((layer.settings[index] for layer in layers if index in layer.settings), None)
        ignoring = self._ignoring(pack, policy, options)
        if stated is not None and ignoring is not None:
            told = next(layer for layer in layers if index in layer.settings)
            if told.counts_as_stated and not self._is_default(pack, policy, stated.text, role, options, dialect):
                message = f"{owner} states `{policy.name}`, which {ignoring} ignores"
                self.say("CQ205", message, stated.setting.place or place, role, [member] if member else [])
        text = stated.text if stated is not None and ignoring is None else None
        if text is None:
            text = policy.default_for(role)
            if text is None:
                return Anything(f"{policy.name} is not stated")
            if observed and ignoring is None:
                return Anything(f"discovery did not report {policy.name}")
            # A default stands in the spelling of the policy itself.
            dialect = None
        try:
            return read_value(pack, policy, text, role, options, dialect)
        except InvalidValueError as problem:
            where = stated.setting.place if stated is not None and stated.setting.place is not None else place
            message = f"{owner}: `{policy.name}` {problem.message}"
            expected = problem.expected if problem.expected != policy.domain.expected() else policy.expected()
            self.remarks += 1
            if ("CQ203", message, where) not in self._said:
                self._said.add(("CQ203", message, where))
                about, members = (role, [member]) if member else (policy.level, [])
                self.say("CQ203", message, where, about, members, problem.advice(expected))
            return Anything(f"{policy.name} has no valid value", told=True)

    def _is_default(
        self,
        pack: RulePack,
        policy: Policy,
        text: str,
        role: str,
        options: Mapping[int, Value],
        dialect: Dialect | None,
    ) -> bool:
        """Whether a stated text only says what holds anyway."""
        default = policy.default_for(role)
        try:
            return default is not None and read_value(pack, policy, text, role, options, dialect) == read_value(
                pack, policy, default, role, options, None
            )
        except InvalidValueError:
            return False

    def _ignoring(self, pack: RulePack, policy: Policy, options: Mapping[int, Value]) -> str | None:
        """The option and its value under which the middleware ignores the policy; None where it does not."""
        if not policy.enforced:
            return None
        key = (id(pack), policy.name, tuple(options.get(pack.vocabulary.indices["option", o]) for o in policy.enforced))
        if key not in self._ignored:
            self._ignored[key] = ignored_by(pack, policy, options)
        return self._ignored[key]
