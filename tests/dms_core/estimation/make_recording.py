"""Makes configs/estimation/recording.csv and forearm_forces.csv: python -m tests.dms_core.estimation.make_recording."""

from __future__ import annotations

import numpy as np

from dms_core import SolverOptions, simulate
from dms_core.files.config_files import configs
from dms_core.files.output_file import write_csv, write_text
from dms_core.model import Input, Spline, System
from dms_core.model_files.model_file import load

FARTHER = 1.05
"""How much farther down the true flexor is tied."""
SECONDS, PERIOD, LATE = 3.0, 0.01, 0.02


def truth() -> System:
    """The model of the page with another flexor, and with drives that change."""
    declared = load(configs() / "estimation" / "forearm.yaml")
    t = np.linspace(0.0, SECONDS, 31)
    flexor = 0.12 + 0.12 * np.sin(np.pi * t - 1.0) + 0.06 * np.sin(2.0 * np.pi * t / 0.7)
    extensor = 0.06 + 0.05 * np.sin(2.0 * np.pi * t / 1.3)
    drives = {"flexor drive": np.clip(flexor, 0.02, 1.0), "extensor drive": np.clip(extensor, 0.01, 1.0)}
    forces = []
    for force in declared.own("forces"):
        if force.name == "flexor":
            first, last = force.path  # type: ignore[attr-defined]
            x, y, z = last.point
            force = force.model_copy(update={"path": (first, last.model_copy(update={"point": (x, FARTHER * y, z)}))})
        forces.append(force)
    return System(
        "truth", bodies=declared.own("bodies"), constraints=declared.own("constraints"), forces=forces,
        sensors=declared.own("sensors"),
        inputs=[Input(name=name, signal=Spline(times=tuple(t), values=tuple(x))) for name, x in drives.items()],
    )  # fmt: skip


def make() -> None:
    """Run the truth, spoil what is recorded, write both files."""
    run, rng = simulate(truth(), SECONDS, SolverOptions(rtol=1e-7)), np.random.default_rng(1)
    t = np.arange(0.0, SECONDS + 1e-4, PERIOD)
    true = run.at(t).sensors()
    angle = np.degrees(true["goniometer.angle"] + 0.01 * rng.normal(size=len(t)))
    before = run.at(np.maximum(t - LATE, 0.0)).sensors()["extensor force.activation"]
    emg = before + 0.03 * rng.normal(size=len(t))
    lines = ["time_s,goniometer.angle_deg,extensor force.activation"]
    for k, time in enumerate(t):
        lines.append(f"{time:.2f},{angle[k]:.1f},{f'{emg[k]:.3f}' if k % 2 == 0 else ''}")
    write_text(configs() / "estimation" / "recording.csv", "\n".join(lines) + "\n")
    kept = slice(0, None, 3)
    forces = {f"{m}_N": np.round(true[f"{m} force.tendon_force"][kept], 2) for m in ("flexor", "extensor")}
    write_csv(
        configs().parent / "tests" / "dms_core" / "estimation" / "forearm_forces.csv",
        {"time_s": np.round(t[kept], 3), **forces},
    )


if __name__ == "__main__":
    make()
