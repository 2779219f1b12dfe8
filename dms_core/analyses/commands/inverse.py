"""The command `inverse`: what makes a recorded motion, and which muscles could."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
from tyro.conf import Positional, arg

from dms_core.analyses.commands.ending import ended, gave_up, output_files
from dms_core.analyses.commands.kinematic import driven_table, sample_times
from dms_core.analyses.inverse import InverseResult, inverse_dynamics
from dms_core.analyses.static_optimisation import static_optimisation
from dms_core.command_line import FileOut, bar_of_run, moves
from dms_core.errors import InputError, SimulationError, choices
from dms_core.files.csv_table import check_times, column_names, read_table
from dms_core.files.output_file import check_columns, write_csv, write_json
from dms_core.files.outputs import Outputs
from dms_core.model.constraints import Revolute, Slider
from dms_core.model.sensors import JointAngle
from dms_core.model.signals import AnySignal, Table
from dms_core.model.system import System
from dms_core.model_files.model_tables import compiled

ENDINGS = ("", "_rad", "_deg", "_m", "_mm", ".angle", ".angle_rad", ".angle_deg")
"""What may stand behind the name of a joint or a sensor in the name of a column."""


def inverse(
    model: Positional[Path],
    out: FileOut,
    motion: Path | None = None,
    cutoff: float | None = None,
    t_end: float | None = None,
    sample: float | None = None,
    leave_out: Annotated[tuple[str, ...], arg(metavar="NAME ...")] = (),
    muscles: FileOut | None = None,
    stats: FileOut | None = None,
    overwrite: bool = False,
) -> int:
    """Find the moments and forces at the joints that make a model follow a recorded motion.

    The motion is that of the drivers in the model, and of the columns of --motion that are named after a revolute
    joint, a slider or a joint_angle sensor ('elbow_rad', 'elbow_deg', 'elbow_angle.angle_rad' as `run` writes it).
    Muscles, motors and controllers are left out: the loads are the net moments that they would have to give.

    Args:
        model: model file (YAML).
        out: CSV file to write: loads, sensors, coordinates and rates.
        motion: CSV file of the recorded motion, with a column 'time_s'.
        cutoff: of a low-pass filter for the motion [Hz]: Butterworth of order 2, forwards and backwards; default: none.
        t_end: end time [s]; default: that of the table.
        sample: time between rows [s]; default: that of the table.
        leave_out: force elements that are left out beside those with states of their own.
        muscles: CSV file for the muscles' activations that give the loads, by static optimisation.
        stats: JSON file: loads' extremes, what was left out, singular positions.
        overwrite: replace files of these names.
    """
    files = output_files(out=out, muscles=muscles, stats=stats)
    with Outputs("inverse", files=files, inputs=[model, motion], overwrite=overwrite) as outputs:
        built = compiled(model)
        signals, recorded = _motion(built.system, motion, cutoff)
        start = float(recorded[0]) if recorded is not None else 0.0
        end = t_end if t_end is not None else float(recorded[-1]) if recorded is not None else None
        step = sample if sample is not None else float(np.median(np.diff(recorded))) if recorded is not None else None
        if end is None or step is None:
            raise InputError("--t-end and --sample: Expected both where no --motion gives them.")
        times = sample_times(built, start, end, step)
        try:
            with bar_of_run(end) as bar:
                result = inverse_dynamics(built.system, times, signals, leave_out=leave_out, progress=moves(bar))
            found = static_optimisation(built.system, result) if muscles is not None else None
        except SimulationError as error:
            return gave_up(error)
        table = driven_table(result.motion.states)
        check_columns(table)
        write_csv(out, table)
        if muscles is not None and found is not None:
            write_csv(muscles, found.columns())
        if stats is not None:
            write_json(stats, _statistics(result))
    extremes = {f"load of {name}": f"{x.min():.6g} to {x.max():.6g}" for name, x in result.loads.items()}
    said = [f"left out: {', '.join(result.left_out) or 'nothing'}"]
    if found is not None:
        said.append(f"largest load that the muscles cannot give: {np.abs(found.shortage).max():.4g}")
    said += [*(p.sentence for p in result.motion.singular), *(flag.sentence for flag in result.motion.flags)]
    return ended(outputs, out, extremes, said)


def _motion(system: System, path: Path | None, cutoff: float | None) -> tuple[dict[str, AnySignal], np.ndarray | None]:
    """Courses of joints by name, and the times of the table [s].

    Raises:
        InputError: no column is named after a joint, or two are named after the same one.
    """
    if path is None:
        if cutoff is not None:
            raise InputError("--cutoff: Expected a --motion that is filtered; a table in the model has its own cutoff.")
        return {}, None
    times = read_table(path, ("time_s",))
    check_times(times, "time_s", times.column("time_s"), None)
    heads = column_names(path)
    joints = [e.name for e in (*system.constraints, *system.sensors) if isinstance(e, Revolute | Slider | JointAngle)]
    named: dict[str, str] = {}
    for column in heads:
        name = next((j for j in joints if column.startswith(j) and column[len(j) :] in ENDINGS), None)
        if name is None:
            continue
        if name in named:
            raise InputError(f"--motion '{path}': two columns are named after '{name}'; expected one.")
        named[name] = column
    if not named:
        raise InputError(
            f"--motion '{path}': no column is named after a joint or a joint_angle sensor. Columns: {choices(heads)}. "
            f"Joints and sensors: {choices(joints)}."
        )
    found: dict[str, AnySignal] = {}
    for name, column in named.items():
        unit = column.rpartition("_")[2] if column.endswith(("_deg", "_mm")) else None
        found[name] = Table(file=str(path), column=column, unit=unit, interpolation="quintic", cutoff=cutoff)
    return found, times.column("time_s")


def _statistics(result: InverseResult) -> dict[str, object]:
    """For JSON."""
    return {
        "rows": len(result.t),
        "loads": {name: {"least": float(x.min()), "most": float(x.max())} for name, x in result.loads.items()},
        "left_out": list(result.left_out),
        "newton_iterations": result.motion.iterations,
        "singular_positions": [{"t": p.t, "motion": p.words} for p in result.motion.singular],
        "flags": [flag.as_dict() for flag in result.motion.flags],
    }
