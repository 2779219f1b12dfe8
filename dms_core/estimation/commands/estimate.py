"""The command `estimate`: states, inputs and constants of a model from a recording, with their deviations."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2
from tyro.conf import Positional

from dms_core.analyses.commands.ending import ended, gave_up, output_files
from dms_core.command_line import FileOut, bar_of_run, moves
from dms_core.errors import SimulationError
from dms_core.estimation.filter.forms import filter_of
from dms_core.estimation.measurement import read_measurements
from dms_core.estimation.record import Estimate, estimate
from dms_core.estimation.settings import FilterSettings
from dms_core.files.output_file import check_columns, write_csv, write_json
from dms_core.files.outputs import Outputs
from dms_core.model_files.model_tables import compiled

SHOWN = 10
"""Divergences that are printed."""
BAND = 0.95
"""Probability of the band that is told for NIS."""


def estimate_command(
    model: Positional[Path],
    measurements: Path,
    settings: Path,
    out: FileOut,
    smooth: bool = False,
    stats: FileOut | None = None,
    overwrite: bool = False,
) -> int:
    """Estimate what a recording does not show: states, inputs and constants of a model, by a Kalman filter.

    The table has a row for each time at which something was read: every sensor of the model, every coordinate and
    rate, the estimated inputs, constants and biases, a standard deviation of each ('deviation.*'), and NIS, which is
    about the number of readings where model and noise are told rightly.

    Args:
        model: model file (YAML).
        measurements: CSV or .sto file: a column of times [s], and columns named after sensor components of the model
            ('elbow.angle_rad', 'elbow.angle_deg'); an empty cell where a sensor told nothing.
        settings: settings of the filter (YAML): channels, noise, inputs and constants to estimate.
        out: CSV file to write.
        smooth: let each row tell what the whole record says of it, not only what came before.
        stats: JSON file: NIS and its band, divergences, last values.
        overwrite: replace files of these names.
    """
    files = output_files(out=out, stats=stats)
    with Outputs("estimate", files=files, inputs=[model, measurements, settings], overwrite=overwrite) as outputs:
        built = compiled(model)
        kalman = filter_of(built, FilterSettings.from_file(settings))
        readings = read_measurements(measurements, built, tuple(kalman.settings.channels))
        seconds = float(readings.t[-1] - readings.t[0])
        try:
            with bar_of_run(max(seconds, 1e-9)) as bar:
                progress = moves(bar, -float(readings.t[0]))
                found = estimate(kalman, readings, smooth=smooth, progress=progress)
            table = found.columns()
        except SimulationError as error:
            return gave_up(error)
        check_columns(table)
        write_csv(out, table)
        summary = _summary(found)
        if stats is not None:
            write_json(stats, {**summary, "diverged": [d.sentence for d in found.diverged], "last": _last(found)})
    said = [f"{name}: {x['value']:.6g} +- {x['deviation']:.3g}" for name, x in _last(found).items()]
    said += [d.sentence for d in found.diverged[:SHOWN]]
    if len(found.diverged) > SHOWN:
        said.append(f"and {len(found.diverged) - SHOWN} further divergences.")
    return ended(outputs, out, summary, said)


def _summary(found: Estimate) -> dict[str, Any]:
    """Numbers of a record."""
    read = found.readings > 0
    total, count = float(found.nis[read].sum()), int(found.readings[read].sum())
    low, high = (float(chi2.ppf(x, count)) / count for x in (0.5 - BAND / 2.0, 0.5 + BAND / 2.0))
    mean = total / count
    verdict = "within" if low <= mean <= high else "outside"
    return {
        "rows": len(found.t), "readings": count, "mean NIS per reading": mean,
        "its 95 % band": f"{low:.4g} to {high:.4g} ({verdict})", "divergences": len(found.diverged),
    }  # fmt: skip


def _last(found: Estimate) -> dict[str, dict[str, float]]:
    """Inputs, constants and biases at the end."""
    last = {}
    for name in found.kalman.estimated.rest_names:
        value, deviation = found.rest(name)
        last[name] = {"value": float(value[-1]), "deviation": float(np.asarray(deviation)[-1])}
    return last
