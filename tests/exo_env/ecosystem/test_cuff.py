"""The compliant cuff: what it becomes where it is stiff, what it carries, and how environments take it."""

from __future__ import annotations

import numpy as np
import pytest

from dms_core.assembly.model import Model
from dms_core.errors import InputError
from dms_core.model import Bushing, Constant, ForceLoad, JointReaction
from dms_core.simulation.dynamics import simulate
from exo_env.ecosystem.cuff import DAMPING, STIFFNESS, Cuff
from exo_env.ecosystem.ecosystem import Ecosystem
from exo_env.ecosystem.worn_exoskeleton import GUIDE, Misalignment
from exo_env.envs.elbow_lift import ElbowLiftEnv
from exo_env.envs.hidden_intent import HiddenIntentEnv


def course(steps: int = 60, name: str = "elbow_angle.angle", **settings) -> np.ndarray:
    """A reading at each step under a constant action."""
    env = ElbowLiftEnv(noise=False, **settings)
    env.reset(seed=4)
    found = []
    for _ in range(steps):
        env.step(np.full(env.action_space.shape, -0.4, np.float32))
        found.append(float(np.ravel(env.readings()[name])[0]))
    return np.array(found)


def test_a_stiff_cuff_across_the_forearm_is_the_guide_of_one_row():
    """In the limit of a stiffness in that direction alone the motion is that of the guide; and comes nearer with it."""
    rigid = course()
    errors = []
    for stiffness in (1e4, 1e5, 1e6):
        damping = 0.4 * np.sqrt(stiffness)
        cuff = {"stiffness": [stiffness, *[0.0] * 5], "damping": [damping, *[0.0] * 5]}
        errors.append(np.abs(course(cuff=cuff) - rigid).max())
    # Ten times as stiff, ten times as near, until what is left is the solver's own error of some 2e-4 rad.
    assert errors[1] < 0.2 * errors[0]
    assert errors[2] < 5e-4


def test_the_default_is_the_guide():
    system = Ecosystem().system(1.0, _constant())
    assert system.element(GUIDE).kind == "plane_guide"
    assert isinstance(system.element("guide_force"), JointReaction)


def _constant() -> Constant:
    return Constant(value=1.0)


def test_the_cuff_takes_the_place_of_the_guide():
    system = Ecosystem(cuff=Cuff()).system(1.0, _constant())
    cuff = system.element(GUIDE)
    assert isinstance(cuff, Bushing) and (cuff.body_i, cuff.body_j) == ("lower_link", "forearm")
    assert cuff.stiffness == STIFFNESS and cuff.damping == DAMPING
    assert isinstance(system.element("guide_force"), ForceLoad)
    assert "plane_guide" not in {c.kind for c in system.constraints}


@pytest.mark.parametrize("start", [0.3, 1.5])
def test_an_aligned_device_is_worn_without_strain(start):
    model = Model(Ecosystem(cuff=Cuff()).system(start, _constant()))
    y = simulate(model, 1e-4).sensors()
    assert max(abs(y[f"guide_force.{c}"][0]) for c in ("Fx", "Fy", "Fz", "Mx", "My", "Mz")) < 1e-6


def test_a_device_worn_askew_strains_the_cuff():
    """A hinge 10 mm along z off the elbow: the cuff across it is strained by that much, k z."""
    ecosystem = Ecosystem(cuff=Cuff(), misalignment=Misalignment(shift=(0.0, 0.0, 0.01)))
    y = simulate(Model(ecosystem.system(1.0, _constant())), 1e-4).sensors()
    force = np.array([y[f"guide_force.F{x}"][0] for x in "xyz"])
    assert np.linalg.norm(force) == pytest.approx(STIFFNESS[2] * 0.01, rel=1e-3)


def test_both_environments_take_it():
    for kind, cuff in ((ElbowLiftEnv, "compliant"), (HiddenIntentEnv, {"stiffness": [5000.0, *STIFFNESS[1:]]})):
        env = kind(cuff=cuff)
        env.reset(seed=2)
        for _ in range(20):
            observation, reward, *_ = env.step(env.action_space.sample())
        assert np.all(np.isfinite(observation)) and np.isfinite(reward)
        assert env.settings.cuff == cuff


@pytest.mark.parametrize(
    ("cuff", "message"),
    [
        ("soft", r"cuff = 'soft': expected None, 'compliant', or a mapping"),
        (3.0, r"cuff = 3.0: expected None, 'compliant', or a mapping"),
        ({"stiffness": [1.0, 2.0]}, r"stiffness = .*Expected 6 items, got 2"),
        ({"stiffness": [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0]}, r"stiffness = .*expected six numbers of at least 0"),
        ({"stiffness": [0.0, 1.0, 1.0, 1.0, 1.0, 1.0]}, r"stiffness = .*expected a first number above 0"),
        ({"damping": [1.0, 1.0, 1.0, 1.0, 1.0, -2.0]}, r"damping = .*expected six numbers of at least 0"),
        ({"softness": 1.0}, r"unknown key 'softness'. Allowed: damping, stiffness"),
    ],
)
def test_a_wrong_cuff_is_refused(cuff, message):
    with pytest.raises(InputError, match=message):
        ElbowLiftEnv(cuff=cuff)


def test_a_guide_of_another_kind_beside_a_cuff():
    with pytest.raises(InputError, match="guide 'slider' and a cuff are both given"):
        Ecosystem(guide="slider", cuff=Cuff())
