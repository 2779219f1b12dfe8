"""Why methods of order 2 err as they do on a body that tumbles: steps, formulas and what they do to an invariant.

    python -m tests.benchmarks.tumbling [--spin 6] [--ida FOLDER]

A free body of three different moments of inertia turns about its middle axis at so many rad/s for 10 s. Its motion
hangs on D = L^2 - 2 E J2, its distance from the separatrix, which is 0 about the middle axis itself. Printed are the
largest error of an Euler parameter at the steps, and the change of D over D at the end, for

- BDF2 at fourteen tolerances,
- BDF2 on the very same steps, each solved to rounding, and on as many equal ones,
- with FOLDER, where scikit-sundae lies, SUNDIALS IDA held at order 2, at ten times.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from dms_core import Model, SolverOptions, System, Trajectory, World, simulate
from dms_core.compiled.jit import compiled
from dms_core.model import RigidBody
from dms_core.model.geometry.frames import g_matrix
from tests.dms_core.literature.motions import BODY

END = 10.0
TOLERANCES = np.logspace(-5.6, -6.9, 14)
SOLVED = 1e-13
"""Last change of an Euler parameter or its rate in Newton's method."""


def tumbling(spin: float) -> Model:
    """The body, nearly about its middle axis."""
    body = RigidBody(name="body", mass=1.0, inertia=tuple(BODY), angular_velocity=(spin / 120.0, spin, spin / 120.0))
    return Model(System("tumbling", bodies=[body]))


@compiled(makes_arrays=True)
def _g(p):
    """G(p): omega = 2 G pdot."""
    return np.array([[-p[1], p[0], p[3], -p[2]], [-p[2], -p[3], p[0], p[1]], [-p[3], p[2], -p[1], p[0]]])


@compiled(makes_arrays=True)
def _rows(y, c0, cq, cv, J):
    """Rows of the stabilised form in (p, v, lam, mu), qdot = c0 p + cq and vdot = c0 v + cv."""
    p, v, rows = y[:4], y[4:8], np.zeros(10)
    G, H = _g(p), _g(v)
    rows[:4] = v - c0 * p - cq - 2.0 * p * y[9]
    rows[4:8] = 4.0 * G.T @ (J * (G @ (c0 * v + cv))) + 8.0 * H.T @ (J * (G @ v)) + 2.0 * p * y[8]
    rows[8], rows[9] = p @ p - 1.0, 2.0 * p @ v
    return rows


@compiled(makes_arrays=True)
def on_steps(t, q, v, J):
    """BDF2 of variable step on these times, each step solved to rounding; q and v hold their first two rows."""
    lam, change = 0.0, np.zeros((10, 10))
    for k in range(2, len(t)):
        h = t[k] - t[k - 1]
        w = h / (t[k - 1] - t[k - 2])
        c0, c1, c2 = (1.0 + 2.0 * w) / (1.0 + w) / h, -(1.0 + w) / h, w * w / (1.0 + w) / h
        cq, cv = c1 * q[k - 1] + c2 * q[k - 2], c1 * v[k - 1] + c2 * v[k - 2]
        y = np.zeros(10)
        y[:4], y[4:8], y[8] = q[k - 1] + w * (q[k - 1] - q[k - 2]), v[k - 1] + w * (v[k - 1] - v[k - 2]), lam
        for _ in range(12):
            for j in range(10):
                near, far, e = y.copy(), y.copy(), 1e-7 * max(1.0, abs(y[j]))
                near[j] -= e
                far[j] += e
                change[:, j] = (_rows(far, c0, cq, cv, J) - _rows(near, c0, cq, cv, J)) / (2.0 * e)
            dy = np.linalg.solve(change, -_rows(y, c0, cq, cv, J))
            y += dy
            if np.abs(dy[:8]).max() < SOLVED:
                break
        q[k], v[k], lam = y[:4], y[4:8], y[8]


def drift(q: np.ndarray, v: np.ndarray) -> float:
    """Change of D over D from the first state to the last."""
    ends = [BODY * (2.0 * g_matrix(q[k]) @ v[k]) for k in (0, -1)]
    D = [L @ L - BODY[1] * (L @ (L / BODY)) for L in ends]
    return float(D[1] / D[0] - 1.0)


def line(name: str, t: np.ndarray, q: np.ndarray, v: np.ndarray, exact: Trajectory) -> None:
    """One row."""
    error = float(np.abs(q - exact.at(t).q[:, 3:]).max())
    print(f"{name:28} {len(t) - 1:6} steps   error {error:.1e}   D {drift(q, v):+.1e}", flush=True)


def alone(name: str, t: np.ndarray, exact: Trajectory) -> None:
    """BDF2 on given steps, from exact first ones."""
    first = exact.at(t[:2])
    q, v = np.zeros((len(t), 4)), np.zeros((len(t), 4))
    q[:2], v[:2] = first.q[:, 3:], first.v[:, 3:]
    on_steps(t, q, v, BODY)
    line(name, t, q, v, exact)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--spin", type=float, default=6.0, help="about the middle axis [rad/s]")
    parser.add_argument("--ida", type=Path, default=None, help="folder of scikit-sundae")
    given = parser.parse_args()
    model = tumbling(given.spin)
    exact = simulate(model, END, SolverOptions(rtol=1e-13, method="radau5")).check()
    for rtol in TOLERANCES:
        run = simulate(model, END, SolverOptions(rtol=float(rtol))).check()
        line(f"bdf2, rtol {rtol:.1e}", run.t, run.q[:, 3:], run.v[:, 3:], exact)
        alone("  its steps, to rounding", run.t, exact)
        alone("  as many equal steps", np.linspace(0.0, END, len(run.t)), exact)
    if given.ida is not None:
        from tests.benchmarks.peers.sundials_ida import Ida

        ida, times, scale = Ida(given.ida), np.linspace(1.0, END, 10), np.ones((2, model.n_q))
        for rtol in TOLERANCES / 8.0:
            q, n = ida.run(World(model), times, float(rtol), (rtol * scale[0], rtol * scale[1]), order=2)
            error = float(np.abs(q - exact.at(times).q).max())
            print(f"{f'IDA of order 2, rtol {rtol:.1e}':28} {n.steps:6} steps   error {error:.1e}", flush=True)


if __name__ == "__main__":
    main()
