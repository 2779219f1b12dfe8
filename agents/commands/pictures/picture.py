"""`python -m agents picture`: one patient under several policies, side by side."""

from __future__ import annotations

from typing import Annotated

from tqdm import tqdm
from tyro.conf import arg

from dms_core.command_line import FAILED_RUN, FileOut
from dms_core.errors import InputError
from dms_core.figures import FORMATS, require_matplotlib
from dms_core.files.outputs import OutputFile, Outputs

from ...environment import HIDDEN_PLAN, environment_id
from ...evaluation.episodes.time_course import TimeCourse, time_course
from ...evaluation.figures.policy_picture import NEEDED, policy_picture
from ..options import EnvironmentId, device_settings, different_policies, given_folders

MOST = 6
"""Policies that fit side by side."""


def picture(
    policy_names: Annotated[tuple[str, ...], arg(name="policy", metavar="A B")],
    out: FileOut,
    patient: str = "stroke_severe",
    seed: int = 0,
    environment: EnvironmentId = HIDDEN_PLAN,
    exoskeleton: str | None = None,
    overwrite: bool = False,
) -> int:
    """Draw one patient under several policies: what was wanted and done, and what device and muscles gave for it.

    Args:
        policy_names: one to six: names of the command `policies`, folders of trained ones, or module:Class.
        out: .png, .svg or .pdf.
        patient: population to draw from.
        seed: of the episode.
        environment: in which, by id; module:ID where another package registers it.
        exoskeleton: device by name or YAML file, or changes of the default one as JSON.
        overwrite: replace a file of this name.
    """
    if not 1 <= len(policy_names) <= MOST:
        raise InputError(f"--policy: expected one to {MOST} names, got {len(policy_names)}.")
    if out.suffix not in FORMATS:
        raise InputError(f"output '{out}': expected a name that ends in {', '.join(FORMATS)}.")
    require_matplotlib()
    environment_id(environment)
    used, settings = different_policies(policy_names, environment), device_settings(exoskeleton)
    inputs = [patient, exoskeleton, *given_folders(policy_names)]
    with Outputs("picture", files=[OutputFile("--out", out)], inputs=inputs, overwrite=overwrite) as outputs:
        ones: list[TimeCourse] = []
        for one in tqdm(used, unit="policy", leave=False, disable=None):
            ones.append(time_course(one, patient, seed, environment=environment, **settings))
            _check(ones[-1], environment)
        policy_picture(out, ones, f"One patient of '{patient}', seed {seed}")
    print(f"written: {outputs.where(out)}")
    return FAILED_RUN if outputs.failed else 0


def _check(one: TimeCourse, environment: str) -> None:
    """Refuse an environment that lacks what the picture is made of."""
    missing = [name for name in NEEDED if name not in one.columns]
    if missing:
        raise InputError(
            f"--env {environment}: expected one with the readings {', '.join(NEEDED)}, got no {missing[0]}."
        )
