"""The table of what schedules reach: a shorter run gives the rows of fewer repetitions, and an evaluation the same."""

import csv

import pytest

from agents.commands.search.upper_bound import upper_bound
from agents.environment import patient_seeds
from agents.evaluation.episodes.episode import episode, world_of
from agents.evaluation.search import upper_bound as tried
from agents.policies.baselines import policy

KEPT = ("ability", "pid_return", "pid_share", "pid_rms_deg", "least_share", "linear_share", "best_return")


@pytest.fixture
def few(monkeypatch):
    """The plain PID and its lags."""
    monkeypatch.setattr(tried, "TRIES", 13)


def table(path, repetitions):
    assert upper_bound(path, "stroke_mild", patients=1, repetitions=repetitions, seed=3) == 0
    with path.open() as file:
        assert file.readline().startswith("# python -m agents upper-bound --population stroke_mild --patients 1")
        return list(csv.DictReader(file))


def test_rows_are_those_of_runs(few, tmp_path):
    one, (first, both) = table(tmp_path / "1.csv", 1), table(tmp_path / "2.csv", 2)
    assert [both["repetitions"], first["repetitions"], one[0]["repetitions"]] == ["2", "1", "1"]
    # Four digits are written.
    assert [float(first[k]) for k in KEPT] == pytest.approx([float(one[0][k]) for k in KEPT], rel=2e-3)
    env = world_of(policy("pid"), "stroke_mild", repetitions=2)
    (seed,) = patient_seeds(3, 1)
    m = episode(env, policy("pid"), seed)["measures"]
    env.close()
    assert float(both["pid_return"]) == pytest.approx(m["return"], rel=1e-3)
    # A sample a control period here, the trapezoid there.
    assert float(both["pid_rms_deg"]) == pytest.approx(m["tracking_rms_deg"], rel=0.02)
    assert float(both["pid_share"]) == pytest.approx(m["device_work_share"], rel=0.02)
    assert float(both["linear_share"]) < float(both["least_share"]) <= float(both["pid_share"])
    assert float(both["best_return"]) >= float(both["pid_return"])
