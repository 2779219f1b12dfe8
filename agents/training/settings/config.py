"""A training's configuration: rl_zoo3's YAML format, read without running anything it holds.

A file has a section named after the environment, with the algorithm's arguments by the names of Stable-Baselines3 and
beside them n_envs, n_timesteps, policy, normalize, frame_stack and env_kwargs. A second section, `training`, which
rl_zoo3 does not look at, says what it takes from its command line: how often to evaluate and to save.

rl_zoo3 reads YAML 1.1, all else here is YAML 1.2; what the two read differently (010, 1e5 without a point and a sign,
yes) is refused in such a file, with what to write instead (yaml_scalars.py).

rl_zoo3 gives env_kwargs to the environments that it trains in, and none to those that it evaluates in. A section that
it is to read therefore has them once more, as arguments of the wrapper SAME_SETTINGS, which it puts around both.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import Field

from dms_core.errors import InputError, choices
from dms_core.files.yaml_text import read_yaml
from dms_core.validation import cut, shown
from exo_env.settings import Settings

from .config_file import SAME_SETTINGS, TRAINING, check_wrapper, chosen, override_values, sections
from .imitation import Imitation
from .rl_zoo_text import plain, write_call

ALIASES = {"ppo_lstm": "recurrent_ppo"}
"""rl_zoo3's name of an algorithm to that of Stable-Baselines3."""

MOST_ENVS, MOST_STEPS, MOST_FRAMES = 10_000, 10**12, 1000
"""Most environments, steps and observations in a stack."""
Steps = Annotated[int, Field(ge=1, le=MOST_STEPS)]
"""A number of steps."""
Component = Annotated[float, Field(ge=-1.0, le=1.0)]
"""One component of an action."""


class Training(Settings):
    """How a run is watched and kept."""

    algorithm: str = Field(description="name, see algorithms.py")
    eval_every: Steps = Field(default=50_000, description="steps between two evaluations")
    eval_patients: int = Field(default=10, ge=1, le=1000, description="episodes of an evaluation")
    eval_seed: int = Field(
        default=20_251_013, ge=0, le=2**63 - 1, description="of its patients, the same ones every time"
    )
    save_every: Steps = Field(default=50_000, description="steps between two checkpoints")
    threads: int = Field(default=1, ge=1, le=256, description="of PyTorch; small networks gain nothing from more")
    traces: tuple[float, ...] = Field(
        default=(),
        max_length=8,
        description="time constants of filtered observations beside each one [s]",
    )
    hold: int = Field(default=1, ge=1, le=100, description="control periods that an action is held")
    start: tuple[Component, ...] | None = Field(
        default=None,
        max_length=MOST_FRAMES,
        description="action of the untrained policy, from which it learns to differ; None: all 0",
    )
    against: tuple[Component, ...] | None = Field(
        default=None,
        max_length=MOST_FRAMES,
        description="action whose reward on the same patient is taken off that of training; None: none",
    )
    critic: tuple[str, ...] = Field(default=(), description="groups or channels that only PPO's critic sees")
    imitation: Imitation | None = Field(default=None, description="of a teacher, by the algorithm dagger")
    initial: str | None = Field(
        default=None, min_length=1, max_length=4096,
        description="trained policy whose networks learning begins with, as a teacher; of a training the newest",
    )  # fmt: skip
    held: int = Field(default=0, ge=0, le=MOST_STEPS, description="steps at the start in which only the critic learns")
    device: str = Field(default="cpu", pattern=r"^(cpu|cuda(:\d+)?|mps|auto)$", description="of PyTorch")


@dataclass(frozen=True)
class Config:
    """What to train, and how."""

    training: Training
    environment: str
    """Id of the environment, which is the name of its section."""
    n_envs: int
    n_timesteps: int
    policy: str
    env_kwargs: dict[str, Any]
    normalize: dict[str, Any] | None
    """Arguments of VecNormalize; None: nothing is normalised."""
    frame_stack: int
    """Observations that the policy sees at once."""
    arguments: dict[str, Any]
    """Arguments of the algorithm, not yet checked: algorithms.py knows them."""
    section: dict[str, Any]
    """The environment's section as given, overrides included."""

    @classmethod
    def read(cls, path: str | Path, overrides: Sequence[str] = (), environment: str | None = None) -> Self:
        """A configuration file, some values replaced.

        Args:
            path: the algorithm is named after it unless its `training` section says otherwise.
            overrides: `key=value` or `key.key=value`, the value in YAML 1.2, where 1e5 is a number; keys of the
                environment's section, or of `training` as `training.key`. Each key stands once.
            environment: id of the section to take, where a file has several; the default one, or the only one of an
                environment that is registered, where it is not given.

        Raises:
            InputError: names file, key and value.
        """
        path = Path(path)
        try:
            return cls.of(read_yaml(path, portable=True), path.stem, overrides, environment)
        except InputError as error:
            said = str(error)
            raise InputError(said if str(path) in said else f"{path}: {said}") from None

    @classmethod
    def of(
        cls, content: Mapping[str, Any], name: str, overrides: Sequence[str] = (), environment: str | None = None
    ) -> Self:
        """A configuration from a file's content; `name` is the algorithm where the content does not say."""
        key, used = chosen(content, environment)
        section, training = sections(content, key)
        check_wrapper(section)
        override_values(section, training, overrides)
        training.setdefault("algorithm", name)
        if isinstance(training["algorithm"], str):
            training["algorithm"] = ALIASES.get(training["algorithm"], training["algorithm"])
        rest = {k: v for k, v in section.items() if k not in OURS}
        policy = section.get("policy", "MlpPolicy")
        if not isinstance(policy, str):
            raise InputError(f"policy = {shown(policy)}: expected the name of a policy.")
        return cls(
            training=Training(**training),
            environment=used,
            n_envs=_whole("n_envs", section.get("n_envs", 1), MOST_ENVS),
            n_timesteps=_whole("n_timesteps", _needed(section, "n_timesteps"), MOST_STEPS),
            policy=policy,
            env_kwargs=_mapping("env_kwargs", section.get("env_kwargs", {})),
            normalize=_normalisation(section.get("normalize", False), section),
            frame_stack=_whole("frame_stack", section.get("frame_stack", 1), MOST_FRAMES),
            arguments=rest,
            section=section,
        )

    def placed(self, folder: Path, seed: int) -> Self:
        """The configuration in its training's folder: names of other trainings are paths.

        Args:
            folder: of the training, beside which a policy lies whose name begins with ../.
            seed: of the training, in place of {seed}.
        """

        def path(name: str) -> str:
            named = name.replace("{seed}", str(seed))
            return os.path.normpath(folder / named) if named.startswith("../") else named

        training, imitation = self.training, self.training.imitation
        changes: dict[str, Any] = {}
        if training.initial is not None:
            changes["initial"] = path(training.initial)
        if imitation is not None:
            changes["imitation"] = imitation.model_copy(update={"teacher": path(imitation.teacher)})
        return replace(self, training=training.model_copy(update=changes))

    def content(self) -> dict[str, Any]:
        """What a file of this configuration holds; rl_zoo3 reads it too."""
        section = {k: write_call(v) if k == "policy_kwargs" else plain(v) for k, v in self.section.items()}
        if self.env_kwargs:
            section["env_wrapper"] = {SAME_SETTINGS: plain(self.env_kwargs)}
        return {self.environment: section, TRAINING: self.training.model_dump()}


OURS = ("n_envs", "n_timesteps", "policy", "normalize", "frame_stack", "env_kwargs")
NORMALISATION = {"norm_obs": bool, "norm_reward": bool, "clip_obs": float, "clip_reward": float, "epsilon": float}
"""Arguments of VecNormalize that may be given, with their types; gamma is the algorithm's."""


def _needed(section: Mapping[str, Any], key: str) -> Any:
    if key not in section:
        raise InputError(f"'{key}' is missing.")
    return section[key]


def _whole(key: str, value: Any, most: int) -> int:
    """A whole number from 1; 1e6 is one."""
    number = not isinstance(value, bool) and isinstance(value, int | float)
    if not (number and 1 <= value <= most and value == int(value)):
        raise InputError(f"{key} = {shown(value)}: expected a whole number from 1 to {most:g}.")
    return int(value)


def _mapping(key: str, value: Any) -> dict[str, Any]:
    if not isinstance(value, Mapping):
        raise InputError(f"{key} = {shown(value)}: expected a mapping.")
    return dict(value)


def _normalisation(value: Any, section: Mapping[str, Any]) -> dict[str, Any] | None:
    """Arguments of VecNormalize, or None."""
    if isinstance(value, bool):
        given: dict[str, Any] = {}
        if not value:
            return None
    else:
        given = _mapping("normalize", value)
    for key, one in given.items():
        if key not in NORMALISATION:
            raise InputError(f"normalize: unknown key '{cut(key)}'. Allowed: {choices(NORMALISATION)}.")
        kinds = (bool,) if NORMALISATION[key] is bool else (int, float)
        if not isinstance(one, kinds) or (bool not in kinds and (isinstance(one, bool) or not 0 < one < math.inf)):
            right = "true or false" if bool in kinds else "a positive number"
            raise InputError(f"normalize: {key} = {shown(one)}: expected {right}.")
    gamma = section.get("gamma")
    return given | ({"gamma": gamma} if isinstance(gamma, float) else {})
