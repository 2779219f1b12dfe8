"""The command `observability`: what sensors tell of the states of a model, and what they hardly tell."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from tyro.conf import Positional, arg

from dms_core.analyses.commands.ending import ended, gave_up, output_files
from dms_core.command_line import FileOut, bar_of_run, moves
from dms_core.errors import InputError, SimulationError
from dms_core.estimation.filter.forms import filter_of
from dms_core.estimation.observability import Observability, empirical_observability, local_observability
from dms_core.estimation.settings import Channel, FilterSettings
from dms_core.files.output_file import write_csv, write_json
from dms_core.files.outputs import Outputs
from dms_core.model_files.model_tables import compiled

SHOWN = 8
"""Weakest directions that are printed."""


def observability(
    model: Positional[Path],
    out: FileOut,
    sensors: Annotated[tuple[str, ...], arg(metavar="NAME ...")] = (),
    settings: Path | None = None,
    t_end: float = 0.5,
    period: float | None = None,
    gramian: Literal["local", "empirical"] = "local",
    stats: FileOut | None = None,
    overwrite: bool = False,
) -> int:
    """Find what sensors tell of the states of a model: rank, singular values, and the weakest directions by name.

    A singular value says by how many deviations of their noise the readings move where the start is off by one
    deviation along a direction; at 0 no filter can tell it. Without --settings a deviation is 1 in SI units for
    readings and rates, 0.1 for positions and states of first order.

    Args:
        model: model file (YAML).
        out: CSV file to write: singular values and the components of each direction.
        sensors: sensor components that are read, such as 'elbow.angle'; default: the channels of --settings.
        settings: settings of a filter (YAML), whose inputs, constants and biases count as states.
        t_end: time over which is read [s].
        period: between two readings [s]; default: that of the settings, or 0.01.
        gramian: by derivatives along the motion from the start, or by runs from displaced starts.
        stats: JSON file: rank, singular values and directions in words.
        overwrite: replace files of these names.
    """
    files = output_files(out=out, stats=stats)
    with Outputs("observability", files=files, inputs=[model, settings], overwrite=overwrite) as outputs:
        kalman = filter_of(compiled(model), _settings(sensors, settings, period))
        if not (np.isfinite(t_end) and t_end >= kalman.settings.period):
            raise InputError(
                f"--t-end: Expected a time of at least a period, {kalman.settings.period:g} s, got {t_end} s."
            )
        periods = round(t_end / kalman.settings.period)
        found_by = local_observability if gramian == "local" else empirical_observability
        try:
            with bar_of_run(t_end) as bar:
                found = found_by(kalman, periods, progress=moves(bar))
        except SimulationError as error:
            return gave_up(error)
        write_csv(out, _table(found))
        if stats is not None:
            write_json(stats, found.as_dict())
    weakest = found.directions[::-1][:SHOWN]
    lines = [f"{'singular value':>15}  weakest directions", *(f"{d.singular_value:15.4g}  {d.words}" for d in weakest)]
    lines += [f"not observable: {d.words}" for d in found.unobservable]
    return ended(outputs, out, {"states": len(found.names), "rank": found.rank}, lines)


def _settings(sensors: tuple[str, ...], path: Path | None, period: float | None) -> FilterSettings:
    """Settings with the channels asked for."""
    given = FilterSettings.from_file(path) if path is not None else None
    if given is None and not sensors:
        raise InputError("--sensors: Expected sensor components, or --settings with channels.")
    known = given.channels if given is not None else {}
    channels = {name: known.get(name, Channel(deviation=1.0)) for name in sensors} or dict(known)
    changes: dict[str, Any] = {"channels": channels, **({"period": period} if period is not None else {})}
    if given is None:
        return FilterSettings(**changes)
    return FilterSettings(**{**dict(given), **changes})


def _table(found: Observability) -> dict[str, np.ndarray]:
    """One row a direction, by falling singular value."""
    components = {name: np.array([d.share[name] for d in found.directions]) for name in found.names}
    return {"singular_value": found.singular_values, **components}
