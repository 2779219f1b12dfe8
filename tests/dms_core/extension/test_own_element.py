"""A force written outside the package: the README's example runs, is right, and costs no more than one inside."""

from __future__ import annotations

import re
import time
from pathlib import Path

import numpy as np
import pytest

from dms_core import Simulation, SolverOptions, System, simulate
from dms_core.model import PointMass, SpringDamper

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def cubic_spring(tmp_path_factory):
    """The class CubicSpring of dms_core/README.md, imported from a file of the user's own."""
    text = (ROOT / "dms_core" / "README.md").read_text()
    code = next(block for block in re.findall(r"```python\n(.*?)```", text, re.S) if "CubicSpring" in block)
    folder = tmp_path_factory.mktemp("user")
    (folder / "user_springs.py").write_text(code)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        import user_springs

        yield user_springs.CubicSpring


def test_the_example_of_the_readme_conserves_energy(cubic_spring):
    mass, k, x0 = 2.0, 50.0, 0.4
    system = System(
        "user", bodies=[PointMass(name="m", mass=mass, position=(x0, 0, 0))],
        forces=[cubic_spring(name="s", body="m", stiffness=k)],
    )  # fmt: skip
    states = simulate(system, 3.0, SolverOptions(rtol=1e-7)).check().own_steps()
    x, v = states.coordinate("m.x"), states.rate("m.x")
    energy = 0.5 * mass * v**2 + 0.25 * k * x**4
    # BDF2 damps a little; the error falls with rtol and is about 1e-4 of the energy here.
    assert np.abs(energy - energy[0]).max() < 1e-3 * energy[0]
    assert x.min() < -0.9 * x0, "the mass must swing through"


def test_a_force_of_the_user_is_as_fast_as_a_built_in_one(cubic_spring):
    def cost(force) -> float:
        bodies = [PointMass(name=f"m{i}", mass=1.0, position=(0.5, 0, 0)) for i in range(20)]
        forces = [force(i) for i in range(20)]
        simulation = Simulation(System("many", bodies=bodies, forces=forces), SolverOptions(fixed_step=1e-3))
        simulation.advance(0.05)
        best = np.inf
        for k in range(5):
            begin = time.process_time()
            simulation.advance(0.05 + 0.2 * (k + 1))
            best = min(best, time.process_time() - begin)
        return best

    own = cost(lambda i: cubic_spring(name=f"s{i}", body=f"m{i}", stiffness=1.0))
    built_in = cost(lambda i: SpringDamper(name=f"s{i}", body_j=f"m{i}", stiffness=1.0, free_length=0.1))
    # A Python call per evaluation would cost a hundred times as much; the ratio is about 1 on a quiet machine.
    assert own < 5.0 * built_in


FACTORY = """
from typing import ClassVar
from numba import njit
from dms_core.model.element import Force, Placement


def pull(stiffness):
    @njit(cache=True)
    def kernel(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
        r[0] += stiffness * q[0]
        if level > 0:
            Jq[0, 0] += stiffness

    return kernel


class Pull(Force):
    body: str

    def place(self, system):
        return Placement(bodies=(self.body,))


class Soft(Pull):
    kind: ClassVar[str] = "soft"
    kernel: ClassVar = pull(1.0)


class Stiff(Pull):
    kind: ClassVar[str] = "stiff"
    kernel: ClassVar = pull(4.0)
"""


def test_kernels_of_one_factory_are_not_taken_for_each_other(tmp_path, monkeypatch):
    (tmp_path / "user_factory.py").write_text(FACTORY)
    monkeypatch.syspath_prepend(tmp_path)
    import user_factory

    bodies = [PointMass(name=name, mass=1.0, position=(1.0, 0.0, 0.0)) for name in ("a", "b")]
    forces = [user_factory.Soft(name="soft", body="a"), user_factory.Stiff(name="stiff", body="b")]
    states = simulate(System("two", bodies=bodies, forces=forces), 1.0, SolverOptions(rtol=1e-7)).check().at(1.0)
    # cos(sqrt(k) t); the tolerance is some hundred times rtol.
    assert states.coordinate("a.x") == pytest.approx(np.cos(1.0), abs=1e-5)
    assert states.coordinate("b.x") == pytest.approx(np.cos(2.0), abs=1e-5)
