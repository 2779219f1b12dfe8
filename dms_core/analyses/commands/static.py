"""The command `static`: equilibria under a load that grows, or along a path through limit points."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from tqdm import tqdm
from tyro.conf import Positional, arg

from dms_core.analyses.commands.ending import ended, gave_up, output_files
from dms_core.analyses.path import EquilibriumPath, follow_path
from dms_core.analyses.static import Equilibrium, states_at_rest, static_equilibrium
from dms_core.assembly.model import Model
from dms_core.command_line import LONG_RUN, FileOut
from dms_core.errors import InputError, SimulationError
from dms_core.files.output_file import check_columns, write_csv, write_json
from dms_core.files.outputs import Outputs
from dms_core.model_files.model_tables import columns, compiled


def static(
    model: Positional[Path],
    out: FileOut,
    loads: Annotated[tuple[str, ...], arg(metavar="NAME ...")] = (),
    steps: int = 1,
    follow: bool = False,
    to: float = 1.0,
    time: float = 0.0,
    stats: FileOut | None = None,
    overwrite: bool = False,
) -> int:
    """Find where a model rests, and whether it stays there.

    The last row of the table is the equilibrium under the whole load; rows before it are load steps, or with --follow
    the path of equilibria, through limit points where it snaps through.

    Args:
        model: model file (YAML).
        out: CSV file to write: load factor, stability, sensors, coordinates.
        loads: inputs and force elements that the load factor multiplies.
        steps: number of load steps.
        follow: follow the path of equilibria from load factor 0 by its arc length.
        to: load factor at which the path ends.
        time: at which inputs are taken [s].
        stats: JSON file: iterations, eigenvalues, limit points and bifurcations.
        overwrite: replace files of these names.
    """
    if not np.isfinite(time) or time < 0.0:
        raise InputError(f"--time: Expected a time of at least 0 s, got {time}.")
    if follow and steps != 1:
        raise InputError("--steps: Expected none beside --follow, which finds its own.")
    files = output_files(out=out, stats=stats)
    with Outputs("static", files=files, inputs=[model], overwrite=overwrite) as outputs:
        built = compiled(model)
        try:
            points, path = _solved(built, loads, steps, to if follow else None, time)
        except SimulationError as error:
            return gave_up(error)
        table = _table(points)
        check_columns(table)
        write_csv(out, table)
        if stats is not None:
            write_json(stats, _statistics(points, path))
    last = points[-1]
    events = [f"{event.kind} at load factor {event.load:.8g}: {event.words}" for event in (path.events if path else ())]
    flags = [f"{f.kind} '{f.element}': {f.what}: {f.worst:.6g} {f.unit}." for f in last.flags]
    failure = ""
    if path is not None and not path.reached:
        failure = f"the path ends at load factor {last.load:.6g}, before {to:g}."
    summary = {"equilibria": len(points), "load factor": last.load, "largest growth rate [1/s]": last.growth}
    return ended(outputs, out, summary, [*events, last.sentence, *flags], failure)


def _solved(
    model: Model, loads: Sequence[str], steps: int, to: float | None, time: float
) -> tuple[Sequence[Equilibrium], EquilibriumPath | None]:
    """Equilibria in order, and the path if one was asked for."""
    if to is None:
        with tqdm(total=steps, unit="step", delay=LONG_RUN, leave=False, disable=None) as bar:

            def stepped(_load: float) -> None:
                bar.update()

            done = static_equilibrium(model, loads=loads, steps=steps, time=time, progress=stepped)
        return done.steps, None
    with tqdm(unit="point", delay=LONG_RUN, leave=False, disable=None) as bar:

        def moved(load: float) -> None:
            bar.set_postfix(load=f"{load:.4g}", refresh=False)
            bar.update()

        path = follow_path(model, loads, to=to, time=time, progress=moved)
    return path.points, path


def _table(points: Sequence[Equilibrium]) -> dict[str, np.ndarray]:
    """Load, stability, sensors and positions; at rest there are no rates to show."""
    found = columns(states_at_rest(points))
    first = {
        "load_factor": np.array([e.load for e in points]),
        "stable": np.array([float(e.stable) for e in points]),
        "growth_rate_per_s": np.array([e.growth for e in points]),
    }
    return first | {name: x for name, x in found.items() if name != "time_s" and not name.startswith("v.")}


def _statistics(points: Sequence[Equilibrium], path: EquilibriumPath | None) -> dict[str, Any]:
    """For JSON."""
    last = points[-1]
    events = [
        {"kind": e.kind, "load_factor": e.load, "motion": e.words, "q": e.equilibrium.q.tolist()}
        for e in (path.events if path else ())
    ]
    return {
        "equilibria": len(points),
        "iterations": sum(e.iterations for e in points),
        "reached": path.reached if path else True,
        "stable": last.stable,
        "eigenvalues": [[float(x.real), float(x.imag)] for x in last.linearisation.eigenvalues],
        "coordinates": list(last.model.layout.names),
        "events": events,
        "flags": [{"element": f.element, "kind": f.kind, "what": f.what, "value": f.worst} for f in last.flags],
    }
