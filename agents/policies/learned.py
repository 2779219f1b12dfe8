"""Trained policies as a folder of numbers: policy.json says what they are, weights.safetensors holds them.

Nothing in the folder can run code, and nothing here needs PyTorch.
"""

from __future__ import annotations

import hashlib
import importlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from pydantic import Field

from dms_core.config_files import configs
from dms_core.errors import InputError, choices
from dms_core.output_file import write_bytes, write_text
from exo_env.settings import Settings

from ..checkpoint import Store
from ..environment import PROGRAM, environment_id
from .baselines import POLICIES
from .baselines import policy as baseline
from .network import Architecture, Network
from .policy import Policy
from .safetensors import from_bytes, to_bytes

DESCRIPTION, WEIGHTS, FORMAT = "policy.json", "weights.safetensors", 1
SHIPPED = configs() / "policies"
COMPARED = ("group", "name", "start", "stop", "unit", "scale")
"""What of each part of the observation has to be as in training."""


class Description(Settings):
    """What a policy is, and the environment it knows."""

    format: int = Field(default=FORMAT, ge=FORMAT, le=FORMAT, description="of the folder")
    title: str
    algorithm: str
    environment: str
    exo_env: str = Field(description="version it was trained with")
    env_kwargs: dict[str, Any] = Field(description="of the training environment")
    action_mode: str
    observation: tuple[str, ...] = Field(description="groups, or channels as group.channel, in order")
    structure: tuple[dict[str, Any], ...] = Field(description="of the observation: names, units, scales")
    period: float = Field(gt=0.0, description="control period [s]")
    drive: dict[str, Any] = Field(description="what actions command")
    architecture: Architecture
    steps: int = Field(ge=0, description="of training")
    seed: int | None = None
    weights_sha256: str = ""

    @property
    def common(self) -> str:
        """A digest of all but steps, seed and weights: the same for trainings that differ in nothing but the seed."""
        facts = self.model_dump(mode="json", exclude={"steps", "seed", "weights_sha256", "title"})
        return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()[:16]


def world_facts(env: gymnasium.Env) -> dict[str, Any]:
    """What a description holds of an environment."""
    world: Any = env.unwrapped
    parts = [json.loads(json.dumps(part.as_dict())) for part in world.observation_structure]
    return {
        "action_mode": world.action_mode,
        "observation": tuple(map(str, world.settings.observation)),
        "structure": tuple(parts),
        "period": world.period,
        "drive": world.drive.model_dump(mode="json"),
    }


class LearnedPolicy(Policy):
    """A trained policy that does what it holds best.

    Args:
        description: of the policy.
        arrays: its numbers.
        name: in tables.
    """

    def __init__(self, description: Description, arrays: Mapping[str, np.ndarray], name: str = "learned") -> None:
        self.description, self.arrays = description, dict(arrays)
        self.network = Network(description.architecture, arrays)
        # A policy's own, where those of baselines are of the class.
        own: dict[str, Any] = {
            "name": name, "title": description.title, "action_mode": description.action_mode,
            "observation": description.observation, "training": description.common,
        }  # fmt: skip
        self.__dict__.update(own)

    @classmethod
    def load(cls, folder: str | Path, name: str | None = None) -> LearnedPolicy:
        """A policy from its folder.

        Raises:
            InputError: a file is missing, cut off, changed, or of another environment or format.
        """
        folder = Path(folder)
        try:
            file = DESCRIPTION
            facts = json.loads((folder / file).read_text(encoding="utf-8"))
            file = WEIGHTS
            content = (folder / file).read_bytes()
        except (OSError, UnicodeDecodeError) as error:
            reason = error.strerror if isinstance(error, OSError) else "it is no text"
            raise InputError(f"policy '{folder}' cannot be read: {file}: {reason}.") from None
        except ValueError as error:
            raise InputError(f"'{folder / DESCRIPTION}' is no JSON: {error}.") from None
        if not isinstance(facts, dict):
            raise InputError(f"'{folder / DESCRIPTION}' holds a {type(facts).__name__}: expected a mapping.")
        try:
            facts["architecture"] = Architecture(**facts.get("architecture", {}))
            description = Description(**facts)
            _check_registered(description.environment)
            if hashlib.sha256(content).hexdigest() != description.weights_sha256:
                raise InputError(f"{WEIGHTS} is cut off or was changed: its SHA-256 is not that of {DESCRIPTION}.")
            return cls(description, from_bytes(content, folder / WEIGHTS), name or str(folder))
        except (InputError, TypeError) as error:
            raise InputError(f"policy '{folder}': {error}") from None

    def save(self, folder: Path) -> None:
        """Write the folder; the description comes last, so that a folder with one is whole."""
        content = to_bytes(self.arrays)
        write_bytes(folder / WEIGHTS, content)
        facts = self.description.model_dump(mode="json") | {"weights_sha256": hashlib.sha256(content).hexdigest()}
        write_text(folder / DESCRIPTION, json.dumps(facts, indent=2) + "\n")

    def reset(self, env: gymnasium.Env) -> None:
        """Forget the last patient; an environment that the policy does not know is refused."""
        facts, d = world_facts(env), self.description
        mine = [[part[k] for k in COMPARED] for part in d.structure]
        theirs = [[part[k] for k in COMPARED] for part in facts["structure"]]
        for what, trained, here in (
            ("observation", mine, theirs),
            ("action mode", d.action_mode, facts["action_mode"]),
            ("control period", d.period, facts["period"]),
            ("drive", d.drive, facts["drive"]),
        ):
            if trained != here:
                raise InputError(f"policy '{self.name}' was trained with another {what}: {trained}, not {here}.")
        self.network.reset()

    def __call__(self, observation: np.ndarray, info: dict[str, Any]) -> np.ndarray:
        """The action held best."""
        return self.network(observation)


def _check_registered(environment: str) -> None:
    """What is observed and commanded is compared at each reset; here only whether the environment is known at all."""
    try:
        environment_id(environment)
    except InputError as error:
        raise InputError(f"it was trained in {environment}: {error}") from None


def find_policy(name: str) -> Policy:
    """A policy by what a user calls it.

    Args:
        name: a baseline or a shipped policy; the folder of a trained one, or of its training; or "module:Class" for a
            class of your own, see `Policy`.

    Raises:
        InputError: there is none; says how a .zip of Stable-Baselines3 becomes one.
    """
    if name in POLICIES:
        return baseline(name)
    if name in shipped_policies():
        return LearnedPolicy.load(SHIPPED / name, name)
    folder = Path(name)
    if folder.suffix == ".zip":
        raise InputError(
            f"policy '{name}': a .zip of Stable-Baselines3 carries pickles, which can run any code when they are read. "
            f"If you trust who made it, export it first, and evaluate the folder: "
            f"{PROGRAM} export {name} --trust --algorithm ppo --action-mode MODE --out {folder.with_suffix('')}_policy"
        )
    if (folder / DESCRIPTION).is_file():
        return LearnedPolicy.load(folder, name)
    if (folder / "run.json").is_file():
        return LearnedPolicy.load(Store(folder / "best").latest(), name)
    if ":" in name:
        return own_policy(name)
    if folder.is_dir():
        raise InputError(f"policy '{name}': there is no {DESCRIPTION} in this folder.")
    if folder.exists():
        raise InputError(f"policy '{name}' is a file: expected the folder of a policy or of a training.")
    if "/" in name:
        raise InputError(f"policy '{name}': there is no such folder.")
    known = [*POLICIES, *shipped_policies()]
    raise InputError(
        f"unknown policy '{name}'. There are: {choices(known)}, folders of trained policies, and module:Class for your "
        "own."
    )


def own_policy(name: str) -> Policy:
    """A policy of a user's own class.

    Args:
        name: "module:Class"; the module is imported, and the class called without arguments.

    Raises:
        InputError: the module or the class is not there, or it is no `Policy`.
    """
    module, _, kind = name.partition(":")
    try:
        own = getattr(importlib.import_module(module), kind)
    except (ImportError, ValueError, AttributeError) as error:
        raise InputError(f"policy '{name}': expected module:Class that Python can import, got: {error}.") from None
    if not (isinstance(own, type) and issubclass(own, Policy)):
        raise InputError(f"policy '{name}': expected a subclass of {Policy.__module__}.Policy, got {own!r}.")
    missing = [what for what in ("title", "action_mode") if not hasattr(own, what)]
    if missing or own.__abstractmethods__:
        raise InputError(
            f"policy '{name}': the class lacks {choices([*missing, *own.__abstractmethods__])}; see Policy."
        )
    one = own()
    one.__dict__["name"] = name
    return one


def repetitions_of(policies: Sequence[Policy], given: int | None = None) -> int:
    """Repetitions of an episode: as given, else as the trained policies among these learned, else 1.

    Raises:
        InputError: they learned with different ones.
    """
    if given is not None:
        return given
    learned = {p.name: p.description.env_kwargs.get("repetitions", 1) for p in policies if isinstance(p, LearnedPolicy)}
    if len({*learned.values()}) > 1:
        said = ", ".join(f"{name} with {often}" for name, often in learned.items())
        raise InputError(
            f"these policies were trained with different repetitions ({said}); give --repetitions, and to a report an "
            "evaluation of both."
        )
    return next(iter(learned.values()), 1)


def shipped_policies() -> list[str]:
    """Names of the trained policies that come with this project."""
    return sorted(p.parent.name for p in SHIPPED.glob(f"*/{DESCRIPTION}"))
