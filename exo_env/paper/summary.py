"""Numbers of a scenario that the paper's figures are about."""

from __future__ import annotations

from typing import Any

import numpy as np

from dms_core.files.output_file import with_unit
from exo_env.ecosystem.sensors import muscle_sensor, tension_sensor
from exo_env.paper.scenarios import ScenarioRun

SHOWN_MUSCLES = {
    "biceps_long": muscle_sensor("BIClong", "tendon_force"),
    "triceps_long": muscle_sensor("TRIlong", "tendon_force"),
}
"""Muscles of Fig. 10 and the sensors of their forces."""
SHOWN_ROPES = ("agonist", "antagonist")
"""Ropes of Fig. 11."""


def magnitude(run: ScenarioRun, quantity: str) -> np.ndarray:
    """Size of the elbow's reaction force 'F' [N] or moment 'M' [Nm] over time, shape (n,)."""
    return np.sqrt(sum(run.values[f"elbow_reaction.{quantity}{axis}"] ** 2 for axis in "xyz"))


def summary(run: ScenarioRun) -> dict[str, Any]:
    """The numbers of a run, by name with unit; peaks are of the size unless the name says lowest.

    Numbers of a muscle or a rope that the subject or the device does not have are left out.
    """
    y, lifting = run.values, run.times < run.exercise.turning
    error = np.degrees(y["elbow_angle.angle"] - run.reference)
    force, moment = magnitude(run, "F"), magnitude(run, "M")
    lowest = float(y["gym_rope_tension"].min())
    numbers = {
        "tracking_error_rms_deg": np.sqrt(np.mean(error**2)),
        "tracking_error_peak_deg": np.abs(error).max(),
        "peak_angle_deg": np.degrees(y["elbow_angle.angle"].max()),
        "reference_peak_angle_deg": np.degrees(run.reference.max()),
        **_forces(y, lifting),
        "peak_muscle_moment_Nm": np.abs(y["muscle_moment"]).max(),
        "peak_exoskeleton_moment_Nm": np.abs(y["exo_moment"]).max(),
        "peak_total_moment_Nm": np.abs(y["muscle_moment"] + y["exo_moment"]).max(),
        "peak_elbow_reaction_force_N": force.max(),
        "mean_elbow_reaction_force_N": force.mean(),
        "peak_elbow_reaction_moment_Nm": moment.max(),
        "mean_elbow_reaction_moment_Nm": moment.mean(),
        "peak_guide_force_N": np.sqrt(sum(y[f"guide_force.F{axis}"] ** 2 for axis in "xyz")).max(),
        "lowest_gym_rope_tension_N": lowest,
        "pid_drift_rad": np.abs(y["tracking.drift"]).max(),
        "command_moment_shortage_Nm": run.command.shortage,
    }
    return {
        "title": run.scenario.title,
        **{name: float(value) for name, value in numbers.items()},
        "gym_rope_goes_slack": lowest < 0.0,
        "solver": {"result": run.trajectory.result.name, **run.trajectory.stats.as_dict()},
    }


def _forces(y: dict[str, np.ndarray], lifting: np.ndarray) -> dict[str, Any]:
    """Forces of the muscles and ropes that the paper shows, as far as there are any [N]."""
    muscles = {name: y[sensor] for name, sensor in SHOWN_MUSCLES.items() if sensor in y}
    ropes = {name: y[tension_sensor(name)] for name in SHOWN_ROPES if tension_sensor(name) in y}
    halves = (("lifting", lifting), ("release", ~lifting))
    return {
        **{f"peak_{name}_N": force.max() for name, force in muscles.items()},
        **{f"mean_{name}_{half}_N": force[k].mean() for name, force in muscles.items() for half, k in halves},
        **{f"peak_{name}_rope_N": tension.max() for name, tension in ropes.items()},
    }


def columns(run: ScenarioRun) -> dict[str, np.ndarray]:
    """Table of a run: time, reference, every component of the model's sensors with its unit."""
    first = {"time_s": run.times, "reference_rad": run.reference}
    return first | {with_unit(name, unit): run.values[name] for name, unit in run.trajectory.model.layout.outputs}
