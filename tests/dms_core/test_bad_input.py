"""What a user can get wrong: each mistake is one clear error that names the culprit, its value and what is right."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from dms_core import InputError, Model, ModelError, Simulation, SolverOptions, System, simulate
from dms_core.errors import AssemblyError
from dms_core.model import (
    AngleDriver,
    Distance,
    Fixed,
    Gravity,
    Harmonic,
    Input,
    JointAngle,
    Lines,
    LumpedLoad,
    PathPoint,
    PointMass,
    Revolute,
    RigidBody,
    RopeForce,
    Slider,
    Spherical,
    Steps,
    ThelenMuscle,
)


def rod(name: str = "rod", **changes) -> RigidBody:
    return RigidBody(**{"name": name, "mass": 1.0, "inertia": (0.1, 0.1, 0.1)} | changes)


def hinge(**changes) -> Revolute:
    return Revolute(**{"name": "hinge", "body_j": "rod"} | changes)


def path_to(body: str) -> tuple[PathPoint, ...]:
    return PathPoint(point=(0.0, 0.1, 0.0)), PathPoint(body=body, point=(0.0, -0.2, 0.0))


class TestNames:
    @pytest.mark.parametrize(
        ("parts", "message"),
        [
            ({"constraints": [hinge(body_j="rood")]}, r"revolute 'hinge': body 'rood' does not exist.*ground, rod"),
            ({"constraints": [hinge(body_i="wall")]}, r"revolute 'hinge': body 'wall' does not exist.*ground, rod"),
            (
                {"forces": [Gravity(name="g", bodies=("rood",))]},
                r"gravity 'g': body 'rood' does not exist.*ground, rod",
            ),
            (
                {"sensors": [JointAngle(name="s", joint="elbow")], "constraints": [hinge()]},
                r"joint_angle 's': 'elbow' does not exist\. Expected the name of a .*Revolute .*\. Declared: hinge",
            ),
            (
                {"sensors": [JointAngle(name="s", joint="rod")], "constraints": [hinge()]},
                r"joint_angle 's': 'rod' is a rigid_body\. Expected the name of a .*Revolute .*\. Declared: hinge",
            ),
            (
                {"forces": [LumpedLoad(name="l", body="rod", input="pull")]},
                r"lumped_load 'l': input 'pull' does not exist\. Declared: none",
            ),
            (
                {"forces": [RopeForce(name="r", path=path_to("rod"), coordinate="motor.tension")]},
                r"rope_force 'r': coordinate 'motor.tension' does not exist\. Declared: .*rod.x",
            ),
        ],
    )
    def test_unknown_name(self, parts, message):
        with pytest.raises(ModelError, match=message):
            Model(System(bodies=[rod()], **parts))

    def test_duplicate_name(self):
        with pytest.raises(ModelError, match="'rod' is used by a rigid_body and .*revolute; names must be unique"):
            System(bodies=[rod()], constraints=[hinge(name="rod")])

    def test_ground_is_taken(self):
        with pytest.raises(ModelError, match="'ground' is reserved"):
            System(bodies=[rod("ground")])

    def test_unknown_key(self):
        with pytest.raises(ModelError, match=r"rigid_body 'rod': unknown key 'weight'\. Allowed: .*mass"):
            rod(weight=3.0)

    def test_wrong_list(self):
        with pytest.raises(ModelError, match="constraints: .* is not a Constraint"):
            System(bodies=[rod()], constraints=[Gravity(name="g")])


def muscle(**changes) -> ThelenMuscle:
    facts = {
        "name": "biceps",
        "path": path_to("rod"),
        "excitation": "u",
        "max_isometric_force": 100.0,
        "optimal_fibre_length": 0.1,
        "tendon_slack_length": 0.2,
    }
    return ThelenMuscle(**facts | changes)


NUMBERS = {
    "zero mass": (lambda: rod(mass=0.0), r"rigid_body 'rod': mass = 0.0: Expected a number above 0"),
    "negative mass": (
        lambda: PointMass(name="ball", mass=-2.0),
        r"point_mass 'ball': mass = -2.0: Expected a number above 0",
    ),
    "infinite mass": (lambda: rod(mass=math.inf), r"rigid_body 'rod': mass = inf: Expected a finite number"),
    "negative inertia": (lambda: rod(inertia=(0.1, -0.1, 0.1)), r"principal moments .* must be positive"),
    "inertia of no body": (
        lambda: rod(inertia=(1.0, 1.0, 2.1)),
        r"rigid_body 'rod': inertia .*2.1.* violate the triangle inequality: the largest must not exceed the sum",
    ),
    "rotated inertia of no body": (
        lambda: rod(inertia=(1.0, 1.0, 1.0, 0.7, 0.0, 0.0)),  # principal moments 0.3, 1, 1.7
        r"0.3, 1, 1.7 kg m\^2 violate the triangle inequality",
    ),
    "two numbers of inertia": (lambda: rod(inertia=(1.0, 1.0)), r"inertia = \(1.0, 1.0\): 2 numbers; give 3"),
    "no orientation": (
        lambda: rod(orientation=(0.0, 0.0, 0.0, 0.0)),
        r"Euler parameters have length 0; \(1, 0, 0, 0\)",
    ),
    "negative tension": (
        lambda: RopeForce(name="rope", path=path_to("rod"), tension=-5.0),
        r"rope_force 'rope': tension = -5.0: Expected a number of at least 0",
    ),
    "no tension": (
        lambda: RopeForce(name="rope", path=path_to("rod")),
        r"rope_force 'rope': no tension; give exactly one of tension, input, coordinate",
    ),
    "rope of one point": (
        lambda: RopeForce(name="rope", path=path_to("rod")[:1], tension=1.0),
        r"rope_force 'rope': path = .*Expected at least 2 items, got 1",
    ),
    "negative tendon": (
        lambda: muscle(tendon_slack_length=-0.1),
        r"thelen_muscle 'biceps': tendon_slack_length = -0.1: Expected a number above 0",
    ),
    "times that fall": (
        lambda: Steps(times=(0.0, 2.0, 1.0), values=(0.0, 1.0, 2.0)),
        r"times must increase; times\[1\] = 2.0, times\[2\] = 1.0",
    ),
    "a NaN among values": (
        lambda: Lines(times=(0.0, 1.0), values=(0.0, math.nan)),
        r"values.1 = nan: Expected a finite number",
    ),
    "values missing": (
        lambda: Input(name="u", signal=Steps(times=(0.0, 1.0), values=(1.0,))),
        r"2 times but 1 values; give one value for each time",
    ),
}


@pytest.mark.parametrize("mistake", NUMBERS)
def test_impossible_number(mistake):
    declare, message = NUMBERS[mistake]
    with pytest.raises((ModelError, InputError), match=message):
        declare()


class TestGeometry:
    @pytest.mark.parametrize("key", ["axis_i", "axis_j"])
    def test_axis_of_length_0(self, key):
        system = System(bodies=[rod()], constraints=[hinge(**{key: (0.0, 0.0, 0.0)})])
        message = rf"revolute 'hinge': {key} = \(0.0, 0.0, 0.0\) has length 0; give a direction"
        with pytest.raises(ModelError, match=message):
            Model(system)

    def test_slider_axis_of_length_0(self):
        system = System(bodies=[rod()], constraints=[Slider(name="rail", body_j="rod", axis_i=(0.0, 0.0, 0.0))])
        with pytest.raises(ModelError, match=r"slider 'rail': axis_i = .* has length 0; give a direction"):
            Model(system)

    def test_a_rope_that_cannot_change_its_length(self):
        rope = RopeForce(name="rope", path=(path_to("rod")[1], path_to("rod")[1]), tension=1.0)
        with pytest.raises(ModelError, match=r"rope_force 'rope': all points of the path are on 'rod'"):
            Model(System(bodies=[rod()], forces=[rope]))

    def test_a_loop_that_cannot_close_names_joint_and_gap(self):
        # Two bars of 1 m between pivots 2.5 m apart: 0.5 m are missing. The three joints of the loop share them, so
        # that the widest gap is between a third of it and all of it.
        left = rod("left")
        right = rod("right", position=(2.5, 0.0, 0.0))
        joints = [
            Spherical(name="pivot", body_j="left", point_j=(0.0, 0.0, 0.0)),
            Spherical(name="middle", body_i="left", body_j="right", point_i=(1.0, 0.0, 0.0), point_j=(-1.0, 0.0, 0.0)),
            Spherical(name="end", body_j="right", point_i=(2.5, 0.0, 0.0), point_j=(0.0, 0.0, 0.0)),
        ]
        message = (
            r"system 'loop' cannot be assembled: constraint '(?:pivot|middle|end)\.x' stays open by (\S+) .*lengths"
        )
        with pytest.raises(AssemblyError, match=message) as caught:
            Model(System("loop", bodies=[left, right], constraints=joints))
        assert 0.5 / 3.0 <= float(re.search(message, str(caught.value))[1]) <= 0.5

    def test_a_rod_that_is_too_short(self):
        ball = PointMass(name="ball", mass=1.0, position=(1.0, 0.0, 0.0))
        near = Distance(name="near", body_j="ball", length=1.0)
        far = Distance(name="far", body_j="ball", point_i=(3.0, 0.0, 0.0), length=1.0)
        with pytest.raises(AssemblyError, match=r"constraint '(near|far)\.\w+' stays open by"):
            Model(System(bodies=[ball], constraints=[near, far]))

    @pytest.mark.parametrize("joint", [Fixed, Slider])
    def test_a_weld_or_slider_turned_over(self, joint):
        """Its directions are perpendicular there, too."""
        more = {"axis_i": (1.0, 0.0, 0.0)} if joint is Slider else {}
        turned = joint(name="joint", body_j="rod", orientation=(0.05, 0.0, 0.0, 1.0), **more)
        with pytest.raises(AssemblyError, match="'joint' can be assembled only with 'rod' turned over by half a turn"):
            Model(System(bodies=[rod()], constraints=[turned]))

    def test_a_hinge_whose_axes_are_opposite(self):
        with pytest.raises(AssemblyError, match="revolute 'hinge' .* only with 'rod' turned over .*, or reverse the"):
            Model(System(bodies=[rod()], constraints=[hinge(axis_j=(0.0, 0.0, -1.0))]))

    def test_a_pointer_along_the_axis(self):
        """Bodies that know the axis by other names: body_i's pointer (0, 1, 0) is the axis of body_j."""
        joint = hinge(axis_i=(0.0, 0.0, 1.0), axis_j=(0.0, 1.0, 0.0))
        upright = rod(orientation=(math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0))
        parts = {"bodies": [upright], "constraints": [joint]}
        with pytest.raises(ModelError, match=r"joint_angle 's': pointer_j = .* lies along the axis of 'hinge'"):
            Model(System(**parts, sensors=[JointAngle(name="s", joint="hinge")]))
        Model(System(**parts, sensors=[JointAngle(name="s", joint="hinge", pointer_j=(1.0, 0.0, 0.0))]))

    def test_velocities_that_contradict_a_joint_beside_a_driven_mechanism(self):
        """What the driver moves may start with any guess; the other mechanism must fit."""
        driven = rod("driven", position=(0.0, 2.0, 0.0), angular_velocity=(0.0, 0.0, 1.0))
        other = PointMass(name="bob", mass=1.0, position=(1.0, 0.0, 0.0), velocity=(0.5, 1.0, 0.0))
        joints = [Revolute(name="axle", body_j="driven", point_i=(0.0, 2.0, 0.0))]
        joints += [AngleDriver(name="motor", joint="axle", input="turn"), Distance(name="string", body_j="bob")]
        turn = Input(name="turn", signal=Harmonic(amplitude=1.0, frequency=3.0 / (2.0 * math.pi)))
        parts = {"constraints": joints, "inputs": [turn]}
        with pytest.raises(AssemblyError, match=r"'string.length' would open .* changes 'bob.x' from 0.5 to 0;"):
            Model(System(bodies=[driven, other], **parts))
        fitting = other.model_copy(update={"velocity": (0.0, 1.0, 0.0)})
        start = Model(System(bodies=[driven, fitting], **parts)).start
        assert np.abs(start.v).max() == pytest.approx(1.5), "half of 3 rad/s in the Euler parameters"

    def test_velocities_that_contradict_a_joint(self):
        system = System(bodies=[rod(velocity=(1.0, 0.0, 0.0))], constraints=[hinge()])
        message = r"constraint 'hinge.x' would open at -?1 \(m/s or 1/s\).* changes 'rod.x' from 1 to 0"
        with pytest.raises(AssemblyError, match=message):
            Model(system)

    def test_velocities_that_agree_are_kept(self):
        spinning = rod(position=(0.5, 0.0, 0.0), velocity=(0.0, 1.0, 0.0), angular_velocity=(0.0, 0.0, 2.0))
        model = Model(System(bodies=[spinning], constraints=[hinge(point_j=(-0.5, 0.0, 0.0))]))
        assert model.start.v[:3] == pytest.approx([0.0, 1.0, 0.0], abs=1e-12)  # as declared, to rounding

    def test_a_tendon_longer_than_itspath_to(self):
        system = System(bodies=[rod()], forces=[muscle(tendon_slack_length=0.5)], inputs=[Input(name="u")])
        message = (
            r"thelen_muscle 'biceps': its path is 0.3 m long, the tendon slack length is 0.5 m; .*"
            r"Shorten the tendon slack length or move the path points apart"
        )
        with pytest.raises(ModelError, match=message):
            Model(system)

    def test_a_system_without_coordinates(self):
        with pytest.raises(ModelError, match="system 'nothing' has no coordinates: declare at least one body"):
            Model(System("nothing"))


class TestOptions:
    @pytest.mark.parametrize("value", [0.0, -1e-6, math.nan, math.inf])
    @pytest.mark.parametrize("option", ["rtol", "atol", "fixed_step", "h_max"])
    def test_out_of_range(self, option, value):
        with pytest.raises(InputError, match=rf"solver option {option}: Expected a positive number.*, got {value!r}"):
            SolverOptions(**{option: value})

    @pytest.mark.parametrize("value", [0, -1, 0.5, 1.5, math.nan, math.inf, 1e300, True])
    def test_numbers_of_steps(self, value):
        with pytest.raises(InputError, match=r"solver option max_steps: Expected a positive whole number"):
            SolverOptions(max_steps=value)

    def test_the_smallest_step_is_not_above_the_largest(self):
        with pytest.raises(InputError, match=r"solver option h_min: Expected at most h_max = 0.01 s, got 0.1 s"):
            SolverOptions(h_min=0.1, h_max=0.01)

    def test_a_step_longer_than_the_run(self):
        with pytest.raises(InputError, match=r"fixed_step: Expected at most t_end = 1.0 s, got 5.0 s"):
            simulate(System(bodies=[rod()]), 1.0, SolverOptions(fixed_step=5.0))

    def test_an_end_that_is_no_multiple_of_the_step_is_said(self):
        run = simulate(System(bodies=[rod()]), 1.0, SolverOptions(fixed_step=0.3))
        assert "Steps of 0.3 s; the shortest, which ends on a jump of an input or on an end time" in run.message
        assert "is 0.1 s" in run.message
        whole = simulate(System(bodies=[rod()]), 1.0, SolverOptions(fixed_step=0.1))
        assert whole.message == whole.result.value

    @pytest.mark.parametrize("t", [-1.0, 0.05, math.nan, math.inf])
    def test_an_end_before_the_present(self, t):
        simulation = Simulation(System(bodies=[rod()]))
        simulation.advance(0.1)
        with pytest.raises(InputError, match=r"t_end: Expected a time of at least the present 0.1 s"):
            simulation.advance(t)

    @pytest.mark.parametrize("sample", [0.0, -1.0, math.nan, math.inf])
    def test_times_between_rows(self, sample):
        run = simulate(System(bodies=[rod()]), 0.1)
        with pytest.raises(InputError, match=r"sample: Expected a positive time"):
            run.grid(sample)

    @pytest.mark.parametrize("t_end", [0.0, -1.0, math.nan])
    def test_end_time(self, t_end):
        with pytest.raises(InputError, match=rf"t_end: Expected a positive time, got {t_end} s"):
            simulate(System(bodies=[rod()]), t_end)
