"""The chain of chain_reference.py in MuJoCo: free bodies and soft equalities, or a tree in minimal coordinates.

"soft": one free body a link (6 velocities), each hinge two `connect` equalities 0.1 m either side on its axis. MuJoCo
regularises equalities, so the joints open: `gap_m` is the widest opening in the second. solref=0.02 is MuJoCo's own
stiffness, 0.002 a stiffer one. "tree": what MuJoCo is made for, which only a chain without loops can be.

    .venv-peers/myo/bin/python tests/benchmarks/peers/mujoco_chain.py [--links 1 8 64] [--json FILE]

MuJoCo leaves a MUJOCO_LOG.TXT in the folder that it runs in where it has something to say.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[3]))

import mujoco
import numpy as np

from tests.benchmarks.calibration import normalised
from tests.benchmarks.chain_reference import TIP
from tests.benchmarks.peers.record import Row, parser, row, save

PROGRAM = f"MuJoCo {mujoco.__version__}"
STEP, STEPS, CURVE_LINKS = 1e-3, (4e-3, 2e-3, 1e-3, 5e-4), 8
"""Step of every chain [s], and those of the one whose error against cost is wanted."""
SOLREFS = (0.02, 0.002)
INERTIAL = f'<inertial pos="0.5 0 0" mass="1" diaginertia="1e-3 {1 / 12:.15g} {1 / 12:.15g}"/>'


def model(bodies: str, equalities: str, step: float, integrator: str) -> mujoco.MjModel:
    """A compiled model."""
    option = f'<option timestep="{step:g}" gravity="0 -9.81 0" integrator="{integrator}"/>'
    text = f"<mujoco>{option}<worldbody>{bodies}</worldbody><equality>{equalities}</equality></mujoco>"
    return mujoco.MjModel.from_xml_string(text)


def soft(links: int, step: float, solref: float) -> mujoco.MjModel:
    """Free bodies, tied."""
    bodies = "".join(f'<body name="b{i}" pos="{i} 0 0"><freejoint/>{INERTIAL}</body>' for i in range(links))
    others = ["", *(f'body2="b{i}"' for i in range(links - 1))]
    ties = "".join(
        f'<connect body1="b{i}" {others[i]} anchor="0 0 {z}" solref="{solref} 1"/>'
        for i in range(links)
        for z in (-0.1, 0.1)
    )
    return model(bodies, ties, step, "Euler")


def tree(links: int, step: float) -> mujoco.MjModel:
    """Bodies in each other, a hinge each."""
    inside = "".join(f'<body pos="{min(i, 1)} 0 0"><joint type="hinge" axis="0 0 1"/>{INERTIAL}' for i in range(links))
    return model(inside + "</body>" * links, "", step, "RK4")


def fresh(compiled: mujoco.MjModel) -> mujoco.MjData:
    """A state at the start, work arrays touched."""
    data = mujoco.MjData(compiled)
    mujoco.mj_forward(compiled, data)
    return data


def tip(data: mujoco.MjData, free: bool) -> np.ndarray:
    """Right end of the last link [m], shape (2,)."""
    if free:
        along = np.empty(3)
        mujoco.mju_rotVecQuat(along, np.array([1.0, 0.0, 0.0]), data.qpos[-4:])
        return (data.qpos[-7:-4] + along)[:2]
    angles = np.cumsum(data.qpos)
    return np.array([np.cos(angles).sum(), np.sin(angles).sum()])


def widest_gap(compiled: mujoco.MjModel, steps: int) -> float:
    """Largest violation of an equality in the second, looked at a hundred times [m]."""
    data, gap = fresh(compiled), 0.0
    for _ in range(100):
        mujoco.mj_step(compiled, data, nstep=max(1, steps // 100))
        mujoco.mj_forward(compiled, data)
        gap = max(gap, float(np.abs(data.efc_pos[: data.ne]).max()))
    return gap


def measure(links: int, step: float, solref: float | None, repeats: int) -> Row:
    """One chain at one step; a tree where there is no solref."""
    compiled = tree(links, step) if solref is None else soft(links, step, solref)
    steps = round(1.0 / step)

    def run(data: mujoco.MjData) -> mujoco.MjData:
        mujoco.mj_step(compiled, data, nstep=steps)
        return data

    seconds, data = normalised(run, repeats, prepare=lambda: fresh(compiled))
    error = float(np.hypot(*(tip(data, solref is not None) - TIP[links])))
    kind = "tree, RK4" if solref is None else f"soft equalities solref={solref:g}"
    gap = 0.0 if solref is None else widest_gap(compiled, steps)
    return row(f"chain {links}", PROGRAM, f"{kind} h={step:g}", seconds, error=error, gap=gap)


def main() -> None:
    """Time all chains."""
    found = parser(__doc__)
    found.add_argument("--links", type=int, nargs="*", choices=list(TIP), default=list(TIP))
    given = found.parse_args()
    cases = [(n, h) for n in given.links for h in (STEPS if n == CURVE_LINKS else (STEP,))]
    save(given.json, [measure(n, h, solref, given.repeats) for solref in (*SOLREFS, None) for n, h in cases])


if __name__ == "__main__":
    main()
