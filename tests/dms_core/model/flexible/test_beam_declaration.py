"""What a beam declares: its parts, model files, numbers with derivatives, cost in elements; and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core.assembly.model import Model
from dms_core.errors import InputError, ModelError
from dms_core.model import Beam, BeamElement, BeamLoad, BeamSection, Fixed, PointMass, RigidBody, System
from dms_core.model_files.model_file import dump, load
from tests.dms_core.model.flexible.beams import SLENDER, cantilever, tip
from tests.dms_core.model.flexible.equilibrium import at_rest, equilibrium

FILE = """\
name: cantilever
compositions:
  - {kind: beam, name: boom, length: 1.0, elements: 3, section: {youngs_modulus: 2.0e+11, shear_modulus: 8.0e+10,
     area: 0.001, inertia_y: 2.0e-9, inertia_z: 1.0e-9, torsion_constant: 1.0e-9, density: 7800.0}}
constraints:
  - {kind: fixed, name: clamp, body_j: boom.node0}
forces:
  - {kind: lumped_load, name: tip_load, body: boom.node3, force: [0.0, 1.0, 0.0], input: load}
sensors:
  - {kind: beam_load, name: root, element: boom.element0}
inputs:
  - {name: load}
"""


def test_parts():
    beam = Beam(name="boom", section=SLENDER, length=2.0, elements=4, position=(1.0, 0.0, 0.0))
    model = Model(System(compositions=[beam], constraints=[Fixed(name="clamp", body_j="boom.node0")]))
    names = [b.name for b in model.system.bodies]
    assert names == [f"boom.node{k}" for k in range(5)] == [beam.node(k) for k in range(5)]
    assert beam.node(-1) == "boom.node4"
    assert [f.name for f in model.system.forces] == [f"boom.element{k}" for k in range(4)]
    assert sum(b.mass for b in model.system.bodies) == pytest.approx(2.0 * 7.8)
    np.testing.assert_allclose(model.start.q[0::7], [1.0, 1.5, 2.0, 2.5, 3.0])


def test_model_file(tmp_path):
    """Read, written and read again; the same equilibrium as that of Python."""
    path = tmp_path / "cantilever.yaml"
    path.write_text(FILE)
    system = load(path)
    again = tmp_path / "again.yaml"
    again.write_text(dump(system))
    assert list(load(again).everything()) == list(system.everything())
    assert "node" not in dump(system).replace("boom.node", "")
    model = Model(system)
    found, wanted = equilibrium(model, load=100.0), equilibrium(cantilever(3), load=100.0)
    np.testing.assert_allclose(found.q, wanted.q, atol=1e-12)
    y = model.derivatives.sensor_blocks(found).y
    # The moment half an element from the clamp, and the load, seen from a section that is hardly turned.
    assert y[5] == pytest.approx(100.0 * 5.0 / 6.0, rel=0.02)
    assert y[1] == pytest.approx(100.0, rel=0.02)


def test_mistake_in_a_part_names_the_line(tmp_path):
    path = tmp_path / "bad.yaml"
    path.write_text(FILE.replace("boom.element0", "boom.element9"))
    with pytest.raises(ModelError, match=r"bad.yaml, line 10: .*'boom.element9' does not exist"):
        load(path)


def test_numbers_of_the_composition_have_derivatives():
    """d r2 / d E by the beam's own name; a part's numbers belong to the beam."""
    model = cantilever(2)
    q = equilibrium(model, load=50.0).q
    found = model.parameter_derivatives.of("boom", "section.youngs_modulus", at_rest(model, q)).r2
    h = 1e5
    one, other = (
        cantilever(2, SLENDER.model_copy(update={"youngs_modulus": 2e11 + s * h})).derivatives.blocks(at_rest(model, q))
        for s in (1.0, -1.0)
    )
    np.testing.assert_allclose(found, (one.r2 - other.r2) / (2.0 * h), rtol=1e-4, atol=1e-15)
    with pytest.raises(InputError, match="'boom.node1' is a part of 'boom'"):
        model.parameter_derivatives.of("boom.node1", "mass", at_rest(model, q))


def test_cost_is_linear_in_elements():
    """Multiplications of one factorisation of a step: twice the elements, twice the work."""
    cost = [cantilever(n).tables.values.newton_lu.multiply_adds for n in (8, 16, 32)]
    # The element at the clamp has one end less, and orders of elimination differ a little.
    assert 1.8 < cost[1] / cost[0] < 2.2
    assert 1.8 < cost[2] / cost[1] < 2.2


def test_rectangle():
    """Torsion constants 0.1406 a^4 of a square, 0.281 a b^3 for a = 4 b (Timoshenko, Theory of Elasticity)."""
    square = BeamSection.rectangle(0.1, 0.1, 2e11, 0.3, 7800.0)
    flat = BeamSection.rectangle(0.1, 0.4, 2e11, 0.3, 7800.0)
    assert square.torsion_constant == pytest.approx(0.1406e-4, rel=1e-3)
    assert flat.torsion_constant == pytest.approx(0.281 * 0.4 * 0.1**3, rel=2e-3)
    assert (flat.inertia_y, flat.inertia_z) == pytest.approx((0.1 * 0.4**3 / 12.0, 0.4 * 0.1**3 / 12.0))


def section(**changes):
    return BeamSection(**{**SLENDER.model_dump(), **changes})


def between(one, other, **settings) -> Model:
    return Model(System(bodies=[one, other], forces=[BeamElement(name="beam", section=SLENDER, **settings)]))


NODE = RigidBody(name="a", mass=1.0, inertia=(0.1, 0.1, 0.1))
ENDS = {"body_i": "a", "body_j": "b"}


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Beam(name="boom", section=SLENDER, length=1.0, elements=0), "elements = 0: Expected a number of at"),
        (lambda: Beam(name="boom", section=SLENDER, length=-1.0, elements=2), "length = -1.0: Expected a number above"),
        (lambda: section(youngs_modulus=-2e11), r"youngs_modulus = -2.*: Expected a number above 0"),
        (lambda: section(density=0.0), r"density = 0.0: Expected a number above 0"),
        (lambda: section(torsion_constant=float("nan")), r"torsion_constant = nan: Expected a finite number"),
        (
            lambda: Beam(name="boom", section=SLENDER, length=1.0, elements=2, orientation=(0, 0, 0, 0)),
            "orientation = .*: Expected Euler parameters of a length above 0",
        ),
        (
            lambda: Beam(name="boom", section=SLENDER, length=1.0, elements=2, curvature=(0.0, 0.0, 7.0)),
            "an element turns by 201 degrees: Expected less than 180, with more elements or less curvature",
        ),
        (
            lambda: between(NODE, NODE.model_copy(update={"name": "b"}), **ENDS),
            "'a' and 'b' start at the same place",
        ),
        (
            lambda: between(NODE, NODE.model_copy(update={"name": "b", "position": (0.0, 1.0, 0.0)}), **ENDS),
            "x axes of its nodes along the beam, from 'a' to 'b'; at the start they lie 90 degrees off",
        ),
        (
            lambda: between(NODE, PointMass(name="b", mass=1.0, position=(1.0, 0.0, 0.0)), **ENDS),
            "Expected rigid bodies with the centre of mass at their origin as nodes, got the point_mass 'b'",
        ),
        (
            lambda: between(NODE, NODE.model_copy(update={"name": "b"}), body_i="a", body_j="a"),
            "Expected two different bodies, got 'a' twice",
        ),
        (
            lambda: Model(System(bodies=[NODE], sensors=[BeamLoad(name="gauge", element="a")])),
            "'a' is a rigid_body. Expected the name of a BeamElement",
        ),
        (
            lambda: System(
                compositions=[Beam(name="boom", section=SLENDER, length=1.0, elements=1)],
                bodies=[NODE.model_copy(update={"name": "boom.node0"})],
            ),
            "the name 'boom.node0' is used by",
        ),
    ],
)
def test_what_is_refused(make, said):
    with pytest.raises(ModelError, match=said):
        make()


def test_element_between_the_ground_and_a_node():
    """The ground is a section at the origin: the same cantilever without a clamp."""
    node = RigidBody(name="b", mass=7.8 / 2.0, inertia=(1e-3, 1e-3, 1e-3), position=(1.0, 0.0, 0.0))
    model = between(node, NODE, body_i="ground", body_j="b")
    clamped = cantilever(1, mass="lumped")
    found = model.derivatives.blocks(at_rest(model)).r2_q.toarray()[:7, :7]
    np.testing.assert_allclose(found, clamped.derivatives.blocks(at_rest(clamped)).r2_q.toarray()[7:, 7:])
    assert tip(clamped, clamped.start.q)[0] == 1.0
