"""`python -m agents export`: a trained policy as a folder that anybody can read and that cannot run code."""

from __future__ import annotations

import pickle
import sys
import zipfile
from pathlib import Path
from typing import Any

from tyro.conf import Positional

from agents.policies.learned import DESCRIPTION, LearnedPolicy
from agents.training.run_folder import RECORD, RunFolder
from dms_core.errors import DmsError, InputError, extra
from dms_core.output_file import check_writable

ONNX = "policy.onnx"


def export(
    source: Positional[Path],
    out: Path,
    last: bool = False,
    onnx: bool = True,
    trust: bool = False,
    statistics: Path | None = None,
    algorithm: str = "ppo",
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
    """
    if source.suffix == ".zip":
        policy = from_zip(source, statistics, algorithm, trust)
    elif (source / RECORD).is_file():
        folder = RunFolder(source)
        policy = LearnedPolicy.load((folder.checkpoints if last else folder.best).latest())
        if not last and policy.description.steps == 0:
            said = f"the best policy of '{source}' is the untrained one (0 steps); --last exports the last checkpoint's"
            print(f"warning: {said}", file=sys.stderr)
    elif (source / DESCRIPTION).is_file():
        policy = LearnedPolicy.load(source)
    else:
        raise InputError(f"'{source}' is neither the folder of a training or policy nor a .zip of Stable-Baselines3.")
    check_writable(out / DESCRIPTION)
    # One of an earlier export would be of another policy.
    (out / ONNX).unlink(missing_ok=True)
    policy.save(out)
    if onnx and _onnx_installed():
        from agents.export.onnx_file import write_onnx

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


def from_zip(source: Path, statistics: Path | None, algorithm: str, trust: bool) -> LearnedPolicy:
    """The policy of a file that Stable-Baselines3 saved elsewhere.

    Raises:
        InputError: it is not trusted, not whole, or was trained on other observations.
    """
    if not trust:
        raise InputError(
            f"'{source}' carries pickles, which can run any code when they are read. If you trust who made it, give "
            "--trust."
        )
    from agents.commands.train import require_training

    require_training()
    import gymnasium

    from agents.evaluation.evaluate import ENVIRONMENT
    from agents.export.extraction import extract
    from agents.training.algorithms import find

    model, env = _read(find(algorithm), source), gymnasium.make(ENVIRONMENT, disable_env_checker=True)
    try:
        return extract(
            model, env, algorithm=algorithm, env_kwargs={}, seed=model.seed, normalisation=_statistics(statistics)
        )
    except AttributeError as error:
        raise InputError(f"'{source}' is not a model of {algorithm}: {error}.") from None
    finally:
        env.close()


def _read(kind: Any, source: Path) -> Any:
    """A model, pickles and all."""
    try:
        return kind.load(source, device="cpu")
    except OSError as error:
        raise InputError(f"'{source}' cannot be read: {error.strerror}.") from None
    except (ValueError, RuntimeError, KeyError, TypeError, AssertionError, EOFError, zipfile.BadZipFile) as error:
        said = " ".join(str(error).split())[:200]
        raise InputError(f"'{source}' is no whole model of {kind.__name__}: {said}") from None


def _statistics(path: Path | None) -> Any:
    """A VecNormalize, pickled."""
    if path is None:
        return None
    from stable_baselines3.common.vec_env import VecNormalize

    try:
        with path.open("rb") as file:
            found = pickle.load(file)
    except OSError as error:
        raise InputError(f"'{path}' cannot be read: {error.strerror}.") from None
    except (pickle.UnpicklingError, EOFError, AttributeError, ImportError, IndexError) as error:
        raise InputError(f"'{path}' is no whole pickle: {error}.") from None
    if not isinstance(found, VecNormalize):
        raise DmsError(f"'{path}' holds a {type(found).__name__}; a VecNormalize is wanted.")
    return found
