"""Trained policies as a folder of numbers: policy.json says what they are, weights.safetensors holds them.

Nothing in the folder can run code, and nothing here needs PyTorch.
"""

from __future__ import annotations

import hashlib
import importlib
import json
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import gymnasium
import numpy as np
from pydantic import AfterValidator, ConfigDict, FailFast, Field

from dms_core.errors import InputError, ModelWarning, choices
from dms_core.files.config_files import configs
from dms_core.files.input_file import read_bytes
from dms_core.files.json_text import Each, brief, checked, finite, read_json
from dms_core.files.output_file import write_bytes, write_text
from dms_core.validation import Checked
from exo_env.settings import Settings
from exo_env.tasks.task import Task

from ..checkpoint import Store
from ..environment import PROGRAM, environment_id, task_type
from .baselines import POLICIES
from .baselines import policy as baseline
from .network import Architecture, Count, Network
from .policy import Policy
from .safetensors import from_bytes, to_bytes

DESCRIPTION, WEIGHTS, FORMAT = "policy.json", "weights.safetensors", 2
"""Format 1 does not hold the hash of the description itself."""
MOST_DESCRIPTION, MOST_WEIGHTS = 1 << 20, 128 << 20
"""Sizes up to which the files are read [byte]."""
SHIPPED = configs() / "policies"
COMPARED = ("group", "name", "labels", "start", "stop", "unit", "scale")
"""What of each part of the observation has to be as in training."""


def whole_repetitions(settings: dict[str, Any]) -> dict[str, Any]:
    """Settings of an environment out of a file, whose repetitions are counted before an environment checks them."""
    often = settings.get("repetitions", 1)
    if type(often) is not int or often < 1:
        raise ValueError(f"repetitions = {brief(repr(often), 60)}: expected a whole number of at least 1")
    return settings


class Part(Checked):
    """What a description says of a part of the observation, as far as it is compared."""

    model_config = ConfigDict(extra="ignore")
    group: str
    name: str
    labels: Annotated[list[str], FailFast()]
    start: Count
    stop: Count
    unit: str
    scale: float = Field(strict=True)


class Description(Settings):
    """What a policy is, and the environment it knows."""

    format: int = Field(default=FORMAT, ge=1, le=FORMAT, strict=True, description="of the folder")
    title: str = Field(max_length=300)
    algorithm: str
    environment: str
    exo_env: str = Field(description="version it was trained with")
    env_kwargs: Annotated[dict[str, Any], AfterValidator(whole_repetitions)] = Field(
        description="of the training environment"
    )
    action_mode: str
    observation: Annotated[tuple[str, ...], FailFast()] = Field(
        description="groups, or channels as group.channel, in order"
    )
    structure: Annotated[tuple[Any, ...], Each(Part)] = Field(description="of the observation: names, units, scales")
    period: float = Field(gt=0.0, strict=True, description="control period [s]")
    drive: dict[str, Any] = Field(description="what actions command")
    architecture: Architecture
    steps: Count = Field(description="of training")
    seed: Count | None = None
    informed: bool = Field(default=False, strict=True, description="saw what reveals the patient's plan")
    weights_sha256: str = ""
    sha256: str = Field(default="", description="of all other keys")

    @property
    def common(self) -> str:
        """A digest of all but steps, seed and weights: the same for trainings that differ in nothing but the seed."""
        apart = {"format", "steps", "seed", "informed", "weights_sha256", "sha256", "title"}
        facts = self.model_dump(mode="json", exclude=apart) | {"format": 1}  # as it was in format 1
        return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()[:16]


def fingerprint(facts: Mapping[str, Any]) -> str:
    """SHA-256 of a description's keys and values but the hash itself, whatever their order and layout."""
    others = {key: value for key, value in facts.items() if key != "sha256"}
    return hashlib.sha256(json.dumps(others, sort_keys=True, allow_nan=False).encode()).hexdigest()


def world_facts(env: gymnasium.Env) -> dict[str, Any]:
    """What a description holds of an environment."""
    world: Any = env.unwrapped
    parts = [json.loads(json.dumps(finite(part.as_dict()))) for part in world.observation_structure]
    return {
        "action_mode": world.action_mode,
        "observation": tuple(map(str, world.settings.observation)),
        "structure": tuple(parts),
        "period": world.period,
        "drive": world.drive.model_dump(mode="json"),
        "informed": any(part.group in world.task.revealing for part in world.observation_structure),
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
        self.network, self._known = Network(description.architecture, arrays), False
        # A policy's own, where those of baselines are of the class.
        own: dict[str, Any] = {
            "name": name, "title": description.title, "action_mode": description.action_mode,
            "observation": description.observation, "training": description.common, "informed": description.informed,
        }  # fmt: skip
        self.__dict__.update(own)

    @classmethod
    def load(cls, folder: str | Path, name: str | None = None) -> LearnedPolicy:
        """A policy from its folder.

        Raises:
            InputError: a file is missing, cut off, changed, or of another environment or format.
        """
        folder = Path(folder)
        facts = read_json(folder / DESCRIPTION, MOST_DESCRIPTION)
        content = read_bytes(folder / WEIGHTS, MOST_WEIGHTS)
        description = _described(facts, folder)
        try:
            _check_registered(description.environment)
            _check_whole(description, facts, content)
            arrays = from_bytes(content, folder / WEIGHTS)
            found = cls(description, arrays, name or str(folder))
        except InputError as error:
            raise InputError(f"policy '{folder}': {error}") from None
        if description.format == 1:
            _warn_of_first_format(folder)
        return found

    def save(self, folder: Path) -> None:
        """Write the folder; the description comes last, so that a folder with one is whole."""
        content = to_bytes(self.arrays)
        write_bytes(folder / WEIGHTS, content)
        facts = finite(self.description.model_dump(mode="json"))
        facts |= {"format": FORMAT, "weights_sha256": hashlib.sha256(content).hexdigest()}
        facts |= {"sha256": fingerprint(facts)}
        write_text(folder / DESCRIPTION, json.dumps(facts, indent=2) + "\n")

    def reset(self, env: gymnasium.Env) -> None:
        """Forget the last patient; an environment that the policy does not know is refused."""
        self._check(env)
        self.network.reset()

    def begin(self, env: gymnasium.Env, n: int) -> None:
        """Begin episodes in many worlds at once, for `act`.

        Args:
            env: one of their kind; one that the policy does not know is refused.
            n: number of worlds.
        """
        self._check(env)
        self.network.reset(n)

    def act(self, observations: np.ndarray) -> np.ndarray:
        """The actions held best in many worlds, shape (n, actions), after one more observation of each, (n, k)."""
        return self.network(observations)

    def _check(self, env: gymnasium.Env) -> None:
        """Refuse an environment that shows or takes something else than that of the training."""
        facts, d = world_facts(env), self.description
        if not self._known:
            world: Any = env.unwrapped
            self.check_task(type(world.task))
        mine, theirs = ([[part[k] for k in COMPARED] for part in parts] for parts in (d.structure, facts["structure"]))
        for what, trained, here in (
            ("observation", mine, theirs),
            ("action mode", d.action_mode, facts["action_mode"]),
            ("control period", d.period, facts["period"]),
            ("drive", d.drive, facts["drive"]),
        ):
            if trained != here:
                difference = brief(f"{trained}, not {here}")
                raise InputError(f"policy '{self.name}' was trained with another {what}: {difference}.")
        if not self._known:
            self._say_where(env)
        self._known = True

    def check_task(self, task: type[Task]) -> None:
        """Refuse another task where either of them hides the plan: what such a policy learned is of no use there.

        Raises:
            InputError: names both tasks.
        """
        if (self._task.revealing or task.revealing) and not _variants(self._task, task):
            raise InputError(
                f"policy '{self.name}' was trained for the task {self._task.__name__}, and this is {task.__name__}: "
                "expected a policy that was trained for the same task."
            )

    def knows(self, environment: str) -> bool:
        """Whether it was trained for the task of an environment, by its id."""
        return _variants(self._task, task_type(environment))

    @property
    def _task(self) -> type[Task]:
        return _task_of(self.description)

    def _say_where(self, env: gymnasium.Env) -> None:
        """Say where an environment is another one that shows and takes the same: it may reward something else."""
        trained, here = environment_id(self.description.environment, say=False), getattr(env.spec, "id", None)
        if here not in (trained, None):
            warnings.warn(
                f"policy '{self.name}' was trained in {trained} and acts in {here}, which shows and takes the same.",
                ModelWarning,
                stacklevel=3,
            )

    def __call__(self, observation: np.ndarray, info: dict[str, Any]) -> np.ndarray:
        """The action held best.

        Raises:
            InputError: the policy was not reset, so that nobody knows whether the environment is the one it knows.
        """
        if not self._known:
            raise InputError(f"policy '{self.name}' acts without a begin: call reset(env) after the environment's own.")
        return self.network(observation)


def _described(facts: Any, folder: Path) -> Description:
    """What the contents of a policy's description say."""
    return checked(Description, facts, f"policy '{folder}': {DESCRIPTION}")


def _task_of(description: Description) -> type[Task]:
    """The task that a policy was trained for, in the newest version of its environment."""
    return task_type(environment_id(description.environment, say=False))


def _variants(one: type[Task], other: type[Task]) -> bool:
    """Whether two tasks are the same, or one a variant of the other, such as one with more windows."""
    return issubclass(one, other) or issubclass(other, one)


def _check_registered(environment: str) -> None:
    """What is observed and commanded is compared at each reset; here only whether the environment is known at all."""
    if ":" in environment:
        # A module that a file names would be imported, which is to run its code.
        raise InputError(f"environment = '{brief(environment, 60)}': expected an id without a module.")
    try:
        environment_id(environment)
    except InputError as error:
        raise InputError(f"it was trained in {brief(environment, 60)}: {brief(str(error))}") from None


def _check_whole(description: Description, facts: Mapping[str, Any], weights: bytes) -> None:
    """Refuses files that are not as they were written."""
    if (description.format > 1 or description.sha256) and description.sha256 != fingerprint(facts):
        raise InputError(
            f"{DESCRIPTION} was changed: its SHA-256 is not the one that it holds. Export the policy once more."
        )
    if hashlib.sha256(weights).hexdigest() != description.weights_sha256:
        raise InputError(f"{WEIGHTS} is cut off or was changed: its SHA-256 is not that of {DESCRIPTION}.")


def _warn_of_first_format(folder: Path) -> None:
    warnings.warn(
        f"policy '{folder}' is of format 1, which does not tell whether {DESCRIPTION} was changed by hand; if it was "
        f"not, renew it: {PROGRAM} export {folder} --out NEW_FOLDER",
        ModelWarning,
        stacklevel=3,
    )


def find_policy(name: str, environment: str | None = None) -> Policy:
    """A policy by what a user calls it.

    Args:
        name: a baseline or a shipped policy; the folder of a trained one, or of its training; or "module:Class" for a
            class of your own, see `Policy`.
        environment: id of the one that it is to act in; of shipped policies the one for it is taken, see `shipped_for`.

    Raises:
        InputError: there is none; says how a .zip of Stable-Baselines3 becomes one.
    """
    if name in POLICIES:
        return baseline(name)
    if name in shipped_policies():
        return LearnedPolicy.load(SHIPPED / shipped_for(name, environment), name)
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


def shipped_for(name: str, environment: str | None) -> str:
    """Folder of a shipped policy: where that of the name learned another task, one named NAME_... that learned this."""
    folders = [name, *(x for x in shipped_policies() if x.startswith(f"{name}_"))]
    if environment is None or len(folders) == 1:
        return name
    task = task_type(environment)
    for folder in folders:
        path = SHIPPED / folder
        # Weights tell nothing of the task, and a policy that is not taken need not be whole.
        description = _described(read_json(path / DESCRIPTION, MOST_DESCRIPTION), path)
        if _variants(_task_of(description), task):
            return folder
    return name


def shipped_policies() -> list[str]:
    """Names of the trained policies that come with this project."""
    return sorted(p.parent.name for p in SHIPPED.glob(f"*/{DESCRIPTION}"))
