"""The pictures of docs/analyses.md: a truss that snaps through, the arm at rest, in inverse dynamics, and its modes.

python -m tests.benchmarks.analyses_pictures --out docs
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from dms_core import Model, SolverOptions
from dms_core.analyses import follow_path, inverse_dynamics, motion_of, static_equilibrium, static_optimisation
from dms_core.analyses.pictures import draw_modes
from dms_core.figures import drawn
from dms_core.model import Constant
from exo_env.ecosystem.ecosystem import Ecosystem
from exo_env.paper.scenarios import load_scenarios, run
from exo_env.rendering.panels import COLOURS, legend, panels, save
from tests.dms_core.analyses.mechanisms import von_mises_truss

WEIGHTS = (0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0)


@drawn
def truss_and_arm(path: Path) -> None:
    """Left: load over height of the truss. Right: where the elbow rests under a weight."""
    figure, axes = panels(1, 2, (9.0, 3.6))
    left, right = axes[0]
    found = follow_path(von_mises_truss(1.0, 0.3, 1000.0, 20.0), ["P"], to=1.0, longest=0.01)
    y, load, stable = found.states().coordinate("node.y"), 20.0 * found.loads, found.stable
    for value, dashes, label in ((True, "-", "stable"), (False, "--", "unstable")):
        left.plot(y, np.where(stable == value, load, np.nan), dashes, color=COLOURS[0], label=label)
    for event in found.limit_points:
        q = event.equilibrium.q[1]
        left.plot(q, 20.0 * event.load, "o", color=COLOURS[1], label="limit point")
    left.set_xlabel("height of the node [m]")
    left.set_ylabel("force [N]")
    left.invert_xaxis()
    for colour, level in zip(COLOURS, (0.1, 0.3, 0.6), strict=False):
        right.plot(WEIGHTS, [_rest(w, level) for w in WEIGHTS], "o-", ms=3, color=colour, label=f"flexors at {level}")
    right.plot(WEIGHTS, [_rest(w, 0.01, 1.0) for w in WEIGHTS], "k--", label="device at 60 deg, relaxed arm")
    right.set_xlabel("weight [kg]")
    right.set_ylabel("elbow angle at rest [deg]")
    legend(figure, 4)
    save(figure, path)


def _rest(weight: float, level: float, assistance: float = 0.0) -> float:
    """Angle at which the elbow rests [deg]."""
    angle = Constant(value=np.radians(60.0))
    drive = {m: Constant(value=level) for m in ("BIClong", "BICshort", "BRA")}
    system = Ecosystem(weight=weight).system(np.radians(60.0), angle, drive, assistance=assistance)
    return float(np.degrees(static_equilibrium(Model(system)).states().sensors()["elbow_angle.angle"][-1]))


@drawn
def inverse(path: Path) -> None:
    """Moments and activations of scenario 3, found from its angles."""
    exercise, scenarios = load_scenarios()
    trajectory = run(scenarios[2], exercise, options=SolverOptions(rtol=1e-6)).trajectory
    system = trajectory.model.system
    times = np.arange(0.0, exercise.duration, 0.02)
    ropes = [force.name for force in system.forces if force.kind == "rope_force"]
    motion = motion_of(trajectory, ["elbow_angle", "grip"], 0.005)
    result = inverse_dynamics(system, times, motion, leave_out=ropes)
    y = trajectory.sensors(times)
    found = static_optimisation(system, result, loads={"elbow_angle": result.loads["elbow_angle"] - y["exo_moment"]})
    figure, axes = panels(1, 2, (9.0, 3.6))
    left, right = axes[0]
    left.plot(times, y["muscle_moment"] + y["exo_moment"], color="0.75", linewidth=5, label="in the run")
    left.plot(times, result.loads["elbow_angle"], color=COLOURS[0], label="net moment, from the angles")
    left.plot(times, y["exo_moment"], color=COLOURS[5], linestyle="--", label="device's part")
    left.set_ylabel("moment at the elbow [Nm]")
    for colour, name in zip(COLOURS[1:], ("BIClong", "BICshort", "BRA"), strict=False):
        k = found.muscles.index(name)
        right.plot(times, y[f"{name}.sensor.activation"], color="0.75", linewidth=5)
        right.plot(times, found.activations[:, k], color=colour, label=f"{name}, found")
    right.set_ylabel("activation [-]")
    for ax in (left, right):
        ax.set_xlabel("time [s]")
    legend(figure, 6)
    save(figure, path)


def modes(path: Path) -> None:
    """Modes of arm with device and weight that swing."""
    angle = Constant(value=np.radians(60.0))
    drive = {m: Constant(value=0.1) for m in ("BIClong", "BICshort", "BRA")}
    system = Ecosystem(weight=1.0).system(np.radians(60.0), angle, drive, assistance=0.1)
    linear = static_equilibrium(Model(system)).last.linearisation
    draw_modes(path, linear, [m for m in linear.modes() if m.damped_frequency > 0.0])


def main() -> None:
    """Draw all of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("docs"), help="folder of the pictures")
    out = parser.parse_args().out
    truss_and_arm(out / "analyses-static.png")
    inverse(out / "analyses-inverse.png")
    modes(out / "analyses-modes.png")


if __name__ == "__main__":
    main()
