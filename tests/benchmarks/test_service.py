"""The benchmark of the service runs and measures what it says; its figures are in docs/benchmarks.md."""

from tests.benchmarks.service import model, run, where_time_goes


def test_the_benchmark_of_the_service_runs():
    rows = run(0.3, [1], [4])
    table = [row.split(" | ") for row in rows if row.startswith("| 4")]
    assert [row[2] for row in table] == ["echo", "models not seen before", "the same model again"]
    assert all(float(row[3]) > 0 for row in table)
    assert all(row[4].endswith("%") for row in table[1:])


def test_no_two_models_are_the_same_question():
    assert len({model(4, number) for number in range(300)}) == 300
    assert "check " in where_time_goes(4)
