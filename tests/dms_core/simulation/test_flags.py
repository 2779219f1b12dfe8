"""What the result of a run flags: ropes that push, fibres at the ends of their range."""

from __future__ import annotations

import json

import numpy as np
import pytest

from dms_core import Result, SolverOptions, System, World, simulate
from dms_core.model import (
    Constant,
    FirstOrder,
    Gravity,
    Harmonic,
    Input,
    LumpedLoad,
    PathPoint,
    PointMass,
    RopeForce,
    RopeLength,
    Steps,
    ThelenMuscle,
)

BALL = PointMass(name="ball", mass=1.0, position=(1.0, 0.0, 0.0))
PATH = PathPoint(point=(0.0, 0.0, 0.0)), PathPoint(body="ball", point=(0.0, 0.0, 0.0))


def _pulled(signal) -> System:
    """A ball on a rope of fixed length along x, pulled away from its anchor with u newtons."""
    return System(
        bodies=[BALL],
        constraints=[RopeLength(name="cable", path=PATH)],
        forces=[LumpedLoad(name="pull", body="ball", force=(1.0, 0.0, 0.0), input="u")],
        inputs=[Input(name="u", signal=signal)],
    )


ACCURACIES = {
    "default": SolverOptions(),
    "loose": SolverOptions(rtol=1e-3),
    "rough": SolverOptions(rtol=1e-2),
    "sdirk2": SolverOptions(method="sdirk2"),
    "radau5": SolverOptions(method="radau5"),
    "rough sdirk2": SolverOptions(method="sdirk2", rtol=1e-2),
    "fixed 0.01": SolverOptions(fixed_step=0.01),
    "fixed 0.001": SolverOptions(fixed_step=0.001),
    "fixed 0.001 sdirk2": SolverOptions(fixed_step=0.001, method="sdirk2"),
}


class TestRopes:
    def test_a_rope_that_pushes_is_flagged_with_when_and_how_much(self):
        run = simulate(_pulled(Constant(value=-10.0)), 0.5).check()
        (flag,) = run.flags
        assert (flag.element, flag.kind, flag.first, flag.unit) == ("cable", "rope_length", 0.0, "N")
        assert flag.worst == pytest.approx(-10.0, rel=1e-9) and flag.total == pytest.approx(0.5, rel=1e-9)
        assert run.result is Result.SUCCESS
        assert run.message.startswith(Result.SUCCESS.value) and flag.sentence in run.message
        assert "rope_length 'cable': its tension was negative" in flag.sentence

    @pytest.mark.parametrize("pull", [10.0, 0.0])
    def test_a_rope_that_pulls_or_hangs_is_not(self, pull):
        run = simulate(_pulled(Constant(value=pull)), 0.5).check()
        assert run.flags == () and run.message == Result.SUCCESS.value

    @pytest.mark.parametrize("options", ACCURACIES.values(), ids=ACCURACIES)
    def test_nor_is_a_moving_one_whose_tension_touches_0(self, options):
        """A ball released from where its rope is level: 3 m g sin(angle) is 0 at every turn, but for errors."""
        system = System(
            bodies=[BALL],
            constraints=[RopeLength(name="cable", path=PATH)],
            forces=[Gravity(name="gravity", acceleration=(0.0, -9.81, 0.0))],
        )
        run = simulate(system, 5.0, options).check()
        assert run.flags == () and run.message.startswith(Result.SUCCESS.value)
        # The error is there: without room for it the default run would be flagged.
        assert options != SolverOptions() or run.lam.min() < -1e-4

    @pytest.mark.parametrize("options", ACCURACIES.values(), ids=ACCURACIES)
    @pytest.mark.parametrize("mass", [1.0, 1e5])
    def test_nor_is_a_rope_that_is_paid_out_with_gravity(self, mass, options):
        """Its length is 1 m + 0.2 m sin(7 t), with 7^2 0.2 m = g: the tension m (g - psi'') touches 0 once a period."""
        psi = Harmonic(offset=1.0, amplitude=0.2, frequency=np.sqrt(9.81 / 0.2) / (2.0 * np.pi))
        system = System(
            bodies=[PointMass(name="ball", mass=mass, position=(0.0, -1.0, 0.0))],
            constraints=[RopeLength(name="cable", path=PATH, input="psi")],
            forces=[Gravity(name="gravity", acceleration=(0.0, -9.81, 0.0))],
            inputs=[Input(name="psi", signal=psi)],
        )
        assert simulate(system, 2.0, options).check().flags == ()

    @pytest.mark.parametrize("options", ACCURACIES.values(), ids=ACCURACIES)
    @pytest.mark.parametrize("push", [-0.9, -0.01])
    def test_a_steady_push_is_flagged_whatever_peak_is_beside_it(self, push, options):
        """1000 N for 0.1 s, then -0.9 N or -0.01 N: a thousandth of the peak and less."""
        lag = FirstOrder(name="motor", time_constant=0.01, input="u", scale=10.0)
        system = System(
            bodies=[PointMass(name="ball", mass=1e3, position=(1.0, 0.0, 0.0))],
            forces=[lag, RopeForce(name="rope", path=PATH, coordinate="motor.x")],
            inputs=[Input(name="u", signal=Steps(times=(0.0, 0.1), values=(1000.0, push)))],
        )
        (flag,) = simulate(system, 1.0, options).check().flags
        # 1000 N need 0.07 s or 0.12 s to fall below the push.
        assert flag.element == "rope" and flag.total > 0.6

    @pytest.mark.parametrize("push", [-0.9, -0.01])
    def test_so_is_one_of_a_rope_of_fixed_length(self, push):
        steps = Steps(times=(0.0, 0.1), values=(1000.0, push))
        (flag,) = simulate(_pulled(steps), 1.0).check().flags
        assert flag.worst == pytest.approx(push, rel=1e-6) and flag.total == pytest.approx(0.9, abs=1e-3)

    def test_a_short_push_is_no_error_of_the_run(self):
        """-5 N for 2 ms beside 30 N."""
        steps = Steps(times=(0.0, 0.1, 0.102), values=(30.0, -5.0, 30.0))
        (flag,) = simulate(_pulled(steps), 0.2, SolverOptions(fixed_step=0.01)).check().flags
        assert flag.worst == pytest.approx(-5.0, rel=1e-6)

    @pytest.mark.parametrize("options", ACCURACIES.values(), ids=ACCURACIES)
    def test_a_tension_that_fades_to_0_does_not_push(self, options):
        lag = FirstOrder(name="motor", time_constant=0.01, input="u", scale=10.0)
        system = System(
            bodies=[PointMass(name="ball", mass=1e3, position=(1.0, 0.0, 0.0))],
            forces=[lag, RopeForce(name="rope", path=PATH, coordinate="motor.x")],
            inputs=[Input(name="u", signal=Steps(times=(0.0, 0.1), values=(1000.0, 0.0)))],
        )
        run = simulate(system, 1.0, options).check()
        # A step as long as the motor's time constant is too coarse: 2 % of 1000 N below 0, and the run says so.
        assert bool(run.flags) == (options.fixed_step == 0.01 and options.method == "bdf2")

    def test_the_first_time_is_that_of_the_change_of_sign(self):
        run = simulate(_pulled(Harmonic(amplitude=5.0, frequency=1.0)), 1.0, SolverOptions(h_max=0.01)).check()
        (flag,) = run.flags
        step = run.stats.largest_step
        assert 0.5 <= flag.first <= 0.5 + step and flag.total == pytest.approx(0.5, abs=2.0 * step)
        assert flag.worst == pytest.approx(-5.0, rel=1e-3) and flag.at == pytest.approx(0.75, abs=step)

    def test_a_world_tells_of_the_present(self):
        world = World(_pulled(Constant(value=1.0)))
        world.settle()
        assert world.flags() == ()
        world.set_input("u", -3.0)
        world.advance(0.1)
        assert [f.worst for f in world.flags()] == [pytest.approx(-3.0, rel=1e-9)]

    @pytest.mark.parametrize("command", [-2.0, -1e-9])
    def test_a_negative_command_of_a_rope_force(self, command):
        """An input is exact: any negative one is said, a thousandth of a micronewton too."""
        rope = RopeForce(name="rope", path=PATH, input="u")
        system = System(bodies=[BALL], forces=[rope], inputs=[Input(name="u", signal=Constant(value=command))])
        run = simulate(system, 0.1).check()
        assert [(f.element, f.worst) for f in run.flags] == [("rope", command)]
        assert np.all(run.own_steps().rate("ball.x") == 0.0)  # it pulled nothing

    def test_a_coordinate_that_pushes_through_a_rope(self):
        lag = FirstOrder(name="motor", time_constant=0.01, input="u", scale=10.0)
        rope = RopeForce(name="rope", path=PATH, coordinate="motor.x")
        system = System(bodies=[BALL], forces=[lag, rope], inputs=[Input(name="u", signal=Constant(value=-2.0))])
        (flag,) = simulate(system, 0.1).check().flags
        assert flag.element == "rope" and "it pushed" in flag.sentence and flag.worst == pytest.approx(-2.0, rel=1e-3)


def _muscle(**changes) -> System:
    """A muscle between two fixed points, 0.3 m apart; its tendon is longer than that unless `changes` say so."""
    facts = {
        "name": "biceps",
        "path": (PathPoint(point=(0.0, 0.0, 0.0)), PathPoint(point=(0.3, 0.0, 0.0))),
        "excitation": "u",
        "max_isometric_force": 600.0,
        "optimal_fibre_length": 0.1,
        "tendon_slack_length": 0.31,
        "start_fibre_length": 0.05,
    }
    return System(
        bodies=[BALL],
        forces=[ThelenMuscle(**facts | changes)],
        inputs=[Input(name="u", signal=Constant(value=0.5))],
    )


OPTIONS = {
    "bdf2": SolverOptions(),
    "loose": SolverOptions(rtol=1e-3),
    "sdirk2": SolverOptions(method="sdirk2"),
    "radau5": SolverOptions(method="radau5", rtol=1e-9),
    "fixed": SolverOptions(fixed_step=1e-3),
    "fixed sdirk2": SolverOptions(fixed_step=1e-3, method="sdirk2"),
}


SMALLEST = {
    "straight": (0.0, 0.01 * 0.1),
    "pennate": (0.3, 0.1 * np.sin(0.3) / np.sin(np.arccos(0.1))),
}
"""Pennation [rad] and OpenSim's smallest length [m] of a fibre of 0.1 m."""


class TestFibres:
    @pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS)
    @pytest.mark.parametrize("dynamics", [True, False])
    @pytest.mark.parametrize(("pennation", "least"), SMALLEST.values(), ids=SMALLEST)
    def test_no_fibre_shortens_below_the_smallest_length(self, options, dynamics, pennation, least):
        run = simulate(_muscle(pennation_angle=pennation, activation_dynamics=dynamics), 0.5, options).check()
        fibre, name = run.own_steps().coordinate("biceps.fibre_length"), "biceps.fibre_length"
        assert fibre.min() >= least
        assert run.at(np.linspace(0.0, 0.5, 2001)).coordinate(name).min() >= least * (1.0 - 1e-12)
        # It rests there, within the stop's 1e-2 L0, without a rate: 1e-6 of the fastest one, 1 m/s.
        assert least < fibre[-1] < least + 1e-3 and abs(run.own_steps().rate(name)[-1]) < 1e-6
        (flag,) = run.flags
        assert flag.element == "biceps" and "smallest length" in flag.sentence and flag.unit == "m"
        # From 0.05 m, at 1 m/s at most; radau5 has longer steps, in which the stop is met somewhere.
        slack = 5e-3 if options.method == "radau5" else 2e-3
        assert 0.02 < flag.first < 0.5 and flag.total == pytest.approx(0.5 - flag.first, abs=slack)

    def test_it_leaves_the_stop_when_the_tendon_pulls(self):
        """The path grows from 0.3 to 0.36 m within a second: the tendon becomes taut and stretches the fibre again."""
        ball = PointMass(name="ball", mass=1e6, position=(0.3, 0.0, 0.0), velocity=(0.06, 0.0, 0.0))
        system = _muscle(path=PATH)
        system = System(bodies=[ball], forces=system.forces, inputs=system.inputs)
        run = simulate(system, 1.0).check()
        fibre = run.own_steps().coordinate("biceps.fibre_length")
        assert fibre.min() > 1e-3 and fibre[-1] > 0.03
        (flag,) = run.flags
        assert flag.first + flag.total < 0.9

    def test_a_fibre_beyond_its_passive_curve(self):
        """0.3 m less a tendon of 0.1 m: the fibre lengthens from 0.17 m until the tendon is slack at 0.2 m."""
        (flag,) = simulate(_muscle(tendon_slack_length=0.1, start_fibre_length=0.17), 0.05).check().flags
        assert "longer than (1 + passive_strain) L0" in flag.sentence and flag.first == 0.0
        assert 0.17 <= flag.worst < 0.2

    @pytest.mark.parametrize(("u", "said"), [(3.0, "above 1 and counted as 1"), (-1.0, "below 0 and counted as 0.01")])
    def test_an_excitation_that_is_limited(self, u, said):
        system = _muscle(path=PATH)
        ball = PointMass(name="ball", mass=1e6, position=(0.36, 0.0, 0.0))
        system = System(bodies=[ball], forces=system.forces, inputs=[Input(name="u", signal=Constant(value=u))])
        (flag,) = simulate(system, 0.02).check().flags
        assert said in flag.sentence and flag.worst == u and flag.total == pytest.approx(0.02)

    def test_a_slack_tendon_is_no_leaving(self):
        run = simulate(_muscle(), 0.02).check()
        assert run.flags == ()

    def test_statistics_and_sentence_of_the_command(self, tmp_path, capsys):
        from dms_core.__main__ import main
        from dms_core.model_files.model_file import dump

        model, stats = tmp_path / "m.yaml", tmp_path / "s.json"
        model.write_text(dump(_muscle()))
        arguments = ["run", str(model), "--t-end", "0.3", "--out", str(tmp_path / "x.csv"), "--stats", str(stats)]
        assert main(arguments) == 0
        written = json.loads(stats.read_text())
        assert [f["element"] for f in written["flags"]] == ["biceps"]
        assert written["flags"][0]["sentence"] in written["message"]
        assert (
            "thelen_muscle 'biceps': a stop held its fibre within 0.01 L0 of the smallest length"
            in capsys.readouterr().out
        )
