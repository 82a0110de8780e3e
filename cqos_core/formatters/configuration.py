"""The text of the configuration that ``cqos init`` writes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cqos_core import config
from cqos_core.formatters.terminal import wrap
from cqos_core.importers.yaml_form import ACCEPT, SEVERITIES
from cqos_core.plugins import load_plugins

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cqos_core.importers.document_form import Key
    from cqos_core.packs.pack import RulePack

_WIDTH: Final = 100


def configuration(found: str, seen: Sequence[str], installed: set[str]) -> str:
    """Return a configuration that states the protocol of ``seen``, if it is only one, and lists all other keys in comments."""
    packs = [pack for name in seen if (pack := load_plugins().pack(name)) is not None]
    rule = next((rule.code for pack in packs for rule in pack.rules), "CQ403")
    stated = "" if len(seen) == 1 else "# "
    blocks = [
        [
            *_comment("Configuration of C-QoS for this folder and those below it. Every key may be left out."),
            f"# When this was written: {found}.",
        ],
        [*_key(config.PROTOCOL), f'{stated}protocol = "{next(iter(seen or sorted(installed)), "")}"'],
        [*_key(config.FAIL_ON), '# fail_on = "warning"'],
        [*_key(config.SHOW), '# show = "notes"'],
        [*_key(config.FORMAT), '# format = "concise"'],
        [*_key(config.EXCLUDE), '# exclude = ["/old/", "*_test.yaml"]'],
        [*_key(config.BASELINE), '# baseline = "known.json"  # cqos check . --write-baseline known.json'],
        [*_key(config.PACKS), '# packs = ["my_pack.yaml"]'],
        [*_key(config.EXTENDS), '# extends = ["../team.toml"]'],
        *(list(_options(pack)) for pack in packs),
        [*_key(SEVERITIES), "[severities]", f'# {rule} = "warning"  # error, warning, note or off'],
        [
            *_key(ACCEPT),
            "# [[accept]]",
            f'# rule = "{rule}"',
            '# topic = "/camera/*"',
            '# because = "a lost frame is replaced by the next one"',
            '# until = "2099-12-31"',
        ],
    ]
    return "\n\n".join("\n".join(block) for block in blocks) + "\n"


def _options(pack: RulePack) -> Iterator[str]:
    """Yield a table of the options of a pack that have no default and few values."""
    yield from _comment(f"What is known of the deployment. `cqos packs {pack.id}` lists all options of {pack.title}.")
    yield f"[options.{pack.id}]"
    for policy in pack.policies:
        values = policy.domain.describe().get("values")
        if policy.level == "option" and policy.default is None and values:
            yield from _comment(f"{policy.doc} One of {', '.join(values)}.")
            yield f'# {policy.name} = "{values[0]}"'


def _key(key: Key[Any]) -> Iterator[str]:
    return _comment(key.help)


def _comment(text: str) -> Iterator[str]:
    return (f"# {line}" for line in wrap(text, _WIDTH - 2))
