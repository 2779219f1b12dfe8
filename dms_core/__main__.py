"""Command line of the DMS platform: check, run, analyse and describe model files.

python -m dms_core check MODEL.yaml
python -m dms_core run MODEL.yaml --t-end T --rtol R [--method NAME] [--sample DT] --out FILE.csv
                                      [--stats FILE.json] [--overwrite]
python -m dms_core static MODEL.yaml --out FILE.csv [--loads NAME ...] [--steps N | --follow --to S]
python -m dms_core kinematic MODEL.yaml --t-end T --sample DT --out FILE.csv
python -m dms_core inverse MODEL.yaml --motion FILE.csv --out FILE.csv [--muscles FILE.csv]
python -m dms_core modes MODEL.yaml --out FILE.csv [--matrices FILE.json] [--pictures FILE.png]
python -m dms_core estimate MODEL.yaml --measurements FILE.csv --settings FILE.yaml --out FILE.csv [--smooth]
python -m dms_core observability MODEL.yaml --sensors NAME ... --out FILE.csv [--settings FILE.yaml]
python -m dms_core schema [--out FILE] [--overwrite]
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from tyro.conf import Positional, arg

from dms_core import Model, SolverOptions, Trajectory
from dms_core.analyses.commands.ending import output_files
from dms_core.analyses.commands.inverse import inverse
from dms_core.analyses.commands.kinematic import kinematic
from dms_core.analyses.commands.modes import modes
from dms_core.analyses.commands.static import static
from dms_core.command_line import FAILED_RUN, FileOut, bar_of_run, moves, run_command
from dms_core.errors import InputError, Stopped
from dms_core.estimation.commands.estimate import estimate_command
from dms_core.estimation.commands.observability import observability
from dms_core.files.output_file import check_columns, check_size, write_csv, write_json, write_text
from dms_core.files.output_place import descriptor
from dms_core.files.outputs import Outputs, partial
from dms_core.model_files.model_tables import columns, compiled, heads
from dms_core.model_files.schema import reference
from dms_core.results import Result
from dms_core.sensitivity.command import sensitivity
from dms_core.simulation.dynamics import new_simulation
from dms_core.simulation.events import Crossing
from dms_core.simulation.options import MethodName

ROWS = 10_000
"""Rows of a table in memory at once."""


def check(model: Positional[Path]) -> int:
    """Print what a model file declares: bodies, coordinates, rows, rank, degrees of freedom, redundant rows.

    Args:
        model: model file (YAML).
    """
    print(report(compiled(model)))
    return 0


def report(model: Model) -> str:
    """What `check` prints."""
    system, start = model.system, model.start
    bodies = [f"  {b.name} ({b.kind})" for b in system.bodies] or ["  none"]
    independent = start.singular_values[: len(start.active)]
    smallest = f"{independent.min():.3g}" if len(independent) else "no rows"
    lines = [
        f"system '{system.name}'",
        f"bodies: {len(system.bodies)}",
        *bodies,
        f"coordinates: {model.n_q}",
        f"constraint rows: {model.n_phi}",
        f"rank: {len(model.active_rows)}",
        f"degrees of freedom: {model.degrees_of_freedom}",
        f"redundant rows: {', '.join(model.redundant_rows) or 'none'}",
        f"smallest singular value of phi_q within its rank: {smallest}",
        f"forces: {len(system.forces)}, sensors: {len(model.layout.outputs)} components, inputs: {len(system.inputs)}",
        f"assembly moved the declared start by at most {start.moved:.3g} (m or -)",
    ]
    return "\n".join(lines)


def run(
    model: Positional[Path],
    t_end: float,
    out: FileOut,
    rtol: float = SolverOptions.rtol,
    atol: float | None = None,
    sample: float | None = None,
    stats: FileOut | None = None,
    step: float | None = None,
    method: MethodName = SolverOptions.method,
    stop_at: str | None = None,
    overwrite: bool = False,
) -> int:
    """Run a model file from its assembled start and write sensors, coordinates and rates as CSV.

    Without --sample the rows are the solver's own steps; at a jump of an input a time stands twice, with the values
    before and behind it. A run that stops early writes what it has and ends with status 1; one that is
    stopped by Ctrl-C writes it under a name with 'partial' in it and ends with status 130.

    Args:
        model: model file (YAML).
        t_end: end time [s].
        out: CSV file to write; its folder is made where it is missing.
        rtol: relative tolerance of the error.
        atol: absolute tolerance of every variable in its own unit; default: rtol times the variable's nominal size.
        sample: time between rows [s], the last row at the end time; at most t_end; default: the solver's own steps.
        stats: JSON file for the solver's statistics.
        step: constant step [s], at most t_end, instead of error control; rtol then only sets how far Newton's method
            goes. Where t_end is no multiple of it, the last step is shorter, and the message says so.
        method: method of integration: bdf2 (of order 2), sdirk2 (of order 2, for inputs that jump all the time), or
            radau5 (of order 5, for errors below about 1e-5 of the motion).
        stop_at: sensor component at whose first passing of 0 the run ends before, such as 'touch.gap'.
        overwrite: replace files of these names.
    """
    options = _options(t_end, sample, rtol, atol, step, method)
    with Outputs("run", files=output_files(out=out, stats=stats), inputs=[model], overwrite=overwrite) as outputs:
        trajectory = _simulated(compiled(model), options, t_end, sample, stop_at)
        if trajectory.result is Result.INTERRUPTED:
            write_csv(part := partial(out), lambda: table(trajectory, sample))
            raise Stopped(f"{trajectory.t[-1]:.4g} of {t_end:.4g} s are in '{outputs.where(part)}'.")
        write_csv(out, lambda: table(trajectory, sample))
        if stats is not None:
            write_json(stats, {**_summary(trajectory), "flags": [flag.as_dict() for flag in trajectory.flags]})
    # A table on standard output shall be nothing but a table.
    with contextlib.redirect_stdout(sys.stdout if descriptor(out) is None else sys.stderr):
        _print(_summary(trajectory))
        print(f"written: {outputs.where(out)}")
    if not trajectory.success:
        print(f"The run failed: {trajectory.message} '{outputs.where(out)}' holds the part before.", file=sys.stderr)
        return FAILED_RUN
    return FAILED_RUN if outputs.failed else 0


def _options(
    t_end: float, sample: float | None, rtol: float, atol: float | None, step: float | None, method: MethodName
) -> SolverOptions:
    """The options of `run`, checked.

    Raises:
        InputError: names the option and what is allowed.
    """
    if not (np.isfinite(t_end) and t_end > 0.0):
        raise InputError(f"--t-end: Expected a positive time [s], got {t_end}.")
    if sample is not None and not (np.isfinite(sample) and sample > 0.0):
        raise InputError(f"--sample: Expected a positive time [s], got {sample}.")
    for name, value in (("--rtol", rtol), ("--atol", atol), ("--step", step)):
        if value is not None and not (np.isfinite(value) and value > 0.0):
            raise InputError(f"{name}: Expected a positive number, got {value}.")
    for name, value in (("--step", step), ("--sample", sample)):
        if value is not None and value > t_end:
            raise InputError(f"{name}: Expected at most --t-end = {t_end} s, got {value} s.")
    return SolverOptions(rtol=rtol, atol=atol, fixed_step=step, method=method)


def _simulated(
    model: Model, options: SolverOptions, t_end: float, sample: float | None, stop_at: str | None
) -> Trajectory:
    """A run whose table can be written, with a bar over simulated time."""
    check_columns(names := heads(model))
    for option, time in (("--sample", sample), ("--step", options.fixed_step)):
        if time is not None:
            check_size(option, t_end, time, len(names))
    simulation = new_simulation(model, options)
    events = () if stop_at is None else [Crossing(stop_at, 0)]
    with bar_of_run(t_end) as bar:
        simulation.advance(t_end, moves(bar), events)
    return simulation.trajectory()


def _summary(trajectory: Trajectory) -> dict[str, Any]:
    """How a run ended, and the solver's statistics."""
    return {"result": trajectory.result.name, "message": trajectory.message, **trajectory.stats.as_dict()}


def _print(summary: dict[str, Any]) -> None:
    """A line for each of them."""
    for key, value in summary.items():
        shown = f"{value:.4g}" if isinstance(value, float) else value
        print(f"{key.replace('_', ' ')}: {shown}")


def table(trajectory: Trajectory, sample: float | None) -> Iterator[dict[str, np.ndarray]]:
    """Columns of a run, in parts one below the other.

    Args:
        trajectory: a finished or interrupted run.
        sample: time between rows [s]; None for the solver's own steps.
    """
    if sample is None or len(trajectory.t) == 1:
        yield columns(trajectory.own_steps())
        return
    times = trajectory.grid(sample)
    for k in range(0, len(times), ROWS):
        yield columns(trajectory.at(times[k : k + ROWS]))


def schema(
    out: Annotated[FileOut | None, arg(help="file to write; default: standard output")] = None,
    overwrite: Annotated[bool, arg(help="replace a file of this name")] = False,
) -> int:
    """Print the reference of model files: every kind with its keys, units and defaults (Markdown)."""
    if out is None:
        print(reference(), end="")
        return 0
    with Outputs("schema", files=output_files(out=out), overwrite=overwrite) as outputs:
        write_text(out, reference())
    return FAILED_RUN if outputs.failed else 0


def main(arguments: list[str] | None = None) -> int:
    """Run a command; a mistake of the user is one message on stderr and status 2."""
    return run_command(
        {
            "check": check,
            "run": run,
            "static": static,
            "kinematic": kinematic,
            "inverse": inverse,
            "modes": modes,
            "sensitivity": sensitivity,
            "estimate": estimate_command,
            "observability": observability,
            "schema": schema,
        },
        "python -m dms_core",
        "Check, run, analyse and describe models of multibody systems with ropes, muscles and controllers.",
        arguments,
    )


if __name__ == "__main__":
    sys.exit(main())
