"""Functions that are called by their addresses: what they raise reaches Python."""

from __future__ import annotations

from typing import Any, ClassVar, NamedTuple

import numpy as np
import pytest
from numba import njit

from dms_core.kernels import TABLE_CALL, Packed, address, call_with_table, floats
from dms_core.model import Function, Input, PointMass, SecondOrder, System
from dms_core.model.element import Force, Placement
from dms_core.simulation.dynamics import World
from dms_core.simulation.options import SolverOptions


class _One(NamedTuple):
    x: np.ndarray


@njit
def _refuse(w):
    if floats(w, 0)[0] > 2.0:
        raise ValueError("above two")
    floats(w, 0)[0] += 1.0


@njit
def _divide(w):
    floats(w, 0)[0] = 1.0 / (floats(w, 0)[0] - 3.0)


@njit
def _call(at, w):
    call_with_table(at, w)
    return floats(w, 0)[0]


@pytest.mark.parametrize(
    ("function", "error", "at_one"), [(_refuse, ValueError, 2.0), (_divide, ZeroDivisionError, -0.5)]
)
def test_an_exception_of_a_called_function_reaches_python(function, error, at_one):
    at = address(function, TABLE_CALL)
    assert _call(at, Packed(_One(np.array([1.0]))).table) == at_one
    with pytest.raises(error):
        _call(at, Packed(_One(np.array([3.0]))).table)


@njit
def _fence(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    if q[0] > 0.5:
        raise ValueError("beyond the fence")


class _Fence(Force):
    kind: ClassVar[str] = "fence"
    kernel: ClassVar[Any] = _fence

    def place(self, system):
        return Placement(bodies=("mass",))


def test_an_exception_of_a_kernel_ends_the_run():
    mass = PointMass(name="mass", mass=1.0, position=(0.0, 0.0, 0.0), velocity=(1.0, 0.0, 0.0))
    world = World(System("thrown", bodies=[mass], forces=[_Fence(name="fence")]))
    world.advance(0.1)
    with pytest.raises(ValueError, match="beyond the fence"):
        world.advance(1.0)


def _reciprocal(t):
    return 1.0 / (t + 1.0 if t < 0.1 or t > 0.2 else 0.0), 0.0, 0.0


def test_an_exception_of_a_function_of_time_reaches_python():
    forces, inputs = [SecondOrder(name="x", input="u")], [Input(name="u", signal=Function(function=_reciprocal))]
    world = World(System("pushed", forces=forces, inputs=inputs), SolverOptions(h_max=0.01))
    with pytest.raises(ZeroDivisionError):
        world.advance(0.3)
