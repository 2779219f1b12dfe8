"""`python -m agents evaluate` and `policies`: how good policies are on a population, and which there are."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from tqdm import tqdm
from tyro.conf import arg

from dms_core.errors import DmsError, InputError
from dms_core.json_text import finite
from dms_core.output_file import check_writable, whole_file, write_json
from exo_env.rendering.panels import require_matplotlib

from ..environment import ENVIRONMENT, environment_id
from ..evaluation.evaluate import Plan, episodes_of, results_of
from ..evaluation.figure import draw
from ..evaluation.tables import heading, left_out_lines, short_table, statistic, whole_table
from ..policies.baselines import POLICIES
from ..policies.learned import find_policy, shipped_policies
from .options import device_settings, repeated


def evaluate(
    policy_names: Annotated[tuple[str, ...], arg(name="policy", metavar="NAME [NAME ...]")],
    out: Path,
    population: str = "evaluation",
    patients: int = 20,
    seed: int = 0,
    loads: tuple[float, ...] = (),
    repetitions: int | None = None,
    environment: Annotated[str, arg(name="env", metavar="ID")] = ENVIRONMENT,
    exoskeleton: str | None = None,
    workers: Literal["here", "ray"] = "here",
    address: str | None = None,
) -> int:
    """Run policies on the same patients: a table, evaluation.json, evaluation.md and, with matplotlib, evaluation.png.

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
    """
    if len(set(policy_names)) < max(len(policy_names), 1):
        raise InputError(f"--policy {' '.join(policy_names)}: expected one or more different names.")
    # First: it may be what registers the environment that a policy was trained in.
    environment_id(environment)
    used = [find_policy(name) for name in policy_names]
    settings = device_settings(exoskeleton) | repeated(used, repetitions)
    plan = Plan(population, patients, seed, loads, environment, settings)
    check_writable(out / "evaluation.json")
    with tqdm(total=len(used) * len(plan.cases), unit="episode", leave=False, disable=None) as bar:

        def progress(name: str) -> None:
            bar.set_description(name)
            bar.update()

        if workers == "ray":
            from ..distributed.shared_evaluation import shared_out

            results = shared_out(used, plan, address=address, progress=progress)
        else:
            results = results_of(used, [episodes_of(one, plan, plan.cases, progress) for one in used], plan)
    write_json(out / "evaluation.json", finite(results))
    _draw(out / "evaluation.png", results)
    with whole_file(out / "evaluation.md") as file:
        file.write("\n".join(whole_table(results)))
    print("\n".join([heading(results), statistic(results), *left_out_lines(results), "", short_table(results), ""]))
    print(f"written: {out} (all measures: evaluation.md, all episodes: evaluation.json)")
    return 0


def _draw(path: Path, results: dict[str, Any]) -> None:
    """The figure, where matplotlib is installed; numbers and tables do without."""
    try:
        require_matplotlib()
    except DmsError as error:
        # One of an earlier run would be of other episodes.
        path.unlink(missing_ok=True)
        print(f"{path.name} is left out: {error}")
    else:
        draw(path, results)


def policies() -> int:
    """List the policies that `evaluate` knows."""
    for name, kind in POLICIES.items():
        print(f"{name:18} {kind.title}; action mode {kind.action_mode}, sees {', '.join(kind.observation)}")
    for name in shipped_policies():
        one = find_policy(name)
        print(f"{name:18} {one.title}; action mode {one.action_mode}, sees {', '.join(one.observation)}")
    return 0
