"""The command `sensitivity`: derivatives of a run of a model file, by adjoints or forward, whichever needs less."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from tyro.conf import Positional

from dms_core.analyses.commands.ending import ended, gave_up, output_files
from dms_core.assembly.model import Model
from dms_core.command_line import FileOut, bar_of_run, moves
from dms_core.errors import InputError, SimulationError, choices
from dms_core.files.output_file import write_csv, write_json
from dms_core.files.outputs import Outputs
from dms_core.model_files.model_tables import compiled
from dms_core.results import Result
from dms_core.sensitivity.nodes import Number
from dms_core.sensitivity.record import RecordedWorld
from dms_core.sensitivity.run import By, Output, Sensitivity, Shift, Start
from dms_core.simulation.options import MethodName, SolverOptions, is_positive


def sensitivity(
    model: Positional[Path],
    time: float,
    by: tuple[str, ...],
    out: FileOut,
    of: tuple[str, ...] = (),
    integral_of: tuple[str, ...] = (),
    rtol: float = SolverOptions.rtol,
    method: MethodName = SolverOptions.method,
    stats: FileOut | None = None,
    overwrite: bool = False,
) -> int:
    """Differentiate a run from the assembled start; write a row an output: name, value and a column for each --by.

    Args:
        model: model file (YAML).
        time: length of the run [s].
        by: what is moved: a declared number (rod.mass, rope.path.1.point.0), an input, to which a constant is added
            over the whole run, or an independent state at the start (q.rod.y, v.rod.y).
        out: CSV file to write.
        of: sensors (swing.angle) or states (q.rod.x, v.rod.x) at the end.
        integral_of: sensors, of which the integral over the run is differentiated; they follow those of --of.
        rtol: relative tolerance of the run.
        method: method of integration.
        stats: JSON file: names of rows and columns, the matrix, steps.
        overwrite: replace files of these names.
    """
    if not is_positive(time):
        raise InputError(f"--time: Expected a positive time [s], got {time}.")
    if not (of or integral_of):
        raise InputError("--of: Expected at least one sensor or state, or one sensor under --integral-of.")
    options = SolverOptions(rtol=rtol, method=method)
    with Outputs("sensitivity", files=output_files(out=out, stats=stats), inputs=[model], overwrite=overwrite) as files:
        built = compiled(model)
        moved = [named(built, name) for name in by]
        outputs = [Output(name) for name in of] + [Output(name, integral=True) for name in integral_of]
        world = RecordedWorld(built, options)
        with bar_of_run(2.0 * time) as bar:
            if world.advance(time, moves(bar)) is not Result.SUCCESS:
                return gave_up(SimulationError(world.message))
            try:
                run = Sensitivity(world, outputs, moved)
                found = run.adjoint(lambda t: moves(bar)(2.0 * time - t))
                values = run.value()
            except SimulationError as error:
                return gave_up(error)
        rows = [*of, *(f"integral of {name}" for name in integral_of)]
        write_csv(out, {"of": np.array(rows), "value": values, **dict(zip(by, found.T, strict=True))})
        if stats is not None:
            write_json(stats, {"of": rows, "by": list(by), "value": values.tolist(), "derivative": found.tolist(),
                               "steps": world.stats().steps, "method": method})  # fmt: skip
    return ended(files, out, {"steps": world.stats().steps, "method": method}, _lines(rows, by, found))


def _lines(rows: Sequence[str], by: Sequence[str], found: np.ndarray) -> list[str]:
    """A line for each output and quantity."""
    return [f"d {row} / d {x} = {found[i, k]:.8g}" for i, row in enumerate(rows) for k, x in enumerate(by)]


def named(model: Model, name: str) -> By:
    """What a word of --by means: a state at the start, an input, or a declared number.

    Raises:
        InputError: it is none of them.
    """
    if name[:2] in ("q.", "v.") and name[2:] in model.layout.index:
        return Start(name)
    if name in model.layout.input_index:
        return Shift(name)
    elements = {x.name for x in model.system.everything()} | model.system.composed.keys()
    parts = name.split(".")
    for k in range(len(parts) - 1, 0, -1):
        if (element := ".".join(parts[:k])) in elements:
            return Number(element, ".".join(parts[k:]))
    raise InputError(
        f"--by: '{name}' is neither a state, an input nor a declared number. Expected 'q.NAME' or 'v.NAME' of an "
        f"independent coordinate, an input ({choices(model.layout.input_index) or 'none is declared'}), or "
        f"ELEMENT.NUMBER with an element of {choices(sorted(elements))}."
    )
