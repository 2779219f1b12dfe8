"""Beams in motion: what is conserved, Kane's spin-up, damping."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dms_core.assembly.model import Model
from dms_core.model import (
    AngleDriver,
    Beam,
    BeamLoad,
    BeamSection,
    Function,
    Gravity,
    Input,
    Revolute,
    System,
)
from dms_core.results import Trajectory
from dms_core.simulation.dynamics import SolverOptions, simulate
from tests.dms_core.model.flexible.beams import cantilever, momenta, strain_energy
from tests.dms_core.model.flexible.equilibrium import at_rest, frequencies

SOFT = BeamSection(
    youngs_modulus=4e4, shear_modulus=1.6e4, area=4e-3, inertia_y=2e-6, inertia_z=1e-6, torsion_constant=2e-6,
    density=1000.0,
)  # fmt: skip
"""Of rubber, 60 mm wide: the motion bends it by the size of itself and asks for steps of a millisecond."""


@pytest.mark.parametrize("mass", ["lumped", "consistent"])
def test_a_free_beam_keeps_energy_and_momenta(mass):
    """A bow that spins about a slanted axis; no force acts on it, and its shape changes much."""
    beam = Beam(
        name="bow", section=SOFT, length=1.0, elements=4, curvature=(0.5, 0.0, 1.5), velocity=(0.3, -0.2, 0.1),
        angular_velocity=(2.0, 6.0, 3.0), mass=mass,
    )  # fmt: skip
    model = Model(System("bow", compositions=[beam]))
    run = simulate(model, 0.5, SolverOptions(rtol=1e-7)).check()
    elastic = np.array([strain_energy(model, q) for q in run.q[::20]])
    kept = [momenta(model, q, v) for q, v in zip(run.q[::20], run.v[::20], strict=True)]
    kinetic, linear, angular = (np.array(x) for x in zip(*kept, strict=True))
    assert elastic.max() > 0.02 * kinetic[0]
    # Errors of 1e-8 a step in positions of 1 m, forces of EA = 160 N: seen 3e-6 of the energy.
    np.testing.assert_allclose(kinetic + elastic, kinetic[0], rtol=3e-5)
    np.testing.assert_allclose(linear, linear[[0]].repeat(len(linear), 0), atol=1e-6 * np.abs(linear[0]).max())
    np.testing.assert_allclose(angular, angular[[0]].repeat(len(angular), 0), atol=1e-5 * np.abs(angular[0]).max())


@pytest.mark.parametrize("mass", ["lumped", "consistent"])
def test_a_falling_beam_feels_nothing(mass):
    """Weight and inertia are of the same mass: no strain, and the acceleration of free fall."""
    beam = Beam(name="bow", section=SOFT, length=1.0, elements=3, curvature=(0.0, 0.0, 1.0), mass=mass)
    model = Model(System("fall", compositions=[beam], forces=[Gravity(name="weight")]))
    run = simulate(model, 0.5).check()
    assert strain_energy(model, run.q[-1]) < 1e-12
    np.testing.assert_allclose(run.q[-1, 1::7] - run.q[0, 1::7], -0.5 * 9.80665 * 0.25, rtol=1e-5)


SPEED, RISE, ARM = 6.0, 15.0, 10.0


def turned(t):
    """Kane, Ryan and Banerjee's course: angle, rate and second derivative."""
    w = 2.0 * math.pi / RISE
    if t < RISE:
        rate = SPEED / RISE * (t - math.sin(w * t) / w)
        return (
            SPEED / RISE * (0.5 * t * t + (math.cos(w * t) - 1.0) / w**2),
            rate,
            SPEED / RISE * (1.0 - math.cos(w * t)),
        )
    return SPEED * (t - 0.5 * RISE), SPEED, 0.0


class TestSpinUp:
    """A flexible arm of 10 m on a hub that is spun up to 6 rad/s, beyond its first frequency at rest of 3.8 rad/s.

    T. R. Kane, R. R. Ryan, A. K. Banerjee (1987), J. Guidance 10(2):139-151; numbers of J. C. Simo and L. Vu-Quoc
    (1987), J. Sound Vib. 119(3):487-508: EA = 2.8e7 N, EI = 1.4e4 N m^2, GA = 1e7 N, rho A = 1.2 kg/m,
    rho I = 6e-4 kg m. Without geometric stiffness the arm would diverge.
    """

    @pytest.fixture(scope="class")
    @classmethod
    def run(cls) -> Trajectory:
        section = BeamSection(
            youngs_modulus=2.8e7, shear_modulus=1e7, area=1.0, inertia_y=5e-4, inertia_z=5e-4, torsion_constant=1e-3,
            density=1.2,
        )  # fmt: skip
        arm = Beam(name="arm", section=section, length=ARM, elements=6)
        system = System(
            "spin-up",
            compositions=[arm],
            constraints=[
                Revolute(name="hub", body_j=arm.node(0)),
                AngleDriver(name="motor", joint="hub", input="turn"),
            ],
            sensors=[BeamLoad(name="root", element="arm.element0")],
            inputs=[Input(name="turn", signal=Function(function=turned))],
        )
        return simulate(system, 20.0, SolverOptions(rtol=1e-5)).check()

    @staticmethod
    def tip(run: Trajectory, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Displacement of the tip along and across the arm that turns rigidly [m]."""
        at, angle = run.at(t), np.array([turned(x)[0] for x in t])
        x, y = (at.coordinate(f"arm.node6.{c}") for c in "xy")
        return x * np.cos(angle) + y * np.sin(angle) - ARM, y * np.cos(angle) - x * np.sin(angle)

    def test_it_lags_and_comes_back(self, run):
        along, across = self.tip(run, np.linspace(0.0, 20.0, 2001))
        # The lag is greatest a little before half the rise; Simo and Vu-Quoc's picture shows 0.55 to 0.6 m.
        assert 0.55 < -across.min() < 0.60
        assert 6.0 < np.linspace(0.0, 20.0, 2001)[np.argmin(across)] < 7.5
        # What is left is a small vibration about the arm: no divergence.
        assert np.abs(across[1700:]).max() < 0.01

    def test_it_stretches_as_the_centrifugal_load_says(self, run):
        """EA u'' + rho A w^2 (x + u) = 0: u(L) = L (tan kL / kL - 1), k^2 = rho A w^2 / EA; 5.14e-4 m."""
        along, across = self.tip(run, np.linspace(17.0, 20.0, 601))
        k = math.sqrt(1.2 * SPEED**2 / 2.8e7)
        wanted = ARM * (math.tan(k * ARM) / (k * ARM) - 1.0)
        assert wanted == pytest.approx(5.14e-4, abs=1e-6)
        # A small vibration across of 4 mm shortens the arm by 1e-6 m; six elements.
        assert np.mean(along) == pytest.approx(wanted, rel=0.01)

    def test_its_root_pulls_the_whole_arm(self, run):
        """Half an element from the hub: N = rho A w^2 (L^2 - s^2) / 2."""
        s = ARM / 12.0
        N = run.sensors(np.linspace(17.0, 20.0, 601))["root.N"]
        # Strains are constant along an element, so that what is read half-way is the mean over it: (L/6)^2 / 24 of w^2.
        assert np.mean(N) == pytest.approx(0.5 * 1.2 * SPEED**2 * (ARM**2 - s**2), rel=2e-3)


def test_damping_takes_what_a_vibration_of_its_frequency_loses():
    """Load = stiffness (strain + tau rate): a mode of frequency w decays with the ratio tau w / 2."""
    still = cantilever(4, SOFT, force=(0.0, 1.0, 0.0))
    w = frequencies(still, at_rest(still), 1)[0]
    tau = 2.0 * 0.05 / w
    model = cantilever(4, SOFT, force=(0.0, 1.0, 0.0), damping_time=tau)
    b = model.derivatives.blocks(at_rest(model))
    np.testing.assert_allclose(b.r2_v.toarray(), tau * _stiffness(model), atol=1e-9 * np.abs(b.r2_v.toarray()).max())


def _stiffness(model: Model) -> np.ndarray:
    """r2_q of the elements at rest, where no load adds to it."""
    return model.derivatives.blocks(at_rest(model)).r2_q.toarray()
