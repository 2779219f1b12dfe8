"""Gradients of all objectives by the numbers of a design, against differences of runs that start afresh."""

import numpy as np
import pytest

from dms_core import SolverOptions
from exo_env.design.gradient import Trial, slopes
from exo_env.design.objectives import OBJECTIVES
from tests.exo_env.design.cases import ALIGNED, ASKEW, few, space

TIGHT = SolverOptions(rtol=1e-7)
PART = 0.02
"""Step of the differences, as a part of the width of the bounds: a millimetre of 6 cm."""
TOLERANCE = 2e-5
"""Of the objective, and of its largest derivative. Runs choose their steps anew in each design and err by rtol = 1e-7
of an objective, which over PART is 5e-6 of it, four runs together; differences of the fourth order err by less."""
SPREAD = 3.0
"""Tolerance of each derivative, as a multiple of the largest by which differences of steps PART and 2 PART disagree:
the error that runs bring is the same for all numbers, is measured, and the longer step has half of it."""
UNSEEN = {
    ("rigid", "peak_tension"): {"guide_distance"},
    ("rigid", "elbow_reaction"): {"ropes.agonist.upper.1"},
    ("rigid", "motor_power"): {"guide_distance"},
}
"""Derivatives that are smaller than what differences of runs err by: the guide of an aligned device moves no rope, and
the other one happens to be near 0 here."""
LOWERING = {"times": [0.0, 0.1], "angles_deg": [55.0, 50.0], "duration": 0.15, "proprioception": {}}
"""A jerk down in which first the antagonist pulls and then the agonist, so that the ends of both ropes are seen."""
CASES = {"rigid": (ALIGNED, False), "askew": (ASKEW, False), "compliant": (ALIGNED, True)}
"""How the device is worn, and whether the cuff is compliant."""


def differences(wearer, designs, x, direction, sizes=(1,)) -> np.ndarray:
    """Derivatives along a direction, by central differences of the fourth order, shape (sizes, objectives).

    Steps are multiples of PART.
    """
    values = {}
    for k in sorted({sign * part * size for size in sizes for part in (1, 2) for sign in (1, -1)}):
        end = Trial(wearer, designs, x + k * PART * direction, TIGHT)
        values[k] = np.array([end.value(objective) for objective in OBJECTIVES.values()])
    return np.array([
        (8.0 * (values[s] - values[-s]) - (values[2 * s] - values[-2 * s])) / (12.0 * s * PART) for s in sizes
    ])  # fmt: skip


def off_today(designs):
    """A design beside today's, where both upper ends of ropes coincide and some derivatives vanish by symmetry."""
    return designs.start + 0.1 * np.random.default_rng(0).uniform(-1.0, 1.0, len(designs.names)) * widths(designs)


def widths(designs):
    return designs.high - designs.low


@pytest.mark.parametrize("case", ["askew", "compliant"])
def test_the_derivative_along_a_direction(case):
    shift, cuff = CASES[case]
    wearer, designs = few(1, shift, exercise=LOWERING, cuff=cuff)[0], space(cuff)
    x, direction = off_today(designs), np.random.default_rng(1).uniform(-1.0, 1.0, len(designs.names)) * widths(designs)
    (expected,), trial = differences(wearer, designs, x, direction), Trial(wearer, designs, x, TIGHT)
    for (name, objective), along in zip(OBJECTIVES.items(), expected, strict=True):
        value, slope = trial.gradient(objective)
        assert value == pytest.approx(trial.value(objective), rel=1e-12)
        assert abs(slope @ direction - along) < TOLERANCE * (value + np.abs(slope * widths(designs)).max()), name


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_every_objective_by_every_number(case):
    shift, cuff = CASES[case]
    wearer, designs = few(1, shift, exercise=LOWERING, cuff=cuff)[0], space(cuff)
    x = off_today(designs)
    trial = Trial(wearer, designs, x, TIGHT)
    steps = np.diag(widths(designs))
    short, expected = np.moveaxis([differences(wearer, designs, x, step, (1, 2)) for step in steps], 1, 0)
    for k, (name, objective) in enumerate(OBJECTIVES.items()):
        value, slope = trial.gradient(objective)
        slope *= widths(designs)
        tolerance = SPREAD * np.abs(short[:, k] - expected[:, k]).max()
        assert tolerance < SPREAD * TOLERANCE * (value + np.abs(expected[:, k]).max()), "the differences do not hold"
        assert np.abs(slope - expected[:, k]).max() < tolerance, name
        unseen = {designs.names[i] for i in np.flatnonzero(np.abs(expected[:, k]) <= tolerance)}
        assert unseen <= UNSEEN.get((case, name), set()), "these derivatives could as well be 0"


def test_the_start_of_a_device_worn_askew_depends_on_the_guide():
    wearer, designs = few(1, ASKEW)[0], space(bounds={"guide_distance": (0.13, 0.19)})
    trial = Trial(wearer, designs, designs.start, TIGHT)
    start = slopes(wearer, designs, designs.start, trial.model).start[:, 0]
    turn = start[trial.model.layout.index["lower_link.p3"]]
    # Half the turn of the hinge by the guide's distance; its start is solved to 1e-13 and differenced over 12 um.
    worn = [wearer.model(designs.design(designs.start + h)).start.q for h in (1e-3, -1e-3)]
    expected = (worn[0] - worn[1])[trial.model.layout.index["lower_link.p3"]] / 2e-3
    assert abs(turn) > 0.01 and turn == pytest.approx(expected, rel=1e-3)


def test_the_map_from_design_to_declared_numbers_is_explicit():
    wearer, designs = few(1)[0], space(bounds={"ropes.agonist.lower.0": (0.01, 0.06), "guide_distance": (0.13, 0.19)})
    model = wearer.model(designs.today)
    found = slopes(wearer, designs, designs.start, model)
    names = [number.name for number in found.numbers]
    assert set(names) == {
        "agonist.path.1.point.0", "guide.point_i.1", "guide.point_j.0", "guide.point_j.1", "guide.point_j.2",
        "pid.kp", "pid.ki", "pid.kd",
    }  # fmt: skip
    # An attachment point is itself, to the rounding of a micrometre's difference.
    assert found.by_design[names.index("agonist.path.1.point.0")] == pytest.approx([1.0, 0.0], abs=1e-9)
    assert found.by_design[names.index("guide.point_i.1")] == pytest.approx([0.0, -1.0], abs=1e-9)
    # The gains fall with the lever.
    assert found.by_design[names.index("pid.kp"), 0] < 0.0 == found.by_design[names.index("pid.kp"), 1]
    assert not found.start.any(), "an aligned device starts where the elbow is"


def test_at_its_bounds_the_map_is_the_same_and_asks_for_nothing_beyond():
    """A stiffness of 0 is allowed, one below is not; and a lever may end where its rope would pull the other way."""
    inside = space(cuff=True, bounds={"cuff.stiffness.1": (0.0, 4000.0), "ropes.agonist.lower.0": (0.005, 0.06)})
    wearer = few(1, cuff=True)[0]
    for x in (inside.low, inside.high):
        model = wearer.model(inside.design(x))
        at = slopes(wearer, inside, x, model)
        # Of second order over micrometres of 7 cm.
        for number, row in zip(at.numbers, at.by_design, strict=True):
            if number.element == "pid":
                assert row[1] == pytest.approx(_gain_slope(inside, x, number.path), rel=1e-6)
        assert ("guide", "stiffness.1") in at.numbers


def _gain_slope(designs, x, gain) -> float:
    """d gain / d lower.0 by differences of the device itself."""
    devices = [designs.design(x + np.array([0.0, h])).device for h in (1e-5, -1e-5)]
    return (getattr(devices[0].gains, gain) - getattr(devices[1].gains, gain)) / 2e-5
