"""The command `kinematic`: positions, velocities and accelerations that drivers prescribe."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from tyro.conf import Positional

from dms_core.analyses.commands.ending import ended, output_files
from dms_core.analyses.kinematic import driver_loads
from dms_core.analyses.kinematic import kinematic as simulated
from dms_core.assembly.model import Model
from dms_core.command_line import FileOut, bar_of_run, moves
from dms_core.errors import InputError
from dms_core.files.output_file import check_columns, check_size, with_unit, write_csv, write_json
from dms_core.files.outputs import Outputs
from dms_core.model.constraints import AngleDriver
from dms_core.model_files.model_tables import columns, compiled, heads
from dms_core.results import States, regular_times


def kinematic(
    model: Positional[Path],
    t_end: float,
    sample: float,
    out: FileOut,
    stats: FileOut | None = None,
    overwrite: bool = False,
) -> int:
    """Move a model by its drivers alone and write sensors, drivers' loads, coordinates and rates as CSV.

    Every freedom needs a driver. A motion that ends in a singular position writes what it has and ends with status 1;
    one that goes through a singular position says so.

    Args:
        model: model file (YAML).
        t_end: end time [s].
        sample: time between rows [s], the last row at the end time; at most t_end.
        out: CSV file to write.
        stats: JSON file: iterations, singular positions.
        overwrite: replace files of these names.
    """
    files = output_files(out=out, stats=stats)
    with Outputs("kinematic", files=files, inputs=[model], overwrite=overwrite) as outputs:
        built = compiled(model)
        times = sample_times(built, 0.0, t_end, sample)
        with bar_of_run(t_end) as bar:
            result = simulated(built, times, moves(bar))
        table = driven_table(result.states)
        check_columns(table)
        write_csv(out, table)
        summary = {
            "rows": len(result.t), "newton_iterations": result.iterations, "positions_between": result.substeps
        }  # fmt: skip
        singular = [{"t": p.t, "motion": p.words} for p in result.singular]
        if stats is not None:
            flags = [flag.as_dict() for flag in result.flags]
            write_json(stats, {**summary, "singular_positions": singular, "failure": result.failure, "flags": flags})
    said = [*(p.sentence for p in result.singular), *(flag.sentence for flag in result.flags)]
    return ended(outputs, out, summary, said, result.failure)


def sample_times(model: Model, start: float, end: float, sample: float) -> np.ndarray:
    """start, start + sample, ... and the end [s], as long as their table fits into memory.

    Raises:
        InputError: a time is out of range, or the table would be too large.
    """
    if not (np.isfinite(end) and end > start):
        raise InputError(f"--t-end: Expected a time above {start:g} s, got {end}.")
    if not (np.isfinite(sample) and 0.0 < sample <= end - start):
        raise InputError(f"--sample: Expected a positive time of at most {end - start:g} s, got {sample}.")
    check_size("--sample", end - start, sample, len(heads(model)) + model.n_q + 2 * model.n_phi)
    return regular_times(start, end, sample)


def driven_table(states: States) -> dict[str, np.ndarray]:
    """Time, loads of drivers with their unit, then sensors and coordinates."""
    drivers = {c.element.name: isinstance(c.element, AngleDriver) for c in states.model.layout.constraints}
    found = columns(states)
    loads = {
        with_unit(f"{name}.load", "Nm" if drivers.get(name, False) else "N"): load
        for name, load in driver_loads(states.model, states).items()
    }
    return {"time_s": found.pop("time_s"), **loads, **found}
