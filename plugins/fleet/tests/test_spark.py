"""Spark as an engine, on a cluster of a master and two workers on the loopback interface; only `dev.py explore` starts one.

Spark runs the same expressions of Narwhals as DuckDB and Polars, which every run of the tests asks. It takes half a minute of processor
time to start and to plan one audit.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from cqos_core.plugins import load_plugins
from plugins.fleet.tests.needed import needed
from plugins.fleet.tests.random_fleet import said_by_check, write_fleet
from plugins.fleet.tests.test_audit import audited
from plugins.fleet.tests.tried_rules import answers_in, both_ends, both_kinds
from tests.effort import EXPLORE

if TYPE_CHECKING:
    from collections.abc import Iterator

_SMALL = "-XX:TieredStopAtLevel=1 -XX:+UseSerialGC"
"""What makes a short life of Java cheap."""
_QUICK = {
    "spark.driver.host": "127.0.0.1",
    "spark.driver.extraJavaOptions": _SMALL,
    "spark.executor.extraJavaOptions": _SMALL,
    "spark.executor.memory": "512m",
    "spark.sql.adaptive.enabled": "false",
    "spark.sql.shuffle.partitions": "2",
    "spark.sql.codegen.wholeStage": "false",
    "spark.sql.codegen.factoryMode": "NO_CODEGEN",
    "spark.sql.ansi.enabled": "true",
    "spark.ui.enabled": "false",
}


def _free_port() -> int:
    with socket.socket() as opened:
        opened.bind(("127.0.0.1", 0))
        port: int = opened.getsockname()[1]
        return port


@pytest.fixture
def spark(tmp_path: Path) -> Iterator[tuple[str, Any]]:
    """The URL of a master and a session on it."""
    needed("java", program=True)
    sql = needed("pyspark.sql") if needed("pyspark") else None
    with pytest.MonkeyPatch.context() as patch, contextlib.ExitStack() as stack:
        patch.setenv("SPARK_LOCAL_IP", "127.0.0.1")
        url = stack.enter_context(_cluster(tmp_path, patch))
        builder = sql.SparkSession.builder.master(url).config("spark.sql.warehouse.dir", str(tmp_path / "warehouse"))
        for name, value in _QUICK.items():
            builder = builder.config(name, value)
        session = builder.getOrCreate()
        stack.callback(session.stop)
        yield url, session


@contextlib.contextmanager
def _cluster(place: Path, patch: pytest.MonkeyPatch) -> Iterator[str]:
    """Start a master and two workers; return their URL."""
    port, home = _free_port(), Path(needed("pyspark").__file__).parent
    url, deploy = f"spark://127.0.0.1:{port}", "org.apache.spark.deploy"
    worker = [f"{deploy}.worker.Worker", "--host", "127.0.0.1", "--webui-port", "0", "-c", "1", "-m", "1g", url]
    master = [f"{deploy}.master.Master", "--host", "127.0.0.1", "--port", str(port), "--webui-port", "0"]
    patch.setenv("SPARK_DAEMON_JAVA_OPTS", _SMALL)
    patch.setenv("SPARK_WORKER_DIR", str(place / "work"))
    patch.setenv("SPARK_HOME", str(home))
    started: list[subprocess.Popen[bytes]] = []
    try:
        for command in (master, worker, worker):
            run = [str(home / "bin" / "spark-class"), *command]
            with (place / f"spark{len(started)}.log").open("wb") as log:
                started.append(subprocess.Popen(run, stdout=log, stderr=log, start_new_session=True))
            if len(started) == 1:
                _wait_for(port)
        yield url
    finally:
        for each in reversed(started):
            os.killpg(each.pid, signal.SIGKILL)
            each.wait()


def _wait_for(port: int) -> None:
    end = time.monotonic() + 240
    while time.monotonic() < end:
        with socket.socket() as opened:
            if opened.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.1)
    pytest.fail("the master of the cluster did not start")


if EXPLORE:

    @pytest.mark.explored
    def test_spark_says_what_python_says(spark, tmp_path):
        """One test, so that Spark is started once."""
        url, session = spark
        for protocol in ("dds", "mqtt", "ros2"):
            _compare_rules(session, protocol, tmp_path / f"{protocol}.parquet")
        path = tmp_path / "fleet.csv"
        write_fleet(path, "ros2", 5, 60)
        verdicts, findings = said_by_check(path)
        session.sql("CREATE DATABASE robots")
        session.read.csv(str(path), header=True).write.saveAsTable("robots.endpoints")
        totals, found = audited(tmp_path, path="robots.endpoints", spark=url, work=tmp_path / "stages")
        assert {name: totals.get(name, 0) for name in verdicts} == verdicts
        assert found == findings


def _compare_rules(session: Any, protocol: str, path: Path) -> None:
    """Compare each rule over random pairs with Python."""
    nw, parquet = needed("narwhals"), needed("pyarrow.parquet")
    pack = load_plugins().pack(protocol)
    assert pack is not None
    for _, tried in both_kinds(pack):
        parquet.write_table(both_ends(tried), path)
        frame = nw.from_native(session.read.parquet(str(path)))
        assert answers_in(frame, tried) == [[*each] for each in tried.expected]
