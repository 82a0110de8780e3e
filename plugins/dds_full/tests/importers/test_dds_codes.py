"""What importers of DDS files report has a code like everything else: explained and named."""

import json

import pytest
from click.testing import CliRunner

from cqos_core.cli.app import cli
from cqos_dds.importers.codes import CODES


def run(*arguments):
    return CliRunner().invoke(cli, arguments)


@pytest.mark.parametrize("info", CODES, ids=lambda info: info.code)
def test_every_code_is_explained(info):
    by_code, by_name = run("rule", info.code.lower()), run("rule", info.name)
    assert by_code.stdout == by_name.stdout
    assert by_code.stdout.startswith(f"{info.code} {info.name}\n")
    assert json.loads(run("rule", info.code, "--format", "json").stdout)["pack"] == "dds"


def test_codes_are_listed_with_the_pack():
    listed = json.loads(run("packs", "dds", "--format", "json").stdout)["codes"]
    assert [each["code"] for each in listed] == [info.code for info in CODES]
