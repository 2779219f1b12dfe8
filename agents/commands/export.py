"""`python -m agents export`: a trained policy as a folder that anybody can read and that cannot run code."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from dms_core.errors import InputError, extra
from dms_core.output_file import check_writable

from ..environment import ENVIRONMENT
from ..export.model_zip import from_zip
from ..policies.learned import DESCRIPTION, LearnedPolicy
from ..training.run_folder import RECORD, RunFolder

ONNX = "policy.onnx"


def export(
    source: Positional[Path],
    out: Path,
    last: bool = False,
    onnx: bool = True,
    trust: bool = False,
    statistics: Path | None = None,
    algorithm: str = "ppo",
    action_mode: Annotated[str | None, arg(metavar="MODE")] = None,
    environment: Annotated[str, arg(name="env", metavar="ID")] = ENVIRONMENT,
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
    """
    if source.suffix == ".zip":
        policy = from_zip(source, statistics, algorithm, trust, action_mode, environment)
    elif (source / RECORD).is_file():
        folder = RunFolder(source)
        policy = LearnedPolicy.load((folder.checkpoints if last else folder.best).latest())
        if not last and policy.description.steps == 0:
            hint = f"the best policy of '{source}' is the untrained one (0 steps); --last exports the last checkpoint's"
            print(f"warning: {hint}", file=sys.stderr)
    elif (source / DESCRIPTION).is_file():
        policy = LearnedPolicy.load(source)
    else:
        raise InputError(f"'{source}' is neither the folder of a training or policy nor a .zip of Stable-Baselines3.")
    check_writable(out / DESCRIPTION)
    # One of an earlier export would be of another policy.
    (out / ONNX).unlink(missing_ok=True)
    policy.save(out)
    if onnx and _onnx_installed():
        from ..export.onnx_file import write_onnx

        write_onnx(policy, out / ONNX)
    elif onnx:
        print(f"{ONNX} is left out; it needs the package onnx. {extra('export')}")
    d, which = policy.description, ""
    if (source / RECORD).is_file():
        which = "last checkpoint, " if last else "best on the patients set aside, "
    print(f"{d.title}, {which}{d.steps} steps, {sum(a.size for a in policy.arrays.values())} numbers")
    print(f"written: {out}")
    return 0


def _onnx_installed() -> bool:
    try:
        import onnx  # noqa: F401
    except ImportError:
        return False
    return True
