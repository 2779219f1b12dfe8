"""The command `soak`: a long run of random actions in any environment."""

from __future__ import annotations

from typing import Annotated

from tqdm import tqdm
from tyro.conf import arg

from dms_core.command_line import FAILED_RUN
from dms_core.errors import InputError, Stopped
from exo_env.ecosystem.exoskeleton import DEFAULT
from exo_env.envs.soak import soak as long_run


def soak(
    steps: int = 100_000,
    env: Annotated[str, arg(metavar="ID")] = "exo/ElbowLift-v2",
    population: str = "evaluation",
    exoskeleton: Annotated[str, arg(metavar="NAME|FILE.yaml")] = DEFAULT,
    seed: int = 0,
    action_mode: str | None = None,
) -> int:
    """Random actions in an environment, a new patient an episode: counts of what happened and the worst figures.

    Args:
        steps: control periods in all.
        env: environment, by the id under which it is registered; "module:id" imports the module first.
        population: population of the patients, by name or YAML file.
        exoskeleton: device, by name or YAML file; configs/exoskeletons/elbow.yaml shows every key.
        seed: seed of patients and actions.
        action_mode: drive, by name, such as 'rope_tension' or 'pid_setpoint'; without it, that of the environment.
    """
    if steps < 1:
        raise InputError(f"--steps {steps}: expected a whole number from 1.")
    if seed < 0:
        raise InputError(f"--seed {seed}: expected a whole number from 0.")
    drive = {} if action_mode is None else {"action_mode": action_mode}
    with tqdm(total=steps, unit="step", leave=False, disable=None) as bar:

        def progress(done: int) -> None:
            bar.update(done - bar.n)

        result = long_run(
            steps, env=env, seed=seed, patient=population, exoskeleton=exoskeleton, progress=progress, **drive
        )
    for name, value in result.items():
        if name != "failures":
            print(f"{name:24} {value:.4g}" if isinstance(value, float) else f"{name:24} {value}")
    for sentence in result["failures"]:
        print(f"  {sentence}")
    if result["steps"] < steps:
        raise Stopped(f"the counts above are of {result['steps']} of {steps} steps.")
    return FAILED_RUN if result["not_finite_or_outside"] else 0
