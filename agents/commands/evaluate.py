"""`python -m agents evaluate` and `policies`: how good policies are on a population, and which there are."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal

from tqdm import tqdm

from dms_core.command_line import FAILED_RUN, FolderOut
from dms_core.errors import DmsError, InputError, Stopped, counted
from dms_core.figures import require_matplotlib
from dms_core.files.output_file import write_json, write_text
from dms_core.files.outputs import Outputs, partial

from ..environment import ENVIRONMENT, environment_id
from ..evaluation.comparison.evaluate import Plan, each_episode_of, results_of
from ..evaluation.comparison.opponents import with_opponents
from ..evaluation.figures.figure import draw
from ..evaluation.results.tables import gap_lines, heading, left_out_lines, short_table, statistic, whole_table
from ..policies.baselines import FOLLOWING, POLICIES
from ..policies.learned import find_policy, shipped_policies
from ..policies.policy import Policy
from .options import EnvironmentId, PolicyNames, device_settings, different_policies, given_folders, repeated

EVALUATION = "evaluation.json"


def evaluate(
    policy_names: PolicyNames,
    out: FolderOut,
    population: str = "evaluation",
    patients: int = 20,
    seed: int = 0,
    loads: tuple[float, ...] = (),
    repetitions: int | None = None,
    environment: EnvironmentId = ENVIRONMENT,
    exoskeleton: str | None = None,
    workers: Literal["here", "ray"] = "here",
    address: str | None = None,
    overwrite: bool = False,
) -> int:
    """Run policies on the same patients: a table, evaluation.json, evaluation.md and, with matplotlib, evaluation.png.

    Where the patient's plan is hidden, the best classical policy with the same sensors and the oracle take part, too.

    Args:
        policy_names: one or more: names of the command `policies`, folders of trained ones, or module:Class.
        out: folder for the results; made where it is missing.
        population: of the patients, by name or YAML file.
        patients: how many; one episode each, or one a load.
        seed: of the patients and of the bootstrap.
        loads: that each patient lifts [kg]; one drawn for each patient where none is given.
        repetitions: of the movement in an episode; as the trained policies learned, 1 without one, where not given.
        environment: in which, by id; module:ID where another package registers it.
        exoskeleton: device by name or YAML file, or changes of the default one as JSON.
        workers: 'ray' shares the episodes out, with the same results to the last bit.
        address: of a Ray cluster; a local one is started where it is not given.
        overwrite: replace files in the folder that others wrote or changed.
    """
    if not policy_names:
        raise InputError("--policy: expected one or more names.")
    # First: it may be what registers the environment that a policy was trained in.
    environment_id(environment)
    used = with_opponents(different_policies(policy_names, environment), environment)
    settings = device_settings(exoskeleton) | repeated(used, repetitions)
    plan = Plan(population, patients, seed, loads, environment, settings)
    inputs = [population, exoskeleton, *given_folders(policy_names)]
    with Outputs("evaluate", folder=out, inputs=inputs, overwrite=overwrite) as outputs:
        results = _results(used, plan, outputs, out, workers, address)
        write_json(out / EVALUATION, results)
        write_text(out / "evaluation.md", "\n".join(whole_table(results)))
        _draw(out / "evaluation.png", results)
    notes = [*gap_lines(results), *left_out_lines(results)]
    print("\n".join([heading(results), statistic(results), *notes, "", short_table(results), ""]))
    print(f"written: {outputs.where(out)} (all measures: evaluation.md, all episodes: {EVALUATION})")
    return FAILED_RUN if outputs.failed else 0


def _results(
    used: Sequence[Policy], plan: Plan, outputs: Outputs, out: Path, workers: str, address: str | None
) -> dict[str, Any]:
    """Results of all policies, with a bar over their episodes; see `_episodes`."""
    with tqdm(total=len(used) * len(plan.cases), unit="episode", leave=False, disable=None) as bar:

        def progress(name: str) -> None:
            bar.set_description(name)
            bar.update()

        if workers == "ray":
            from ..distributed.shared_evaluation import shared_out

            return shared_out(used, plan, address=address, progress=progress)
        return results_of(used, _episodes(used, plan, progress, outputs, out), plan)


def _episodes(
    used: Sequence[Policy], plan: Plan, progress: Callable[[str], None], outputs: Outputs, out: Path
) -> list[list[dict[str, Any]]]:
    """Episodes of each policy.

    Raises:
        Stopped: by the user; what is done is written into the folder `out`.
    """
    done: list[list[dict[str, Any]]] = []
    try:
        for one in used:
            done.append([])
            for episode in each_episode_of(one, plan, plan.cases):
                done[-1].append(episode)
                progress(one.name)
    except KeyboardInterrupt:
        raise Stopped(_kept(used, done, plan, outputs, out)) from None
    return done


def _kept(used: Sequence[Policy], done: list[list[dict[str, Any]]], plan: Plan, outputs: Outputs, out: Path) -> str:
    """Write the policies that are done, or whole patients of the first one; says so in a sentence."""
    cases = len(plan.cases)
    whole = [episodes for episodes in done if len(episodes) == cases]
    if not whole:
        a_patient = max(len(plan.loads), 1)
        patients = len(done[0]) // a_patient
        if patients == 0:
            return "no patient was done; nothing was written."
        whole, plan = [done[0][: patients * a_patient]], dataclasses.replace(plan, patients=patients)
    part = partial(out / EVALUATION)
    write_json(part, results_of(used[: len(whole)], whole, plan))
    names = ", ".join(one.name for one in used[: len(whole)])
    verb = "is" if plan.patients == 1 else "are"
    return f"{counted(plan.patients, 'patient')} with {names} {verb} in '{outputs.where(part)}'."


def _draw(path: Path, results: dict[str, Any]) -> None:
    """The figure, where matplotlib is installed; numbers and tables do without."""
    try:
        require_matplotlib()
    except DmsError as error:
        print(f"{path.name} is left out: {error}")
    else:
        draw(path, results)


def policies() -> int:
    """List the policies that `evaluate` knows."""
    for name, kind in POLICIES.items():
        where = "" if name in FOLLOWING else "where the plan is hidden: "
        print(f"{name:20} {where}{kind.title}; action mode {kind.action_mode}, sees {', '.join(kind.observation)}")
    for name in shipped_policies():
        one = find_policy(name)
        print(f"{name:20} {one.title}; action mode {one.action_mode}, sees {', '.join(one.observation)}")
    return 0
