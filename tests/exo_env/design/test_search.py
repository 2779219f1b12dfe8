"""The search: it lowers the objective, keeps bounds, turns back from what fails, and keeps the best when stopped."""

import numpy as np
import pytest

from dms_core.errors import SimulationError
from exo_env.design import search as module
from exo_env.design.comparison import QUANTITIES, compared
from exo_env.design.objectives import OBJECTIVES
from exo_env.design.search import search
from tests.exo_env.design.cases import OPTIONS, few, space

BOUNDS = {
    "ropes.agonist.lower.0": (0.02, 0.05),
    "ropes.agonist.lower.1": (-0.09, -0.06),
    "guide_distance": (0.13, 0.19),
}


@pytest.mark.parametrize(
    ("name", "most"),
    [
        ("peak_tension", 0.9),
        pytest.param("elbow_reaction", 0.99, marks=pytest.mark.slow),
        pytest.param("motor_power", 1.0, marks=pytest.mark.slow),
    ],
)
def test_a_search_lowers_the_objective_within_bounds_and_for_others_too(name, most):
    who, designs = few(3), space(bounds=BOUNDS)
    found = search(designs, who[:1], OBJECTIVES[name], OPTIONS, 3)
    assert found.value < most * found.start and not found.refused and not found.stopped
    assert (designs.low <= found.x).all() and (found.x <= designs.high).all()
    held_out = compared("held out", who[1:], designs.today, designs.design(found.x), OPTIONS)
    row = list(QUANTITIES).index({"peak_tension": "peak rope tension", "elbow_reaction": "peak elbow reaction"}.get(
        name, "RMS motor power"
    ))  # fmt: skip
    assert (held_out.found[:, row] < held_out.today[:, row]).all()


def test_the_same_search_gives_the_same_bits():
    runs = [search(space(bounds=BOUNDS), few(1), OBJECTIVES["peak_tension"], OPTIONS, 2) for _ in range(2)]
    assert runs[0].x.tobytes() == runs[1].x.tobytes() and runs[0].value == runs[1].value


def bowl(fails=lambda x: False, stop_at: int | None = None):
    """In place of runs: 1e7 (x - 0.14)^4 + 1 of the guide's distance, which fails where it is told to."""
    calls: list[float] = []

    def mean_gradient(designs, who, objective, options, acceptance, x):
        calls.append(float(x[0]))
        if len(calls) == stop_at:
            raise KeyboardInterrupt
        if fails(x[0]):
            raise SimulationError("patient 1: the step fell below its least size.")
        return 1e7 * (x[0] - 0.14) ** 4 + 1.0, 4e7 * (x - 0.14) ** 3

    return mean_gradient


def test_a_run_that_fails_is_told_and_not_acceptable(monkeypatch):
    said: list[str] = []
    monkeypatch.setattr(module, "mean_gradient", bowl(fails=lambda x: x < 0.139))
    designs = space(bounds={"guide_distance": (0.1, 0.19)})
    found = search(designs, [], OBJECTIVES["peak_tension"], OPTIONS, 20, said.append)
    assert found.refused and "not acceptable: patient 1: the step fell below its least size." in said
    assert 0.139 <= found.x[0] < 0.15 and found.value < found.start


def test_a_step_to_a_device_that_does_not_do_the_exercise_is_not_acceptable(monkeypatch):
    class Lagging:
        """In place of a run: 1 deg off, and 3 where the guide is nearer than 0.139 m, which the objective asks for."""

        def __init__(self, wearer, designs, x, options):
            self.x, self.tension, self.off = x, 100.0, 1.0 if x[0] > 0.139 else 3.0

        def gradient(self, objective):
            return float(self.x[0]), np.ones(1)

    monkeypatch.setattr(module, "Trial", Lagging)
    said: list[str] = []
    designs = space(bounds={"guide_distance": (0.1, 0.19)})
    found = search(designs, few(1), OBJECTIVES["motor_power"], OPTIONS, 20, said.append)
    assert any("patient 1: the elbow is 3 deg rms off" in sentence for sentence in said)
    assert 0.139 < found.x[0] < 0.15 and found.refused


@pytest.mark.parametrize(
    ("iterations", "beyond", "ending"),
    [(30, 0.0, "It converged"), (1, 0.0, "The iterations are spent"), (30, 0.1599, "The line search found no")],
)
def test_the_reason_of_the_end_is_told(iterations, beyond, ending, monkeypatch):
    monkeypatch.setattr(module, "mean_gradient", bowl(fails=lambda x: x < beyond))
    found = search(space(bounds={"guide_distance": (0.1, 0.19)}), [], OBJECTIVES["peak_tension"], OPTIONS, iterations)
    assert found.ending.startswith(ending)


def test_a_run_that_fails_today_is_an_error(monkeypatch):
    monkeypatch.setattr(module, "mean_gradient", bowl(fails=lambda x: True))
    with pytest.raises(SimulationError, match="patient 1"):
        search(space(), [], OBJECTIVES["peak_tension"], OPTIONS, 3)


def test_a_search_that_is_stopped_keeps_the_best(monkeypatch):
    monkeypatch.setattr(module, "mean_gradient", bowl(stop_at=4))
    designs = space(bounds={"guide_distance": (0.1, 0.19)})
    found = search(designs, [], OBJECTIVES["peak_tension"], OPTIONS, 20)
    assert found.stopped and found.evaluations == 4 and found.value < found.start
    assert found.value == pytest.approx(1e7 * (found.x[0] - 0.14) ** 4 + 1.0)


def test_progress_is_told_for_each_iteration(monkeypatch):
    said: list[str] = []
    monkeypatch.setattr(module, "mean_gradient", bowl())
    search(space(bounds={"guide_distance": (0.1, 0.19)}), [], OBJECTIVES["peak_tension"], OPTIONS, 5, said.append)
    assert said[0].startswith("iteration 1: ") and " N (" in said[0] and "evaluations" in said[0]


def test_an_objective_that_hardly_depends_on_the_design_is_lowered_too(monkeypatch):
    """A thousandth is there to be gained: a first step as long as the slope would end the search where it began."""

    def mean_gradient(designs, who, objective, options, acceptance, x):
        return 2.0 * (x[0] - 0.14) ** 2 + 1.0, 4.0 * (x - 0.14)

    monkeypatch.setattr(module, "mean_gradient", mean_gradient)
    found = search(space(bounds={"guide_distance": (0.1, 0.19)}), [], OBJECTIVES["motor_power"], OPTIONS, 20)
    assert found.x[0] == pytest.approx(0.14, abs=0.005)


def test_nothing_to_lower(monkeypatch):
    monkeypatch.setattr(module, "mean_gradient", lambda *given: (0.0, np.zeros(9)))
    with pytest.raises(SimulationError, match="nothing to lower"):
        search(space(), [], OBJECTIVES["peak_tension"], OPTIONS, 3)
