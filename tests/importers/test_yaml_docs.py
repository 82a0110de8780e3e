"""The reference of the system file: its examples are read, and it names every key that the forms have."""

import re
from pathlib import Path

import pytest

from cqos_core.config import load_config
from cqos_core.files.schema import system_schema
from cqos_core.model.source import ReadContext, Source
from cqos_core.plugins import load_plugins, named

read = named(load_plugins().importers["yaml"].reader)
DOCS = Path(__file__).parents[2] / "docs"
PAGE = "\n".join((DOCS / name).read_text(encoding="utf-8") for name in ("yaml-form.md", "configuration.md"))
BLOCKS = re.findall(r"^```(yaml|toml)\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)


def keys_of(schema):
    """Every key of a schema and of the schemas within it."""
    if isinstance(schema, dict):
        named_here = schema.get("properties")
        yield from (
            [name for name, each in named_here.items() if each is not False] if isinstance(named_here, dict) else ()
        )
        for each in schema.values():
            yield from keys_of(each)
    elif isinstance(schema, list):
        for each in schema:
            yield from keys_of(each)


@pytest.mark.parametrize("text", [text for kind, text in BLOCKS if kind == "yaml" and "cqos: 1" in text])
def test_example_is_read_without_a_word(text):
    assert read(Source("example.yaml", text.encode()), ReadContext()).notes == []


def test_instances_example_makes_what_the_text_says():
    (text,) = (text for _, text in BLOCKS if "instances: {drone" in text)
    found = read(Source("example.yaml", text.encode()), ReadContext())
    assert sorted(found.participants) == ["drone_d1", "drone_d2", "station"]
    assert [endpoint.role for endpoint in found.endpoints] == ["publisher"] * 6 + ["subscriber"] * 2


def test_configuration_example_is_read(tmp_path):
    ((_, text),) = (block for block in BLOCKS if block[0] == "toml")
    (tmp_path / "team.toml").touch()
    (tmp_path / "project").mkdir()
    (tmp_path / "project" / "cqos.toml").write_text(text, encoding="utf-8")
    assert load_config(tmp_path / "project" / "cqos.toml").checks[0].name == "commands-are-reliable"


def test_every_key_of_every_form_is_named():
    assert [name for name in sorted({*keys_of(system_schema())}) if not re.search(rf"`{{?{name}\b", PAGE)] == []
