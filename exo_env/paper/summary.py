"""Numbers of a scenario that the paper's figures are about."""

from __future__ import annotations

from typing import Any

import numpy as np

from dms_core.output_file import with_unit
from exo_env.paper.scenarios import ScenarioRun


def magnitude(run: ScenarioRun, quantity: str) -> np.ndarray:
    """Size of the elbow's reaction force 'F' [N] or moment 'M' [Nm] over time, shape (n,)."""
    return np.sqrt(sum(run.values[f"elbow_reaction.{quantity}{axis}"] ** 2 for axis in "xyz"))


def summary(run: ScenarioRun) -> dict[str, Any]:
    """The numbers of a run, by name with unit; peaks are of the size unless the name says lowest."""
    y, lifting = run.values, run.times < run.exercise.turning
    error = np.degrees(y["elbow_angle.angle"] - run.reference)
    force, moment = magnitude(run, "F"), magnitude(run, "M")
    biceps, triceps = y["BIClong.sensor.tendon_force"], y["TRIlong.sensor.tendon_force"]
    lowest = float(y["gym_rope_tension"].min())
    found = {
        "tracking_error_rms_deg": np.sqrt(np.mean(error**2)),
        "tracking_error_peak_deg": np.abs(error).max(),
        "peak_angle_deg": np.degrees(y["elbow_angle.angle"].max()),
        "reference_peak_angle_deg": np.degrees(run.reference.max()),
        "peak_biceps_long_N": biceps.max(),
        "peak_triceps_long_N": triceps.max(),
        "mean_biceps_long_lifting_N": biceps[lifting].mean(),
        "mean_biceps_long_release_N": biceps[~lifting].mean(),
        "mean_triceps_long_lifting_N": triceps[lifting].mean(),
        "mean_triceps_long_release_N": triceps[~lifting].mean(),
        "peak_agonist_rope_N": y["agonist_tension"].max(),
        "peak_antagonist_rope_N": y["antagonist_tension"].max(),
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
        **{name: float(value) for name, value in found.items()},
        "gym_rope_goes_slack": lowest < 0.0,
        "solver": {"result": run.trajectory.result.name, **run.trajectory.stats.as_dict()},
    }


def columns(run: ScenarioRun) -> dict[str, np.ndarray]:
    """Table of a run: time, reference, every sensor with its unit."""
    found = {"time_s": run.times, "reference_rad": run.reference}
    return found | {with_unit(name, unit): run.values[name] for name, unit in run.trajectory.model.layout.outputs}
