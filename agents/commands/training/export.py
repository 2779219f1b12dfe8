"""`python -m agents export`: a trained policy as a folder that anybody can read and that cannot run code."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from dms_core.command_line import FAILED_RUN, FolderOut
from dms_core.errors import InputError, extra
from dms_core.files.outputs import Outputs

from ...environment import ENVIRONMENT
from ...export.model_zip import from_zip
from ...policies.learned import DESCRIPTION, LearnedPolicy
from ...training.files.run_folder import RECORD, RunFolder
from ..options import EnvironmentId

ONNX = "policy.onnx"


def export(
    source: Positional[Path],
    out: FolderOut,
    last: bool = False,
    onnx: bool = True,
    trust: bool = False,
    statistics: Path | None = None,
    algorithm: str = "ppo",
    action_mode: Annotated[str | None, arg(metavar="MODE")] = None,
    environment: EnvironmentId = ENVIRONMENT,
    overwrite: bool = False,
) -> int:
    """Write a trained policy as policy.json, weights.safetensors and policy.onnx.

    Args:
        source: folder of a training, or a .zip of Stable-Baselines3.
        out: folder for the policy.
        last: the policy of the last checkpoint instead of the best one.
        onnx: write policy.onnx too, where the package onnx is installed.
        trust: a .zip carries pickles, which can run any code when they are read; say that you trust who made it.
        statistics: vecnormalize.pkl of a .zip, also a pickle.
        algorithm: of a .zip.
        action_mode: of a .zip, which does not say it: rope_tension, pid_setpoint, or one of your environment's own.
        environment: in which the model of a .zip was trained, by id.
        overwrite: replace files in the folder that others wrote or changed.
    """
    policy = _policy(source, last, trust, statistics, algorithm, action_mode, environment)
    with Outputs("export", folder=out, inputs=[source, statistics], overwrite=overwrite) as outputs:
        policy.save(out)
        if onnx and _onnx_installed():
            from ...export.onnx_file import write_onnx

            write_onnx(policy, out / ONNX)
        elif onnx:
            print(f"{ONNX} is left out; it needs the package onnx. {extra('export')}")
    d, which = policy.description, ""
    if (source / RECORD).is_file():
        which = "last checkpoint, " if last else "best on the patients set aside, "
    print(f"{d.title}, {which}{d.steps} steps, {sum(a.size for a in policy.arrays.values())} numbers")
    print(f"written: {outputs.where(out)}")
    return FAILED_RUN if outputs.failed else 0


def _policy(
    source: Path, last: bool, trust: bool, statistics: Path | None, algorithm: str, action_mode: str | None,
    environment: str,
) -> LearnedPolicy:  # fmt: skip
    """The policy of a training, of a folder or of a .zip; arguments as of `export`.

    Raises:
        InputError: it is none of these, or a file is not whole.
    """
    if source.suffix == ".zip":
        return from_zip(source, statistics, algorithm, trust, action_mode, environment)
    if (source / RECORD).is_file():
        folder = RunFolder(source)
        policy = LearnedPolicy.load((folder.checkpoints if last else folder.best).latest())
        if not last and policy.description.steps == 0:
            hint = f"the best policy of '{source}' is the untrained one (0 steps); --last exports the last checkpoint's"
            print(f"warning: {hint}", file=sys.stderr)
        return policy
    if (source / DESCRIPTION).is_file():
        return LearnedPolicy.load(source)
    raise InputError(f"'{source}' is neither the folder of a training or policy nor a .zip of Stable-Baselines3.")


def _onnx_installed() -> bool:
    try:
        import onnx  # noqa: F401
    except ImportError:
        return False
    return True
