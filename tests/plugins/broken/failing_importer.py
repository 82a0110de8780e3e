"""A plugin with an importer that fails in all the ways a file asks for, and one that fails when asked about a file."""

import sys

from cqos_core.model.problems import CqosError, InputError
from cqos_core.model.system import Endpoint, System
from cqos_core.plugins import ImporterInfo, hookimpl

HERE = "failing_importer"


@hookimpl
def register_importers(register):
    register(ImporterInfo("failing", "fails on demand", (".fail",), f"{HERE}:claims", f"{HERE}:read"))
    register(ImporterInfo("unsure", "fails when asked", (".unsure",), f"{HERE}:unsure", f"{HERE}:read"))


def claims(name, head):
    return head.startswith(b"fail:")


def unsure(name, head):
    return head.decode("ascii").index("unsure") == 0


def read(source, context):
    demand = source.data.decode().partition(":")[2].strip()
    if demand == "exception":
        return source.data["line"]
    if demand == "exit":
        sys.exit(5)
    if demand == "error":
        raise CqosError("the dictionary is missing\nlook for it")
    if demand == "silence":
        raise InputError([])
    if demand == "nothing":
        return None
    return System(
        protocol="ros2", endpoints=[Endpoint(id="a/publisher/x", role="publisher", topic="x", participant="a")]
    )
