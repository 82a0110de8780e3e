"""An audit on a Spark cluster: a master and two workers in processes of their own, on the loopback interface."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from cqos_core.plugins import load_plugins
from tests.bulk.needed import needed
from tests.bulk.random_fleet import said_by_check, write_fleet
from tests.bulk.tried_rules import answers_in, both_ends, both_kinds

if TYPE_CHECKING:
    from collections.abc import Iterator


def _free_port() -> int:
    with socket.socket() as opened:
        opened.bind(("127.0.0.1", 0))
        port: int = opened.getsockname()[1]
        return port


@pytest.fixture
def cluster(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """Start a cluster; return its URL."""
    needed("java", program=True)
    home = Path(needed("pyspark").__file__).parent
    monkeypatch.setenv("SPARK_LOCAL_IP", "127.0.0.1")
    monkeypatch.delenv("SPARK_HOME", raising=False)
    monkeypatch.setenv("PYSPARK_SUBMIT_ARGS", "--conf spark.sql.shuffle.partitions=2 pyspark-shell")
    port = _free_port()
    url = f"spark://127.0.0.1:{port}"
    place = "org.apache.spark.deploy"
    worker = [f"{place}.worker.Worker", "--host", "127.0.0.1", "--webui-port", "0", "-c", "1", "-m", "1g", url]
    master = [f"{place}.master.Master", "--host", "127.0.0.1", "--port", str(port), "--webui-port", "0"]
    started: list[subprocess.Popen[bytes]] = []
    environment = {**os.environ, "SPARK_HOME": str(home), "SPARK_WORKER_DIR": str(tmp_path / "work")}
    try:
        for command in (master, worker, worker):
            run = [str(home / "bin" / "spark-class"), *command]
            with (tmp_path / f"spark{len(started)}.log").open("wb") as log:
                started.append(subprocess.Popen(run, stdout=log, stderr=log, env=environment, start_new_session=True))
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


def test_a_cluster_says_what_a_check_says(cluster, tmp_path):
    path = tmp_path / "fleet.csv"
    write_fleet(path, "ros2", 5, 60)
    verdicts, findings = said_by_check(path)
    command = [
        str(Path(sys.executable).with_name("cqos")),
        "audit",
        str(path),
        "--severity",
        "note",
    ]
    arguments = ["--spark", cluster, "--work", str(tmp_path / "stages"), "--format", "json"]
    done = subprocess.run([*command, *arguments], capture_output=True, text=True, check=False, timeout=900)
    assert done.returncode == 1, done.stderr[-3000:]
    found = json.loads(done.stdout)
    assert {name: found["totals"].get(name, 0) for name in verdicts} == verdicts
    assert {(each["code"], each["severity"]): each["pairs"] for each in found["findings"]} == dict(findings)


@pytest.fixture(scope="module")
def session() -> Iterator[Any]:
    """Start Spark within this test, for small queries."""
    needed("java", program=True)
    sql = needed("pyspark.sql") if needed("pyspark") else None
    os.environ.pop("SPARK_HOME", None)
    builder = sql.SparkSession.builder.master("local[1]").config("spark.ui.enabled", "false")
    quick = {
        "spark.driver.host": "127.0.0.1",
        "spark.sql.shuffle.partitions": "1",
        "spark.sql.codegen.wholeStage": "false",
        "spark.sql.codegen.factoryMode": "NO_CODEGEN",
        "spark.sql.ansi.enabled": "true",
    }
    for name, value in quick.items():
        builder = builder.config(name, value)
    started = builder.getOrCreate()
    yield started
    started.stop()


@pytest.mark.parametrize("protocol", ["dds", "mqtt", "ros2"])
def test_every_rule_says_on_spark_what_python_says(session, protocol, tmp_path):
    nw, parquet = needed("narwhals"), needed("pyarrow.parquet")
    pack = load_plugins().pack(protocol)
    assert pack is not None
    for at, (_, tried) in enumerate(both_kinds(pack)):
        path = tmp_path / f"{at}.parquet"
        parquet.write_table(both_ends(tried), path)
        frame = nw.from_native(session.read.parquet(str(path)))
        assert answers_in(frame, tried) == [[*each] for each in tried.expected]
