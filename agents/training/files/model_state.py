"""Everything a training goes on from, as files: networks, optimisers, statistics, replay buffer, random states.

model.zip is what Stable-Baselines3 writes, for others to read. Of it only the tensors are read back, with PyTorch's
loader of weights: the pickles in it, which could run code, are never opened. The rest is NumPy's format.
"""

from __future__ import annotations

import io
import random
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.save_util import load_from_zip_file, recursive_setattr
from stable_baselines3.common.vec_env import VecNormalize

from dms_core.errors import InputError
from dms_core.files.input_file import opened
from dms_core.files.json_text import brief
from dms_core.files.output_file import write_bytes, write_file

from ..learners.dagger import Dagger

MODEL, STATISTICS, REPLAY, RANDOM = "model.zip", "statistics.npz", "replay.npz", "random.npz"
DEMONSTRATIONS = "demonstrations.npz"
COLUMNS = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
"""Arrays of a replay buffer."""


def save_state(model: BaseAlgorithm, folder: Path) -> None:
    """Write everything into a folder."""
    save_model(model, folder)
    if isinstance(model, OffPolicyAlgorithm):
        _save_replay(model, folder / REPLAY)
    if isinstance(model, Dagger):
        _write(folder / DEMONSTRATIONS, **model.demonstrations.columns)
    kind, keys, position, has_gauss, gauss = np.random.get_state()
    of_python = random.getstate()
    _write(
        folder / RANDOM, torch=torch.get_rng_state().numpy(), numpy=np.array(keys),
        numpy_rest=np.array([position, has_gauss, gauss], float), python=np.array(of_python[1]),
    )  # fmt: skip


def save_model(model: BaseAlgorithm, folder: Path) -> None:
    """Write networks and statistics into a folder."""
    content = io.BytesIO()
    model.save(content)
    write_bytes(folder / MODEL, content.getvalue())
    if (statistics := model.get_vec_normalize_env()) is not None:
        arrays: dict[str, Any] = {}
        for name, one in _running(statistics).items():
            arrays |= {f"{name}_mean": one.mean, f"{name}_var": one.var, f"{name}_count": one.count}
        _write(folder / STATISTICS, **arrays)


def load_state(model: BaseAlgorithm, folder: Path) -> None:
    """Put everything from a folder into a fresh model of the same configuration.

    Raises:
        InputError: a file is cut off, or belongs to another configuration; names it.
    """
    try:
        _load_networks(model, folder / MODEL)
        if (statistics := model.get_vec_normalize_env()) is not None:
            _load_statistics(statistics, folder / STATISTICS)
        if isinstance(model, OffPolicyAlgorithm):
            _load_replay(model, folder / REPLAY)
        if isinstance(model, Dagger):
            _load_demonstrations(model, folder / DEMONSTRATIONS)
        _load_random(folder / RANDOM)
    except OSError as error:
        raise InputError(f"'{error.filename}' cannot be read: {error.strerror}.") from None


def _load_random(path: Path) -> None:
    """Random states of PyTorch, NumPy and Python."""
    arrays = _read(path)
    try:
        position, has_gauss, gauss = arrays["numpy_rest"]
        torch.set_rng_state(torch.from_numpy(arrays["torch"]))
        np.random.set_state(("MT19937", arrays["numpy"], int(position), int(has_gauss), float(gauss)))
        random.setstate((3, tuple(int(x) for x in arrays["python"]), None))
    except (KeyError, ValueError, TypeError, RuntimeError, OverflowError) as error:
        raise InputError(f"'{path}' does not hold random states: {brief(str(error))}.") from None


def _load_networks(model: BaseAlgorithm, path: Path) -> None:
    """Weights and optimisers."""
    try:
        with opened(path) as file:
            _check_stored(file)
            content = io.BytesIO(file.read())
        _, tensors, variables = load_from_zip_file(content, device=model.device, load_data=False)
        model.set_parameters(tensors, exact_match=True, device=model.device)
        for name, value in (variables or {}).items():
            recursive_setattr(model, f"{name}.data", value.data)
    except (InputError, OSError):
        raise
    except Exception as error:  # what a damaged archive of tensors raises has no common class
        said = brief(" ".join(str(error).split()) or type(error).__name__)
        raise InputError(
            f"'{path}' does not hold the networks of this configuration. Where a version of the environment shows "
            f"other channels than the one that a training began with, the training cannot go on: {said}"
        ) from None


def _running(statistics: VecNormalize) -> dict[str, Any]:
    """Running statistics by name."""
    return {"observation": statistics.obs_rms, "return": statistics.ret_rms}


def _load_statistics(statistics: VecNormalize, path: Path) -> None:
    """Means and variances."""
    arrays = _read(path)
    for name, one in _running(statistics).items():
        mean, var = _of_shape(path, arrays, f"{name}_mean", one.mean), _of_shape(path, arrays, f"{name}_var", one.var)
        count = _of_shape(path, arrays, f"{name}_count", 0.0)
        if (var < 0.0).any() or count < 0.0:
            raise InputError(f"'{path}': {name}_var or {name}_count is below 0.")
        one.mean, one.var, one.count = mean, var, float(count)


def _save_replay(model: OffPolicyAlgorithm, path: Path) -> None:
    """The part of the buffer that is filled."""
    buffer: Any = model.replay_buffer
    size = buffer.size()
    columns = {name: getattr(buffer, name)[:size] for name in COLUMNS}
    _write(path, place=np.array([buffer.pos, buffer.full]), **columns)


def _load_replay(model: OffPolicyAlgorithm, path: Path) -> None:
    """Into an empty buffer of the same size."""
    buffer, arrays = model.replay_buffer, _read(path)
    assert buffer is not None
    for name in COLUMNS:
        column, place = arrays.get(name), getattr(buffer, name)
        if column is None or column.shape[1:] != place.shape[1:] or len(column) > len(place):
            raise InputError(f"'{path}' does not hold the replay buffer of this configuration: {name} does not fit.")
        place[: len(column)] = column
    rows = {len(arrays[name]) for name in COLUMNS}
    place = _of_shape(path, arrays, "place", (0, 0))
    position, full = int(place[0]), bool(place[1])
    if len(rows) > 1 or rows != {buffer.buffer_size if full else position} or not 0 <= position < buffer.buffer_size:
        raise InputError(f"'{path}' does not hold the replay buffer of this configuration: place does not fit.")
    buffer.pos, buffer.full = position, full


def _load_demonstrations(model: Dagger, path: Path) -> None:
    """What a teacher said in the last rounds."""
    try:
        model.demonstrations.restore(_read(path))
    except InputError as error:
        if str(path) in str(error):
            raise
        raise InputError(f"'{path}' does not hold the demonstrations of this configuration: {error}.") from None


def _write(path: Path, **arrays: Any) -> None:
    write_file(path, lambda file: np.savez(file, allow_pickle=False, **arrays))


def _read(path: Path) -> Mapping[str, np.ndarray]:
    """Arrays of a file; pickles are refused."""
    try:
        with opened(path) as file:
            _check_stored(file)
            with np.load(file, allow_pickle=False) as arrays:
                return dict(arrays)
    except InputError:
        raise
    except Exception as error:  # what a damaged archive of arrays raises has no common class
        said = brief(str(error) or type(error).__name__)
        raise InputError(f"'{path}' is cut off or no NumPy archive: {said}.") from None


def _check_stored(file: BinaryIO) -> None:
    """Refuses compressed archives: these here are not, and a small one could unpack to more than the memory holds."""
    with zipfile.ZipFile(file) as archive:
        if any(one.file_size != one.compress_size for one in archive.infolist()):
            raise zipfile.BadZipFile("it is compressed")
    file.seek(0)


def _of_shape(path: Path, arrays: Mapping[str, np.ndarray], name: str, like: Any) -> np.ndarray:
    """An array of finite numbers that has to have the shape of another."""
    known = arrays.get(name)
    if known is None or known.dtype.kind not in "fiub" or known.shape != np.shape(like) or not np.isfinite(known).all():
        raise InputError(f"'{path}' does not hold what this configuration has: {name} does not fit.")
    return known
