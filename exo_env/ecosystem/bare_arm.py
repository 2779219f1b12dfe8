"""The bare arm26 under a table of excitations: shoulder fixed at 0, muscles straight through their points.

Torso and humerus are parts of the ground, so that one body with 7 coordinates and 12 muscle states remains. Columns of
the result are those of tests/reference/arm26_forward_A.csv.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from dms_core import Trajectory
from dms_core.errors import InputError, choices
from dms_core.files.input_file import decoded, read_bytes
from dms_core.files.json_text import brief
from dms_core.model import GROUND, Gravity, Input, JointAngle, JointReaction, MuscleSensor, Revolute, Steps, System
from dms_core.model.sensors.muscle import Component
from dms_core.model.signals import AnySignal
from exo_env.ecosystem.arm import ELBOW, Arm, excitation_name

TIME = "time_s"
COMPONENTS: dict[Component, str] = {
    "activation": "activation",
    "fibre_length": "fibre_length_m",
    "tendon_force": "tendon_force_N",
    "length": "muscle_tendon_length_m",
}
"""Components of the muscle sensor and the ends of their columns, in the order of the table."""
REACTION = {**{f"F{axis}": f"F{axis}_N" for axis in "xyz"}, **{f"M{axis}": f"M{axis}_Nm" for axis in "xyz"}}


HIGHEST_FLEXION_DEG = 130.0
"""End of arm26's range of elbow flexion [deg], see configs/subject/arm26.yaml."""


def bare_arm(
    start: float, excitations: Mapping[str, AnySignal], start_activation: float, arm: Arm | None = None
) -> System:
    """The arm at rest, fibres in static equilibrium.

    Args:
        start: elbow angle [rad].
        excitations: excitation of each muscle over time [-].
        start_activation: activation of every muscle at the start [-].
        arm: arm of a person; default: arm26.
    """
    arm = arm or Arm()
    forearm = next(body for body in arm.bodies(start) if body.name == "forearm")
    axis = tuple(arm.axis)
    return System(
        "arm26",
        bodies=[forearm],
        constraints=[
            Revolute(
                name=ELBOW, body_i=GROUND, body_j="forearm", point_i=tuple(arm.elbow), point_j=(0.0, 0.0, 0.0),
                axis_i=axis, axis_j=axis,
            )
        ],
        forces=[
            Gravity(name="gravity", acceleration=arm.gravity),
            *(arm.muscle(m, path=arm.path(m, welded=True), start_activation=start_activation) for m in arm.muscles),
        ],
        sensors=[
            JointAngle(name="elbow_angle", joint=ELBOW),
            *(MuscleSensor(name=f"{m}.sensor", muscle=m, components=tuple(COMPONENTS)) for m in arm.muscles),
            JointReaction(name="elbow_reaction", constraint=ELBOW, body="forearm"),
        ],
        inputs=[Input(name=excitation_name(m), signal=excitations[m]) for m in arm.muscles],
    )  # fmt: skip


MOST_BYTES, MOST_LINES = 16 << 20, 200_000
"""Size and lines up to which a table of excitations is read [byte, -]."""


def read_excitations(path: str | Path) -> dict[str, Steps]:
    """A table of excitations: 'time_s' and one column a muscle; each row holds until the next.

    Raises:
        InputError: names file, line and column of what is wrong.
    """
    path = Path(path)
    text = decoded(path, read_bytes(path, MOST_BYTES))
    if text.count("\n") + text.count("\r") > MOST_LINES:
        raise InputError(f"excitations '{path}' cannot be read: expected at most {MOST_LINES} lines.")
    try:
        lines = list(csv.reader(io.StringIO(text, newline="")))
    except csv.Error as error:
        raise InputError(f"excitations '{path}' cannot be read: {error}.") from None
    header = [name.strip() for name in lines[0]] if lines else []
    _check_header(path, header)
    rows = [
        [_number(path, k, name, text) for name, text in zip(header, line, strict=True)]
        for k, line in enumerate(lines[1:], 2)
        if _has_cells(path, k, line, header)
    ]
    if not rows:
        raise InputError(f"excitations '{path}' holds no row; give at least one, with its time and all excitations.")
    table = dict(zip(header, np.array(rows).T, strict=True))
    times = table[TIME]
    if np.any(np.diff(times) <= 0.0):
        k = int(np.argmax(np.diff(times) <= 0.0))
        raise InputError(
            f"excitations '{path}': {TIME} must increase from row to row, "
            f"but {times[k]:g} is followed by {times[k + 1]:g}."
        )
    if times[0] > 0.0:
        raise InputError(f"excitations '{path}': the first row is at {TIME} = {times[0]:g}; give one at 0 or before.")
    return {m: Steps(times=tuple(times), values=tuple(table[m])) for m in Arm().muscles}


def _check_header(path: Path, header: list[str]) -> None:
    """Refuse a table without exactly the expected columns, in any order."""
    expected = {TIME, *Arm().muscles}
    if len(header) == 1 and ";" in header[0]:
        raise InputError(f"excitations '{path}': the columns are separated by semicolons; separate them by commas.")
    for name in header:
        if name not in expected:
            raise InputError(f"excitations '{path}': unknown column '{brief(name, 60)}'. Expected {choices(expected)}.")
        if header.count(name) > 1:
            raise InputError(f"excitations '{path}': the column '{name}' stands twice.")
    missing = expected - set(header)
    if missing:
        raise InputError(f"excitations '{path}': missing columns: {choices(missing)}.")


def _has_cells(path: Path, line: int, cells: list[str], header: list[str]) -> bool:
    """Whether a line has cells; refuses a line of another length than the header."""
    if not any(cell.strip() for cell in cells):
        return False
    if len(cells) != len(header):
        raise InputError(f"excitations '{path}', line {line}: {len(cells)} cells, but {len(header)} columns.")
    return True


def _number(path: Path, line: int, column: str, text: str) -> float:
    """A cell as a finite number, an excitation within 0 to 1."""
    try:
        # Python takes 1_0 for 10.
        value = float("" if "_" in text else text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        said = brief(text, 60)
        raise InputError(f"excitations '{path}', line {line}, column '{column}': '{said}' is no finite number.")
    if column != TIME and not 0.0 <= value <= 1.0:
        raise InputError(f"excitations '{path}', line {line}, column '{column}': {value:g} is not within 0 to 1.")
    return value


def table(trajectory: Trajectory, sample: float) -> dict[str, np.ndarray]:
    """Columns of a run, every `sample` seconds and at its end."""
    times = trajectory.grid(sample)
    y = trajectory.sensors(times)
    columns = {
        TIME: times,
        # The sensor's angle is within half a turn; nothing stops the model's elbow from going further.
        "elbow_flexion_rad": np.unwrap(y["elbow_angle.angle"]),
        "elbow_speed_rad_per_s": y["elbow_angle.rate"],
        "elbow_acceleration_rad_per_s2": y["elbow_angle.acceleration"],
    }
    columns |= {f"{m}_{end}": y[f"{m}.sensor.{c}"] for c, end in COMPONENTS.items() for m in Arm().muscles}
    return columns | {f"elbow_reaction_on_forearm_{end}": y[f"elbow_reaction.{c}"] for c, end in REACTION.items()}


def warnings(trajectory: Trajectory) -> list[str]:
    """Sentences of warning: on an elbow outside the range of arm26; the bare arm has no stops, as OpenSim's."""
    degrees = np.degrees(np.unwrap(trajectory.sensors()["elbow_angle.angle"]))
    low, high = degrees.min(), degrees.max()
    if low >= 0.0 and high <= HIGHEST_FLEXION_DEG:
        return []
    return [
        f"the elbow moved from {low:.1f} to {high:.1f} deg of flexion; arm26 is meant for 0 to "
        f"{HIGHEST_FLEXION_DEG:.0f} deg, and nothing stops the joint there."
    ]
