"""What the commands read and write: the model of a file, and tables of states."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dms_core.assembly.model import Model
from dms_core.errors import DmsError
from dms_core.files.output_file import with_unit
from dms_core.model_files.model_file import load
from dms_core.results import States


def compiled(path: Path) -> Model:
    """The model of a file; whatever is wrong with it names the file."""
    system = load(path)
    try:
        return Model(system)
    except DmsError as error:
        raise type(error)(f"{path}: {error}") from None


def heads(model: Model) -> list[str]:
    """Names of the columns: time, sensors with their unit, coordinates 'q.*' and their rates 'v.*'."""
    layout = model.layout
    coordinates = [f"{kind}.{name}" for kind in "qv" for name in layout.names]
    return ["time_s", *(with_unit(name, unit) for name, unit in layout.outputs), *coordinates]


def columns(states: States) -> dict[str, np.ndarray]:
    """Columns of given states."""
    measured = states.sensors()
    found = [states.t, *(measured[name] for name, _ in states.model.layout.outputs), *states.q.T, *states.v.T]
    return dict(zip(heads(states.model), found, strict=True))
