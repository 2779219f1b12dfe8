"""Dynamics of a patient's effort: reductions, delays to the sample, and each impairment against its own equation."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dms_core.model.muscles.activation import MINIMUM
from exo_env.patient.excitation.effort import new_effort, reset_effort, step_effort
from exo_env.patient.excitation.fatigue import REST, L, advance_fatigue
from exo_env.patient.excitation.slacking import MOST_EFFORT, advance_effort
from exo_env.patient.patient import LONGEST_DELAY, MIDDLE, Patient
from tests.exo_env.patient.at_work import MUSCLES, SIGN, AtWork

PERIOD = 0.02
FLEXES, EXTENDS = np.array(SIGN) > 0, np.array(SIGN) < 0
RAMP = np.linspace(0.02, 0.9, 60)[:, None] * np.array([0.3, 0.2, 0.4, 1.0, 0.9, 0.8])
"""A command that rises, shape (60, 6)."""
IMPAIRED = {
    "maximum_activation_flexors": 0.6, "maximum_activation_extensors": 0.4, "neural_delay": 0.05,
    "electromechanical_delay": 0.013, "co_contraction": 0.3, "spasticity_flexors": 0.2, "spasticity_extensors": 0.1,
    "tremor_amplitude": 0.02, "tremor_width": 1.0, "fatigue_rate": 0.02, "slacking_rate": 0.4, "feedback_gain": 0.3,
}  # fmt: skip


def _effort(seed=0, period=PERIOD, **fields):
    return AtWork(Patient(**fields), period, np.random.default_rng(seed))


def _course(effort, commands, **signals):
    """Excitations of a course of commands, shape (n, 6); further signals have one value for each period."""
    effort.reset(commands[0])
    rows = [{name: float(values[k]) for name, values in signals.items()} for k in range(len(commands))]
    return np.array([effort.step(a, **row) for a, row in zip(commands, rows, strict=True)])


def test_order_of_muscles():
    assert [m for m, s in zip(MUSCLES, SIGN, strict=True) if s > 0] == ["BIClong", "BICshort", "BRA"]
    assert [m for m, s in zip(MUSCLES, SIGN, strict=True) if s < 0] == ["TRIlong", "TRIlat", "TRImed"]


def test_unimpaired_patient_passes_the_command_through():
    rate = np.sin(np.arange(60.0))
    found = _course(_effort(), RAMP, rate=rate, error=0.1 * rate)
    # Bit for bit: nothing is added and the factor is 1.
    np.testing.assert_array_equal(found, np.maximum(RAMP, MINIMUM))


def test_weakness_is_a_ceiling_of_each_group():
    found = _course(_effort(maximum_activation_flexors=0.5, maximum_activation_extensors=0.25), RAMP)
    # Below the ceiling the command passes: what is weak is driven with a larger share. Round-off of the share only.
    np.testing.assert_allclose(found[:, FLEXES], np.clip(RAMP[:, FLEXES], MINIMUM, 0.5), rtol=1e-15)
    np.testing.assert_allclose(found[:, EXTENDS], np.clip(RAMP[:, EXTENDS], MINIMUM, 0.25), rtol=1e-15)
    assert (RAMP[:, FLEXES] > 0.5).any() and (RAMP[:, EXTENDS] > 0.25).any()
    assert np.all(_course(_effort(maximum_activation_flexors=0.0), RAMP)[:, FLEXES] == MINIMUM)


@pytest.mark.parametrize("delay", ["neural_delay", "electromechanical_delay"])
@pytest.mark.parametrize("periods", [0, 1, 3, 25])
def test_whole_delays_are_exact(delay, periods):
    found = _course(_effort(**{delay: periods * PERIOD}), RAMP)
    late = np.vstack([np.repeat(RAMP[:1], periods, axis=0), RAMP])[: len(RAMP)]
    # periods * PERIOD / PERIOD may miss the whole number by a rounding error.
    np.testing.assert_allclose(found, np.maximum(late, MINIMUM), rtol=0.0, atol=1e-14)


def test_signals_are_linear_between_two_periods():
    command = MINIMUM + 0.9 * RAMP
    found = _course(_effort(electromechanical_delay=0.033), command)
    times = PERIOD * np.arange(len(command))
    late = np.stack([np.interp(times - 0.033, times, column) for column in command.T], axis=1)
    # 0.033 / 0.02 is rounded.
    np.testing.assert_allclose(found, late, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("delay", [0.0, 0.02, 0.03, 0.05])
def test_what_is_felt_at_a_period_s_beginning_acts_at_its_end(delay):
    """An error that rises in proportion to time: felt, it is late by its delay, and by a period at least."""
    times = PERIOD * np.arange(40)
    command = np.full((40, 6), 0.3)
    found = _course(_effort(feedback_gain=0.5, feedback_delay=delay), command, error=times)
    felt = np.maximum(times + PERIOD - max(delay, PERIOD), 0.0)
    np.testing.assert_allclose(found[5:, FLEXES], 0.3 + 0.5 * felt[5:, None] * np.ones(3), rtol=1e-13)


def test_delays_add_up_and_the_longest_fits():
    found = _course(_effort(neural_delay=0.06, electromechanical_delay=0.04), RAMP)
    np.testing.assert_allclose(found[5:], np.maximum(RAMP[:-5], MINIMUM), rtol=0.0, atol=1e-14)
    for period in (0.02, 0.03, 0.007, LONGEST_DELAY):
        step = np.vstack([np.full((1, 6), 0.1), np.full((200, 6), 0.9)])
        found = _course(_effort(period=period, neural_delay=LONGEST_DELAY), step)
        late = np.flatnonzero(found[:, 0] > 0.1 + 1e-12)[0] - 1
        assert late == int(LONGEST_DELAY / period + 1e-9)
        assert found[-1, 0] == pytest.approx(0.9, rel=1e-15)


def test_co_contraction_drives_the_antagonists_with_the_mean_of_the_agonists():
    command = np.array([0.0, 0.0, 0.0, 0.6, 0.3, 0.0])
    found = _course(_effort(co_contraction=0.5, maximum_activation_extensors=0.8), command[None])[0]
    np.testing.assert_allclose(found[EXTENDS], 0.5 * 0.3, rtol=1e-14)
    np.testing.assert_allclose(found[FLEXES], [0.6, 0.3, MINIMUM], rtol=1e-14)


def test_feedback_helps_where_the_arm_hangs_back():
    command, error = np.full((20, 6), 0.3), np.full(20, 0.2)
    found = _course(
        _effort(feedback_gain=0.5, feedback_delay=0.04, maximum_activation_flexors=0.5), command, error=error
    )
    # Felt at 0 s, it acts 0.04 s later: at the end of the second period.
    assert np.all(found[:1, FLEXES] == 0.3) and np.all(found[:1, EXTENDS] == 0.3)
    np.testing.assert_allclose(found[1:, FLEXES], 0.3 + 0.5 * 0.2, rtol=1e-14)
    np.testing.assert_allclose(found[1:, EXTENDS], 0.3 - 0.5 * 0.2, rtol=1e-14)
    quiet = AtWork(Patient(feedback_gain=0.5), PERIOD, np.random.default_rng(0), feedback=False)
    np.testing.assert_array_equal(_course(quiet, command, error=error), command)


@pytest.mark.parametrize("rate", [-2.0, 2.0])
def test_stretch_reflex_of_the_stretched_group_only(rate):
    fields = {"spasticity_flexors": 0.3, "spasticity_extensors": 0.1, "stretch_threshold": 0.5, "stretch_delay": 0.04}
    found = _course(_effort(**fields), np.full((10, 6), 0.05), rate=np.full(10, rate))
    stretched, gain = (FLEXES, 0.3) if rate < 0 else (EXTENDS, 0.1)
    assert np.all(found[:1] == 0.05)
    np.testing.assert_allclose(found[1:, stretched], 0.05 + gain * (2.0 - 0.5), rtol=1e-14)
    assert np.all(found[:, ~stretched] == 0.05)


def test_no_stretch_reflex_below_the_threshold():
    fields = {"spasticity_flexors": 2.0, "spasticity_extensors": 2.0, "stretch_threshold": 0.8, "stretch_delay": 0.0}
    for rate in (-0.8, -0.79, 0.0, 0.79, 0.8):
        assert np.all(_course(_effort(**fields), np.full((5, 6), 0.05), rate=np.full(5, rate)) == 0.05)
    for rate in (-0.81, 0.81):
        assert np.any(_course(_effort(**fields), np.full((5, 6), 0.05), rate=np.full(5, rate)) > 0.05)


def test_reflex_is_not_weakened_and_stays_within_the_limits():
    fields = {
        "maximum_activation_flexors": 0.0,
        "spasticity_flexors": 0.3,
        "stretch_threshold": 0.0,
        "stretch_delay": 0.0,
    }
    found = _course(_effort(**fields), np.full((3, 6), 0.5), rate=np.array([-1.0, -100.0, 0.0]))
    np.testing.assert_allclose(found[:, 3], [0.3, 1.0, MINIMUM], rtol=1e-14)


def test_tremor_is_a_sine_in_opposite_phase():
    n, f = 500, 4.0
    effort = _effort(tremor_amplitude=0.05, tremor_frequency=f)
    found = _course(effort, np.full((n, 6), 0.4)) - 0.4
    # After 40 whole cycles the phase is that of the start; the value is that of the end of the period.
    start = effort.phase
    assert found[0, 3] == pytest.approx(0.05 * np.sin(start + 2.0 * np.pi * f * PERIOD), abs=1e-12)
    np.testing.assert_allclose(found[:, 3], -found[:, 0], rtol=0.0, atol=1e-14)
    spectrum = np.abs(np.fft.rfft(found[:, 3])) * 2.0 / n
    peak = round(f * n * PERIOD)
    # 4 Hz is 40 whole cycles in 10 s: a single line, up to the rounding of a phase summed 500 times.
    assert spectrum[peak] == pytest.approx(0.05, rel=1e-9)
    assert np.delete(spectrum, peak).max() < 1e-9


def test_width_of_the_tremors_peak():
    width = 0.8
    effort = _effort(tremor_amplitude=0.1, tremor_frequency=5.0, tremor_width=width)
    phases = []
    for _ in range(4000):
        effort.step(np.full(6, 0.5))
        phases.append(effort.phase)
    wander = np.angle(np.exp(1j * (np.diff(phases) - 2.0 * np.pi * 5.0 * PERIOD)))
    # Variance of a sample of 4000 normal numbers: standard error 2.2 %, four of them allowed.
    assert np.var(wander) == pytest.approx(2.0 * np.pi * width * PERIOD, rel=0.09)


def _published(wanted, start, F, R, r, times):
    """Three-compartment controller with all three states and its three cases, by an integrator of high accuracy."""

    def rates(t, m):
        active, rest, fatigued = m
        target = wanted(t)
        if active >= target:
            flow = L * (target - active)
        elif rest > target - active:
            flow = L * (target - active)
        else:
            flow = L * rest
        recovery = R * (r if target < REST else 1.0)
        return [flow - F * active, -flow + recovery * fatigued, F * active - recovery * fatigued]

    return solve_ivp(rates, (0.0, times[-1]), start, t_eval=times, rtol=1e-9, atol=1e-11, max_step=0.05).y


def test_fatigue_against_the_published_equations():
    F, R, r, n = 0.00912, 0.00094, 15.0, 6000

    def wanted(t):
        return (0.9, 0.0, 0.5)[min(int(t / 40.0), 2)]

    times = np.arange(n + 1) * PERIOD
    found = [(0.0, 0.0)]
    for t in times[:-1]:
        found.append(advance_fatigue(*found[-1], wanted(t + 0.5 * PERIOD), F, R, r, PERIOD))
    active, rest, fatigued = _published(wanted, [0.0, 1.0, 0.0], F, R, r, times)
    # Four stages over a fifth of the fastest time constant: (0.2)^5 / 120 = 2.7e-6 a step, at transients only; the
    # step within which units run out has a kink.
    np.testing.assert_allclose(np.array(found), np.column_stack([active, fatigued]), rtol=0.0, atol=2e-5)
    np.testing.assert_allclose(active + rest + fatigued, 1.0, rtol=0.0, atol=1e-9)
    assert 0.2 < fatigued.max() < 0.4 and fatigued[-1] > 0.1


def test_fatigue_settles_where_loss_and_recovery_balance():
    F, R = 0.2, 0.05
    active, fatigued = 0.0, 0.0
    for _ in range(200):
        active, fatigued = advance_fatigue(active, fatigued, 1.0, F, R, 1.0, 1.0)
    # M_R' = R M_F - L M_R = 0, M_F' = 0: M_F = F/R M_A, M_R = F/L M_A, their sum 1.
    assert active == pytest.approx(1.0 / (1.0 + F / R + F / L), rel=1e-9)
    assert fatigued == pytest.approx(F / R * active, rel=1e-9)


def test_fatigue_limits_what_effort_can_activate():
    effort = _effort(fatigue_rate=0.05, recovery_rate=0.0, maximum_activation_flexors=0.5)
    command = np.array([0.0, 0.0, 0.0, 1.0, 0.2, 0.0])
    found = _course(effort, np.tile(command, (1000, 1)))
    assert found[0, 3] == 0.5 and np.all(np.diff(found[:, 3]) < 0.0)
    assert found[-1, 3] == pytest.approx(0.5 * (1.0 - effort.fatigued[3]), rel=2e-3)
    assert np.all(found[:, 4] == 0.2)  # 40 % of the half are held as long as 60 % may be fatigued
    assert np.all(effort.fatigued[[0, 1, 2, 5]] == 0.0)
    assert _course(_effort(fatigued_at_start=0.3), command[None])[0, 3] == pytest.approx(0.7, rel=1e-14)


@pytest.mark.parametrize(("error", "sign"), [(-0.02, -1), (0.0, -1), (0.01, -1), (0.1, 1)])
def test_effort_is_forgotten_and_every_error_recruits_it(error, sign):
    # At s = 1 both balance at an error of 0.5 x 0.8 / 10 = 0.04 rad.
    effort = _effort(slacking_rate=0.5, least_effort=0.2, effort_recovery=10.0)
    found = _course(effort, np.full((50, 6), 0.3), error=np.full(50, error))
    assert np.all(np.sign(np.diff(found[:, 3])) == sign)
    # Excitations follow a period later.
    assert found[-1, 3] == pytest.approx(0.3 * effort.effort, rel=0.03)
    other = _effort(slacking_rate=0.5, least_effort=0.2)
    _course(other, np.full((50, 6), 0.3), error=np.full(50, error))
    # No error is too small to count.
    assert (effort.effort > other.effort) == (error > 0.0) and (effort.effort < other.effort) == (error < 0.0)


@pytest.mark.parametrize("rate", [0.0, 0.4])
def test_effort_follows_its_equation(rate):
    # s' = -rate (s - least) + recovery e, against scipy.
    least, recovery, e = 0.2, 3.0, 0.03
    s = 0.9
    for _ in range(150):
        s = advance_effort(s, e, rate, recovery, least, PERIOD)
    exact = solve_ivp(lambda t, y: -rate * (y - least) + recovery * e, (0.0, 3.0), [0.9], rtol=1e-10, atol=1e-12)
    assert s == pytest.approx(exact.y[0, -1], rel=1e-8)
    assert s == pytest.approx(advance_effort(0.9, e, rate, recovery, least, 3.0), rel=1e-12)


def test_effort_of_one_movement_after_another_is_that_of_emken():
    # u_{i+1} = f u_i + g x_i with rate = -ln(f) / T; the error of a movement lasts it, so g = recovery (1 - f) / rate.
    f, duration, recovery, errors = 0.8, 2.0, 2.0, (0.1, 0.05, 0.02, 0.0)
    rate, u, s = -np.log(f) / duration, 1.0, 1.0
    for x in errors:
        u = f * u + recovery * (1.0 - f) / rate * x
        s = advance_effort(s, x, rate, recovery, 0.0, duration)
        assert s == pytest.approx(u, rel=1e-12)


def test_effort_stays_between_nothing_and_twice_the_plan():
    assert advance_effort(1.0, 10.0, 0.1, 5.0, 0.0, 1.0) == MOST_EFFORT
    assert advance_effort(1.0, -10.0, 0.1, 5.0, 0.5, 1.0) == 0.0
    weak = _effort(maximum_activation_flexors=0.4, effort_recovery=5.0)
    found = _course(weak, np.full((200, 6), 0.3), error=np.full(200, 0.3))
    # Twice the plan is more than what is left.
    assert weak.effort == MOST_EFFORT and found[-1, 3] == pytest.approx(0.4, rel=1e-15)


def test_half_the_period_gives_the_same_patient():
    fields = {**IMPAIRED, "tremor_amplitude": 0.0, "neural_delay": 0.06, "electromechanical_delay": 0.04}
    fields["stretch_delay"] = 0.02  # all multiples of both periods
    command = np.full((100, 6), 0.5)
    coarse = _effort(**fields)
    fine = _effort(period=PERIOD / 2, **fields)
    signals = {"error": np.full(100, 0.02), "rate": np.full(100, 1.0)}
    a = _course(coarse, command, **signals)
    b = _course(fine, np.repeat(command, 2, axis=0), **{k: np.repeat(v, 2) for k, v in signals.items()})
    # Effort is integrated exactly; what is fatigued is that of a period's beginning: 0.02 / s in 0.01 s.
    np.testing.assert_allclose(b[1::2], a, rtol=0.0, atol=2e-4)
    assert coarse.effort == pytest.approx(fine.effort, rel=1e-12)


def test_same_seed_same_bits_other_seed_other_tremor():
    runs = [_course(_effort(seed, **IMPAIRED), RAMP, rate=np.cos(np.arange(60.0))) for seed in (3, 3, 4)]
    np.testing.assert_array_equal(runs[0], runs[1])
    assert np.abs(runs[0] - runs[2]).max() > 1e-3


def test_draws_do_not_depend_on_the_patient():
    numbers = []
    for fields in ({}, IMPAIRED):
        generator = np.random.default_rng(1)
        _course(AtWork(Patient(**fields), PERIOD, generator), RAMP)
        numbers.append(generator.random())
    assert numbers[0] == numbers[1]


def test_reset_forgets():
    effort = _effort(**{**IMPAIRED, "tremor_amplitude": 0.0})
    first = _course(effort, RAMP)
    np.testing.assert_array_equal(_course(effort, RAMP), first)


def test_reset_gives_the_excitations_of_a_long_held_command():
    effort = _effort(**{**IMPAIRED, "tremor_amplitude": 0.0, "fatigue_rate": 0.0})
    start = effort.reset(RAMP[30])
    np.testing.assert_allclose(effort.step(RAMP[30]), start, rtol=1e-14)
    assert start[3] == pytest.approx(RAMP[30, 3] + 0.3 * RAMP[30, :3].mean(), rel=1e-14)


def test_states_of_a_batch_are_the_single_patients():
    """Whatever stood in the arrays before."""
    patients = [Patient(**IMPAIRED), Patient(neural_delay=0.1), Patient(tremor_amplitude=0.1, co_contraction=0.4)]
    states, out = [new_effort(SIGN, PERIOD) for _ in patients], np.empty((3, 6))
    generators = [np.random.default_rng(9) for _ in patients]
    singles = [AtWork(p, PERIOD, np.random.default_rng(9)) for p in patients]
    for k, patient in enumerate(patients):
        # What the patient knows of the limb is put in place by another function.
        for name in set(states[k]._fields) - {"sign", "limb", "levers"}:
            getattr(states[k], name)[:] = np.nan
        reset_effort(patient.row(), states[k], PERIOD, RAMP[0], MIDDLE, generators[k].uniform(0.0, 2.0 * np.pi))
        singles[k].reset(RAMP[0])
    for row in RAMP:
        for k, patient in enumerate(patients):
            noise = generators[k].standard_normal()
            step_effort(patient.row(), states[k], PERIOD, row, 0.1, 0.0, 1.0, 0.7, noise, out[k])
            np.testing.assert_array_equal(out[k], singles[k].step(row, error=0.1, angle=1.0, rate=0.7))
    assert all(np.isfinite(array).all() for state in states for array in state)


def test_an_arm_of_two_flexors_has_nothing_to_co_contract():
    patient, state, out = Patient(co_contraction=0.5), new_effort(np.ones(2), PERIOD), np.empty(2)
    wanted = np.array([0.3, 0.6])
    reset_effort(patient.row(), state, PERIOD, wanted, MIDDLE, 0.0)
    step_effort(patient.row(), state, PERIOD, wanted, 0.0, 0.0, 1.0, 0.0, 0.0, out)
    np.testing.assert_array_equal(out, wanted)


def test_excitations_stay_within_the_limits_whatever_happens():
    generator = np.random.default_rng(5)
    effort = _effort(**{**IMPAIRED, "tremor_amplitude": 0.5, "spasticity_flexors": 2.0, "feedback_gain": 5.0})
    for _ in range(2000):
        rate, error = 10.0 * generator.standard_normal(2)
        u = effort.step(generator.random(6), rate=rate, error=error)
        assert np.all((u >= MINIMUM) & (u <= 1.0))
    assert 0.0 <= effort.effort <= MOST_EFFORT and np.all((effort.fatigued >= 0.0) & (effort.fatigued <= 1.0))


def test_who_wants_more_than_is_left_drives_the_antagonists_no_further():
    """Weak flexors at their ceiling, a large error: the triceps gets its share of what the flexors give."""
    weak = _effort(maximum_activation_flexors=0.2, co_contraction=0.5, feedback_gain=3.0, feedback_delay=0.02)
    found = _course(weak, np.full((5, 6), 0.2), error=np.full(5, 0.3))[-1]
    np.testing.assert_allclose(found[FLEXES], 0.2, rtol=1e-14)
    np.testing.assert_allclose(found[EXTENDS], 0.5 * 0.2, rtol=1e-14)
