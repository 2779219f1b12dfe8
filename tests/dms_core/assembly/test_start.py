"""What assembly says about a start that is hardly what its author meant."""

from __future__ import annotations

import warnings

import pytest

from dms_core.assembly.model import Model
from dms_core.assembly.start import FAR
from dms_core.errors import AssemblyError, ModelError, ModelWarning
from dms_core.model import (
    AngleDriver,
    Constant,
    Distance,
    Fixed,
    Harmonic,
    Input,
    LumpedLoad,
    PointMass,
    PositionDriver,
    Revolute,
    RigidBody,
    Spherical,
    SpringDamper,
    System,
)

ROD = {"mass": 1.0, "inertia": (0.1, 0.1, 0.1)}


def _rod(name: str = "rod", **more) -> RigidBody:
    return RigidBody(name=name, **ROD, **more)


def _shifted(distance: float) -> System:
    """A rod whose hinge is at its centre of mass, declared some distance from it."""
    hinge = Revolute(name="hinge", body_j="rod", point_j=(0.0, 0.0, 0.0))
    return System("shifted", bodies=[_rod(position=(distance, 0.0, 0.0))], constraints=[hinge])


@pytest.mark.parametrize(("distance", "said"), [(0.46, "0.46"), (100.0, "100")])
def test_a_start_that_is_moved_far_is_a_warning_with_body_and_distance(distance, said):
    with pytest.warns(ModelWarning, match=rf"system 'shifted': .* moved the body 'rod' by {said} m from its declared"):
        Model(_shifted(distance))


def test_a_rounded_start_is_not_worth_a_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error", ModelWarning)
        Model(_shifted(0.9 * FAR))


def test_the_command_line_says_it_in_one_sentence(tmp_path, capsys):
    from dms_core.__main__ import main
    from dms_core.model_files.model_file import dump

    path = tmp_path / "model.yaml"
    path.write_text(dump(_shifted(0.46)))
    assert main(["check", str(path)]) == 0
    said = capsys.readouterr().err
    assert said.startswith("warning: system 'shifted': closing the joints moved the body 'rod' by 0.46 m")
    assert len(said.splitlines()) == 1 and ".py" not in said


def test_a_start_that_a_driver_moves_is_a_guess():
    """The driver turns the rod, whose declared pose is that of angle 0, by a quarter turn about its end."""
    hinge = Revolute(name="hinge", body_j="rod")
    driver = AngleDriver(name="drive", joint="hinge", input="angle")
    system = System(
        bodies=[_rod(position=(1.0, 0.0, 0.0))],
        constraints=[hinge, driver],
        inputs=[Input(name="angle", signal=Constant(value=1.5))],
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error", ModelWarning)
        assert Model(system).start.moved > 0.5


def _driven(first: float, second: float) -> System:
    """A rod on two hinges of one axis, each with a driver."""
    drivers = [AngleDriver(name=name, joint=f"{name}_hinge", input=f"{name}_angle") for name in ("lift", "hold")]
    inputs = [Input(name=f"{n}_angle", signal=Constant(value=x)) for n, x in (("lift", first), ("hold", second))]
    hinges = [Revolute(name=f"{name}_hinge", body_j="rod") for name in ("lift", "hold")]
    return System("arm", bodies=[_rod()], constraints=[*hinges, *drivers], inputs=inputs)


def test_two_drivers_of_one_joint_are_an_error():
    drivers = [AngleDriver(name=name, joint="hinge", input="angle") for name in ("lift", "hold")]
    with pytest.raises(
        ModelError,
        match=r"angle_driver 'hold' determines the angle of 'hinge', which angle_driver 'lift' determines already",
    ):
        System(bodies=[_rod()], constraints=[Revolute(name="hinge", body_j="rod"), *drivers])


def test_two_drivers_of_one_way_are_an_error():
    drivers = [PositionDriver(name=name, body_j="rod", axis_i=(1.0, 0.0, 0.0), input=name) for name in ("lift", "hold")]
    with pytest.raises(ModelError, match=r"'hold' determines the way of 'rod' along .* 'lift' determines already"):
        System(bodies=[_rod()], constraints=drivers)


def test_drivers_that_contradict_each_other_are_named():
    with pytest.raises(
        AssemblyError, match=r"the drivers 'lift', 'hold' contradict each other; .* leave .* open by 0\.1"
    ):
        Model(_driven(0.3, 0.5))


def test_drivers_of_one_joint_that_agree_at_the_start_are_a_warning():
    with pytest.warns(ModelWarning, match=r"system 'arm': 'lift', 'hold' drive more than the joints leave free"):
        Model(_driven(0.3, 0.3))


def test_drivers_of_two_freedoms_are_fine():
    ball = PointMass(name="ball", mass=1.0)
    drivers = [
        PositionDriver(name=f"along_{name}", body_j="ball", axis_i=axis, input=name)
        for name, axis in (("x", (1.0, 0.0, 0.0)), ("y", (0.0, 1.0, 0.0)))
    ]
    inputs = [Input(name=n, signal=Harmonic(amplitude=1.0, frequency=1.0)) for n in ("x", "y")]
    with warnings.catch_warnings():
        warnings.simplefilter("error", ModelWarning)
        Model(System(bodies=[ball], constraints=drivers, inputs=inputs))


@pytest.mark.parametrize(
    "parts",
    [
        {"constraints": [Revolute(name="joint", body_i="rod", body_j="rod")]},
        {"constraints": [Fixed(name="joint", body_i="rod", body_j="rod")]},
        {"constraints": [Spherical(name="joint", body_i="rod", body_j="rod")]},
        {"constraints": [Distance(name="joint", body_i="rod", body_j="rod", point_i=(1.0, 0.0, 0.0))]},
        {"constraints": [Revolute(name="joint", body_i="ground", body_j="ground")]},
        {"forces": [SpringDamper(name="joint", body_i="rod", body_j="rod", point_i=(1.0, 0.0, 0.0))]},
    ],
    ids=lambda parts: next(iter(parts.values()))[0].kind,
)
def test_a_body_joined_to_itself_is_named_as_such(parts):
    with pytest.raises(ModelError, match=r"'joint': Expected two different bodies, got '(rod|ground)' twice"):
        Model(System(bodies=[_rod()], **parts))


def test_an_input_that_nothing_reads_is_a_warning():
    load = LumpedLoad(name="push", body="rod", force=(1.0, 0.0, 0.0), input="used")
    inputs = [Input(name=name) for name in ("used", "forgotten", "spare")]
    system = System("rod", bodies=[_rod()], forces=[load], inputs=inputs)
    with pytest.warns(ModelWarning, match=r"inputs are read by no element: 'forgotten', 'spare'"):
        Model(system)


def test_constraints_of_one_system_can_be_taken_over_into_another():
    """The unit norms that the first one added by itself are among them."""
    old = System(bodies=[_rod()], constraints=[Revolute(name="hinge", body_j="rod")])
    new = System(bodies=[*old.bodies, _rod("other")], constraints=[*old.constraints])
    assert [c.name for c in new.constraints] == ["rod.euler_norm", "other.euler_norm", "hinge"]
    assert Model(new).degrees_of_freedom == 7
