"""The command `modes`: eigenvalues, damping and mode shapes of a model linearised at rest or at its start."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from tyro.conf import Positional

from dms_core.analyses.commands.ending import ended, gave_up, output_files
from dms_core.analyses.linearise import Linearisation, Mode, linearise
from dms_core.analyses.pictures import draw_modes
from dms_core.analyses.static import static_equilibrium
from dms_core.assembly.model import Model
from dms_core.command_line import FileOut
from dms_core.errors import SimulationError
from dms_core.figures import require_matplotlib
from dms_core.files.output_file import write_csv, write_json
from dms_core.files.outputs import Outputs
from dms_core.model_files.model_tables import compiled
from dms_core.simulation.dynamics import World

SHOWN = 24
"""Modes that are printed."""


def modes(
    model: Positional[Path],
    out: FileOut,
    about: Literal["equilibrium", "start"] = "equilibrium",
    matrices: FileOut | None = None,
    pictures: FileOut | None = None,
    stats: FileOut | None = None,
    overwrite: bool = False,
) -> int:
    """Linearise a model and write its eigenvalues, frequencies and damping ratios as CSV.

    Args:
        model: model file (YAML).
        out: CSV file to write: one row a mode, by rising frequency.
        about: the static equilibrium that the model creeps to, or its assembled start, where it may move.
        matrices: JSON file for A, B, C, D with the names of states, inputs and outputs.
        pictures: picture of the mode shapes to write (PNG, SVG or PDF).
        stats: JSON file: modes in words, stability.
        overwrite: replace files of these names.
    """
    if pictures is not None:
        require_matplotlib()
    files = output_files(out=out, matrices=matrices, pictures=pictures, stats=stats)
    with Outputs("modes", files=files, inputs=[model], overwrite=overwrite) as outputs:
        built = compiled(model)
        try:
            linear = _linearised(built, about)
        except SimulationError as error:
            return gave_up(error)
        found = linear.modes()
        write_csv(out, mode_table(found))
        if matrices is not None:
            write_json(matrices, linear.as_dict())
        if pictures is not None:
            draw_modes(pictures, linear)
        if stats is not None:
            write_json(stats, _statistics(linear, found))
    stable = "no small disturbance grows" if linear.stable else f"a disturbance grows at {linear.growth:.4g} 1/s"
    summary = {"states": len(linear.states), "modes": len(found), "stability": stable}
    lines = [f"{'Hz':>10} {'damping':>9}  what moves", *map(_line, found[:SHOWN])]
    if len(found) > SHOWN:
        lines.append(f"and {len(found) - SHOWN} faster ones, see the table.")
    return ended(outputs, out, summary, lines)


def _line(mode: Mode) -> str:
    """A mode on a line."""
    return f"{mode.frequency:10.5g} {mode.damping:9.4g}  {mode.words}"


def _linearised(model: Model, about: str) -> Linearisation:
    """The linear system about the equilibrium or the start.

    Raises:
        SimulationError: there is none.
    """
    if about == "equilibrium":
        return static_equilibrium(model).last.linearisation
    return linearise(World(model))


def mode_table(modes: Sequence[Mode]) -> dict[str, np.ndarray]:
    """One row a mode."""
    return {
        "mode": np.arange(1.0, len(modes) + 1.0),
        "real_per_s": np.array([m.eigenvalue.real for m in modes]),
        "imaginary_rad_per_s": np.array([m.eigenvalue.imag for m in modes]),
        "frequency_Hz": np.array([m.frequency for m in modes]),
        "damped_frequency_Hz": np.array([m.damped_frequency for m in modes]),
        "damping_ratio": np.array([m.damping for m in modes]),
    }


def _statistics(linear: Linearisation, modes: Sequence[Mode]) -> dict[str, object]:
    """For JSON."""
    said = [
        {"frequency_Hz": m.frequency, "damping_ratio": m.damping, "real_per_s": m.eigenvalue.real,
         "imaginary_rad_per_s": m.eigenvalue.imag, "motion": m.words}
        for m in modes
    ]  # fmt: skip
    return {"stable": linear.stable, "growth_rate_per_s": linear.growth, "states": list(linear.states), "modes": said}
