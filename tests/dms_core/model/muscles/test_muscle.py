"""The muscle against tables of tests/reference: equilibrium, arm, runs; and the refusal of impossible tendons."""

import numpy as np
import pytest

from dms_core.errors import ModelError
from dms_core.model.element import GROUND
from dms_core.model.geometry.path import PathPoint, path_length
from dms_core.model.muscles.fibre import STOP_WIDTH, fibre_at_rest, fibre_pull, pennation_cosine
from dms_core.model.muscles.muscle import PATH_INTEGERS, PATH_NUMBERS, thelen_muscle
from tests.arm26 import MUSCLES, arm, body_coordinates, muscle, table

FORCE, LENGTH = 1e-3, 1e-8
"""The reference's own tolerances for static equilibrium [N], [m]."""
STILL = np.zeros((1, 3))


@pytest.mark.parametrize("row", table("muscle_equilibrium"), ids=lambda r: f"{r['muscle']}-{r['activation']}")
def test_equilibrium(row):
    m = muscle(row["muscle"])
    fibre = m.equilibrium(row["muscle_tendon_length_m"], row["activation"])
    assert fibre == pytest.approx(row["fibre_length_m"], abs=LENGTH)
    assert m.tension(row["muscle_tendon_length_m"], fibre) == pytest.approx(row["tendon_force_N"], abs=FORCE)
    cosine = pennation_cosine(np.array(m.numbers()), fibre)[0]
    assert np.arccos(cosine) == pytest.approx(row["pennation_rad"], abs=1e-6)


def _isometric(name: str, flexion_deg: float, activation: float) -> tuple[float, float]:
    """Fibre length [m] and tendon force [N] at the assembled start of the posed arm."""
    m = muscle(name, start_activation=activation)
    system = arm(flexion_deg, m)
    placement = m.place(system)
    q_bodies, _ = body_coordinates(system, placement.bodies)
    (fibre, fibre_rate), (start_activation, rate) = m.start_states(system, q_bodies, np.array([[0.8, 0.0, 0.0]]))
    assert (fibre_rate, start_activation) == (0.0, activation)
    assert np.sign(rate) == np.sign(0.8 - activation)
    r, q = np.zeros(placement.size), np.concatenate([q_bodies, [fibre, activation]])
    _kernel(placement, q, np.zeros_like(q), activation, r)
    # At rest the fibre row balances: 1e-9 is brentq's rounding times the fibre's stiffness of up to 1e6 N/m.
    assert r[-2] == pytest.approx(0.0, abs=1e-9)
    translation = r[:-2].reshape(-1, 7)[:, :3].sum(axis=0)
    # The muscle pulls equally at both ends.
    np.testing.assert_allclose(translation, 0.0, atol=1e-10)
    ip, par = np.array(placement.integers, np.int32), np.array(placement.numbers)
    return fibre, m.tension(path_length(ip, PATH_INTEGERS, par, PATH_NUMBERS, q_bodies), fibre)


def _kernel(placement, q, v, command, r, numbers=None):
    n = placement.size
    ip = np.array(placement.integers, np.int32)
    par = np.array(placement.numbers if numbers is None else numbers)
    Jq, Jv, Ja = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    thelen_muscle(ip, par, q, v, np.zeros(n), np.array([[command, 0.0, 0.0]]), 0, r, Jq, Jv, Ja)


@pytest.mark.parametrize(
    "row", table("arm26_isometric_via_points_only"), ids=lambda r: f"{r['elbow_flexion_deg']:.0f}deg"
)
def test_isometric_forces_and_moments_of_the_arm(row):
    flexion = row["elbow_flexion_deg"]
    arms = {r["elbow_flexion_deg"]: r for r in table("arm26_paths_via_points_only")}[flexion]
    moment = {}
    for name in MUSCLES:
        _, force = _isometric(name, flexion, 1.0)
        assert force == pytest.approx(row[f"{name}_tendon_force_N"], abs=FORCE)
        moment[name] = force * arms[f"{name}_elbow_moment_arm_m"]
    # 1e-3 N in each of three muscles with arms up to 0.05 m.
    flexors, triceps = sum(moment[n] for n in MUSCLES[3:]), sum(moment[n] for n in MUSCLES[:3])
    assert flexors == pytest.approx(row["BIClong_BICshort_BRA_elbow_moment_Nm"], abs=1.5e-4)
    assert triceps == pytest.approx(row["TRI_elbow_moment_Nm"], abs=1.5e-4)


@pytest.mark.parametrize("name", MUSCLES)
def test_start_of_the_forward_run(name):
    row = table("arm26_forward_A")[0]
    fibre, force = _isometric(name, 20.0, 0.05)
    assert fibre == pytest.approx(row[f"{name}_fibre_length_m"], abs=LENGTH)
    assert force == pytest.approx(row[f"{name}_tendon_force_N"], abs=FORCE)


def _between_ground_points(**changes):
    ends = tuple(PathPoint(body=GROUND, point=(x, 0.0, 0.0)) for x in (0.0, 0.388))
    return muscle("BIClong", path=ends, **changes)


@pytest.mark.parametrize("run", ["isometric_excitation_step", "isometric_activation_step", "imposed_sine_length"])
def test_states_of_the_runs_satisfy_the_fibre_row(run):
    m = _between_ground_points(activation_dynamics=False)
    placement = m.place(arm(0.0))
    for row in table(f"{run}_BIClong"):
        numbers, r = list(placement.numbers), np.zeros(1)
        numbers[PATH_NUMBERS] = row["muscle_tendon_length_m"]
        q, v = np.array([row["fibre_length_m"]]), np.array([row["fibre_velocity_m_per_s"]])
        _kernel(placement, q, v, row["activation"], r, numbers)
        # 12 digits of the table times the tendon's stiffness of 1e5 N/m and 1e4 N s/m of the velocity curve: 1e-7 N;
        # the reference's own integration is good to 5e-5 N.
        assert r[0] == pytest.approx(0.0, abs=1e-4)
        assert m.tension(row["muscle_tendon_length_m"], q[0]) == pytest.approx(row["tendon_force_N"], abs=1e-4)


def test_path_without_moving_bodies_has_only_its_own_coordinates():
    m = _between_ground_points(start_activation=0.05)
    placement = m.place(arm(0.0))
    assert placement.bodies == () and placement.coordinates == ("BIClong.fibre_length", "BIClong.activation")
    (fibre, _), _ = m.start_states(arm(0.0), np.zeros(2), STILL)
    assert fibre == pytest.approx(table("isometric_activation_step_BIClong")[0]["fibre_length_m"], abs=LENGTH)


def test_given_start_fibre_length_is_kept():
    m = _between_ground_points(start_fibre_length=0.12)
    # Excitation below its minimum: activation 0.01 rests.
    assert m.start_states(arm(0.0), np.zeros(2), STILL) == ((0.12, 0.0), (0.01, 0.0))


def test_without_activation_dynamics_the_input_sets_the_start():
    m = _between_ground_points(activation_dynamics=False)
    ((fibre, _),) = m.start_states(arm(0.0), np.zeros(1), np.array([[0.05, 0.0, 0.0]]))
    assert fibre == pytest.approx(table("isometric_activation_step_BIClong")[0]["fibre_length_m"], abs=LENGTH)


@pytest.mark.parametrize("length", [0.05, 0.2, 0.2723])
def test_too_long_a_tendon_is_named(length):
    with pytest.raises(ModelError, match=rf"'BIClong'.*{length:.6g} m long.*0.2723 m"):
        muscle("BIClong").equilibrium(length, 0.5)


@pytest.mark.parametrize("activation", [0.01, 0.3, 1.0])
@pytest.mark.parametrize("name", MUSCLES)
def test_equilibrium_exists_over_the_whole_range(name, activation):
    m = muscle(name)
    par = np.array(m.numbers())
    # From a fibre of a fifth of its optimal length to three times that, where passive force is 1e4 times F0.
    for share in (0.2, 0.5, 1.0, 1.6, 3.0):
        fibre = m.equilibrium(m.tendon_slack_length + share * m.optimal_fibre_length, activation)
        assert 0.0 < fibre * pennation_cosine(par, fibre)[0] < share * m.optimal_fibre_length


@pytest.mark.parametrize("length", [0.05, 0.2723, 0.2723 + 1e-4])
def test_a_fibre_without_room_rests_on_its_stop(length):
    m = muscle("BIClong")
    par = np.array(m.numbers())
    fibre = fibre_at_rest(par, length, 0.5)
    assert m.smallest_fibre_length < fibre < m.smallest_fibre_length + STOP_WIDTH * m.optimal_fibre_length
    # The row's slope there is some 1e6 N/m, of an argument that is rounded to 1e-18 m.
    assert fibre_pull(par, fibre, 0.0, 0.5)[0] == pytest.approx(m.tension(length, fibre), abs=1e-9)


@pytest.mark.parametrize("start", [0.0, 1e-4, 10.0])
def test_a_start_out_of_range_is_named_with_what_is_allowed(start):
    with pytest.raises(ModelError, match=r"thelen_muscle 'BIClong': start_fibre_length = .*: Expected a number"):
        muscle("BIClong", start_fibre_length=start)


def test_steep_pennation_is_refused():
    with pytest.raises(ModelError, match="pennation_angle"):
        muscle("BRA", pennation_angle=1.5)


def test_mistakes_in_curves_name_muscle_and_key():
    with pytest.raises(ModelError, match="thelen_muscle 'BRA'.*active_shape"):
        muscle("BRA", curves={"active_shape": 0.0})
