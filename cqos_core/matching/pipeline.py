"""The stages of a system from stated texts to topics, each run once; and their context: packs and options."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Final, TypeAlias

from cqos_core.language.domains import as_text
from cqos_core.matching.cross_protocol_topics import topics
from cqos_core.model.dataclass import dataclass
from cqos_core.model.problems import CqosError
from cqos_core.model.settings import Place, Setting
from cqos_core.plugins import load_plugins
from cqos_core.resolving.resolver import Resolver

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cqos_core.language.domains import SettingValue
    from cqos_core.matching.hops import Hop, Topics
    from cqos_core.matching.routes import Link
    from cqos_core.model.code_info import CodeInfo
    from cqos_core.model.system import System
    from cqos_core.packs.pack import RulePack
    from cqos_core.packs.rule import Rule
    from cqos_core.resolving.resolved_endpoint import Resolved

MOST_ENDPOINTS: Final = 100_000
"""The most endpoints that a system may have with those of bridges, by default."""
RuleFinder: TypeAlias = Callable[[str], "Rule | CodeInfo | None"]
"""Returns the rule, or the code of the core or an importer, of a code, name or alias."""


def _find_core_code(code: str) -> CodeInfo | None:
    from cqos_core.model.codes import find_code

    return find_code(code)


@dataclass(frozen=True, slots=True)
class CheckContext:
    """The context of a check: the packs, and the protocol of endpoints that state none.

    `most_endpoints` bounds what bridges may make of a system.
    """

    find_pack: Callable[[str], RulePack | None]
    find_rule: RuleFinder = _find_core_code
    default_protocol: str | None = None
    known_packs: frozenset[str] = frozenset()
    most_endpoints: int = MOST_ENDPOINTS


class Pipeline:
    """The stages of one system: bridges become endpoints, texts become values, endpoints match on topics.

    Each stage runs when it is first asked for, and once. A report, an explanation, a difference and an export begin here.

    Attributes:
        asked: by id of a pack, policies whose spelling other rules than those of the pack ask for.
    """

    def __init__(
        self, system: System, where: CheckContext, resolve: Callable[[Pipeline], Resolver] | None = None
    ) -> None:
        """Put ``system`` at the start; ``resolve`` takes the place of `resolve_all`."""
        self.stated = system
        self.where = where
        self.asked: Mapping[int, frozenset[int]] = {}
        self._resolve = resolve or resolve_all

    @cached_property
    def _expanded(self) -> tuple[System, Sequence[Link]]:
        where = self.where
        if not self.stated.bridges:
            return self.stated, ()
        from cqos_core.matching.routes import expanded  # only systems with bridges need it

        return expanded(self.stated, where.find_pack, where.default_protocol, where.most_endpoints)

    @property
    def system(self) -> System:
        """The system with the endpoints of its bridges."""
        return self._expanded[0]

    @cached_property
    def resolver(self) -> Resolver:
        """The resolver after it resolved all endpoints."""
        return self._resolve(self)

    @property
    def endpoints(self) -> Sequence[Resolved]:
        """All endpoints with their values."""
        return self.resolver.result.endpoints

    @cached_property
    def _linked(self) -> tuple[Topics, Sequence[Hop]]:
        links = self._expanded[1]
        if not links:
            return topics(self.resolver), ()
        from cqos_core.matching.bridge_values import linked  # as above

        return linked(links, self.resolver)

    @property
    def topics(self) -> Topics:
        """The endpoints by protocol and topic, each with copies of those that meet them there from elsewhere."""
        return self._linked[0]

    @property
    def hops(self) -> Sequence[Hop]:
        """The hops over bridges."""
        return self._linked[1] if self._expanded[1] else ()


def resolver_of(pipeline: Pipeline) -> Resolver:
    """Return a resolver for a system that has resolved no endpoint yet."""
    where = pipeline.where
    return Resolver(pipeline.system, where.find_pack, where.default_protocol, pipeline.asked, where.known_packs)


def resolve_all(pipeline: Pipeline) -> Resolver:
    """Resolve all endpoints of a system afresh."""
    resolver = resolver_of(pipeline)
    resolver.run()
    return resolver


def context(extra_packs: Iterable[RulePack] = (), default_protocol: str | None = None) -> CheckContext:
    """Return a check context over the installed packs and ``extra_packs``, which win over installed ones of their id."""
    extra = {pack.id: pack for pack in extra_packs}
    plugins = load_plugins()

    def find_pack(pack_id: str) -> RulePack | None:
        return extra.get(pack_id) or plugins.pack(pack_id)

    def find_rule(code: str) -> Rule | CodeInfo | None:
        own = _find_core_code(code)
        if own is not None:
            return own
        for pack in (*extra.values(), *(found for name in plugins.packs if (found := plugins.pack(name)))):
            rule = pack.rule(code) or pack.code(code)
            if rule is not None:
                return rule
        return None

    known = frozenset({*plugins.packs, *extra})
    return CheckContext(find_pack, find_rule, default_protocol, known, most_endpoints=_most_endpoints())


MOST_ENDPOINTS_VARIABLE: Final = "CQOS_MAX_ENDPOINTS"
"""The environment variable with the number of endpoints that a system may have after bridges added theirs."""


def _most_endpoints() -> int:
    given = os.environ.get(MOST_ENDPOINTS_VARIABLE, "")
    if not given:
        return MOST_ENDPOINTS
    if not re.fullmatch("[1-9][0-9]{0,11}", given):
        raise CqosError(f"{MOST_ENDPOINTS_VARIABLE} is `{given[:40]}`", "write a number of endpoints from 1")
    return int(given)


def with_options(
    system: System, options: Mapping[str, Mapping[str, SettingValue]], where: CheckContext, place: Place | None = None
) -> System:
    """Return ``system`` with options laid over its own, in whatever spelling it states them."""
    joined = {pack_id: dict(settings) for pack_id, settings in system.options.items()}
    for pack_id, settings in options.items():
        pack, stated = where.find_pack(pack_id), joined.setdefault(pack_id, {})
        for name, value in settings.items():
            for other in [
                other for other in stated if pack and pack.find("option", other) == pack.find("option", name)
            ]:
                del stated[other]
            stated[name] = Setting(as_text(value), place or Place("options"))
    return replace(system, options=joined)
