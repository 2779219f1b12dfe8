"""`python -m agents report`: tables and figures from what trainings and evaluations left behind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import Positional, arg

from dms_core.command_line import FAILED_RUN, FolderOut
from dms_core.errors import InputError, counted, printable
from dms_core.figures import require_matplotlib
from dms_core.files.json_text import brief
from dms_core.files.output_file import markdown_cell, write_text
from dms_core.files.outputs import Outputs
from exo_env.patient.population import population, shipped_populations

from ...environment import ENVIRONMENT, check_settings, environment_id
from ...evaluation.episodes.time_course import TimeCourse, time_course
from ...evaluation.figures import report_figures
from ...evaluation.figures.patients_figure import time_courses
from ...evaluation.results.tables import whole_table
from ...policies.baselines import POLICIES
from ...policies.learned import find_policy, shipped_policies
from ...policies.policy import Policy
from ...training.files.run_folder import read_record
from ..options import device_settings, different_policies, repeated
from .report_input import collected, grouped


def report(
    runs: Positional[tuple[Path, ...]],
    out: FolderOut,
    policy_names: Annotated[tuple[str, ...], arg(name="policies", metavar="A B")] = (),
    mild: str = "stroke_mild",
    severe: str = "stroke_severe",
    seed: int = 0,
    environment: Annotated[str | None, arg(name="env", metavar="ID")] = None,
    exoskeleton: str | None = None,
    overwrite: bool = False,
) -> int:
    """Rebuild tables and figures: learning curves, tracking over help, patients over time, the worst patient.

    Args:
        runs: folders of trainings, and evaluation.json files or their folders.
        out: folder for report.md and its pictures; made where it is missing.
        policy_names: two to show over time; the best trained one and the best baseline where none are given.
        mild: population of the first patient over time.
        severe: population of the second.
        seed: of these patients.
        environment: of the patients over time, by id; that of the evaluations or trainings where it is not given.
        exoskeleton: of the patients over time: device by name or YAML file, or changes of the default one as JSON.
        overwrite: replace files in the folder that others wrote or changed.
    """
    require_matplotlib()
    used = None if environment is None else environment_id(environment)
    trainings, evaluations = collected(runs)
    inputs = [mild, severe, exoskeleton, *runs, *policy_names]
    with Outputs("report", folder=out, inputs=inputs, overwrite=overwrite) as outputs:
        lines = ["# Report", ""]
        if trainings:
            lines += _trainings(out, trainings)
        for k, results in enumerate(evaluations):
            lines += _evaluation(out, results, "" if k == 0 else f"_{k + 1}")
        place = used or _place(trainings, evaluations)
        shown = _shown(policy_names, evaluations, trainings, place)
        if shown:
            settings = evaluations[0].get("settings", {}) if evaluations else repeated(shown, None)
            settings = {**settings, **device_settings(exoskeleton), "environment": place}
            lines += _patients(out, shown, {f"mild: {mild}": mild, f"severe: {severe}": severe}, seed, settings)
        if shown and evaluations:
            lines += _worst(out, shown, evaluations[0])
        write_text(out / "report.md", "\n".join(lines))
    print(f"written: {outputs.where(out)}")
    return FAILED_RUN if outputs.failed else 0


def _place(trainings: Mapping[Path, Any], evaluations: Sequence[Mapping[str, Any]]) -> str:
    """Id of the environment that a report is about."""
    named = [e["environment"] for e in evaluations] + [read_record(path)["environment"] for path in trainings]
    return environment_id(named[0]) if named else ENVIRONMENT


CURVE = {"return": "best return", "tracking_rms_deg": "tracking [deg]", "device_work_share": "device share"}
"""Measures of a training in its table, with their heads."""


def _trainings(out: Path, trainings: Mapping[Path, list[dict[str, Any]]]) -> list[str]:
    """Figure and table of the learning curves."""
    groups = grouped(trainings)
    if groups:
        report_figures.learning_curves(out / "learning_curves.png", groups)
    lines = [
        "## Trainings",
        "",
        f"| run | algorithm | seed | steps | time [s] | {' | '.join(CURVE.values())} |",
        f"|{'---|' * (5 + len(CURVE))}",
    ]
    for path, curve in trainings.items():
        record = read_record(path)
        who = " | ".join(markdown_cell(str(x)) for x in (path.name, record["algorithm"], record["seed"]))
        if not curve:
            lines.append(f"| {who} | no evaluation yet | | | | |")
            continue
        best, last = max(curve, key=lambda e: e["return"]), curve[-1]
        numbers = " | ".join(_number(best.get(name)) for name in CURVE)
        lines.append(f"| {who} | {last['steps']} | {last['seconds']:.0f} | {numbers} |")
    return [*lines, "", *(["![Learning curves](learning_curves.png)", ""] if groups else [])]


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"


def _evaluation(out: Path, results: dict[str, Any], suffix: str) -> list[str]:
    """Figure and table of an evaluation."""
    if not all(name in p["summary"] for p in results["policies"].values() for name in report_figures.PARETO):
        return whole_table(results)
    report_figures.pareto(out / f"pareto{suffix}.png", results)
    return [*whole_table(results), f"![Tracking over the share of the device](pareto{suffix}.png)", ""]


def _shown(
    names: Sequence[str], evaluations: Sequence[dict[str, Any]], trainings: Mapping[Path, Any], place: str
) -> list[Policy]:
    """The two policies to show over time in the environment `place`."""
    if names:
        if len(names) != 2:
            raise InputError(f"--policies {' '.join(names)}: expected two different names.")
        return different_policies(names, place)
    evaluated = evaluations[0]["policies"] if evaluations else {}
    ranked = sorted(evaluated, key=lambda n: evaluated[n]["summary"]["return"]["value"], reverse=True)
    learned = [n for n in ranked if n not in POLICIES] + [str(path) for path, curve in trainings.items() if curve]
    baselines = [n for n in ranked if n in POLICIES and not POLICIES[n].informed] + ["pid", "none"]
    shown: list[Policy] = []
    for name in dict.fromkeys([*learned[:1], *baselines]):
        # The folder of a policy that was evaluated may be gone.
        if name in POLICIES or name in shipped_policies() or Path(name).is_dir():
            shown.append(find_policy(name, place))
    return [policy for policy in shown if _fits(policy, place)][:2]


def _fits(policy: Policy, place: str) -> bool:
    """Whether an environment has a policy's actions and observations."""
    try:
        check_settings(place, {"action_mode": policy.action_mode, "observation": list(policy.observation)})
    except InputError:
        return False
    return True


def _patients(
    out: Path, shown: Sequence[Policy], whom: Mapping[str, str], seed: int, settings: Mapping[str, Any]
) -> list[str]:
    """Figure of patients over time."""
    columns = {title: [time_course(p, source, seed, **settings) for p in shown] for title, source in whom.items()}
    time_courses(out / "patients.png", columns)
    return ["## Patients over time", "", "![Two patients under two policies](patients.png)", ""]


def _worst(out: Path, shown: Sequence[Policy], results: Mapping[str, Any]) -> list[str]:
    """Figure of the patient with whom the first policy that was evaluated did worst."""
    judged = next((p for p in shown if p.name in results["policies"]), None)
    if judged is None:
        return []
    episodes = results["policies"][judged.name]["episodes"]
    worst = max(episodes, key=_badness)
    m = worst["measures"]
    why = "ended early" if m["unsafe"] else "largest error" if m.get("tracking_rms_deg") is not None else "least return"
    title = f"{why} of {counted(len(episodes), 'episode')} with {judged.title}"
    columns = {title: [_again(p, worst, results) for p in shown]}
    time_courses(out / "worst_patient.png", columns)
    sentence = worst["event"] or f"return {m['return']:.4g}"
    if not worst["event"] and m.get("tracking_rms_deg") is not None:
        sentence = f"tracking {m['tracking_rms_deg']:.3g} deg rms, {m['tracking_peak_deg']:.3g} deg at most"
    return [
        f"## Worst patient of {printable(judged.title)}",
        "",
        sentence,
        "",
        "![The worst patient](worst_patient.png)",
        "",
    ]


def _badness(one: Mapping[str, Any]) -> tuple[float, float]:
    """What the worst episode has most of: an early end, then error, or lack of return where there is no reference."""
    m = one["measures"]
    error = m.get("tracking_rms_deg")
    return m["unsafe"], -m["return"] if error is None else error


def _again(policy: Policy, one: Mapping[str, Any], results: Mapping[str, Any]) -> TimeCourse:
    """An episode of an evaluation once more: to the last bit where its population is a shipped one.

    Another version of the environment draws other patients; then, and where the population is not known, patient, load
    and movement are those that were kept of the episode.
    """
    environment = environment_id(results.get("environment", ENVIRONMENT))
    settings = {**results.get("settings", {}), "environment": environment}
    known = [name for name in shipped_populations() if population(name).title == results["population"]]
    if known and results.get("environment", ENVIRONMENT) == environment:
        load = {"load": one["load"]} if results.get("loads") else None
        return time_course(policy, known[0], one["seed"], load, **settings)
    if "patient" not in one:
        raise InputError(
            f"the evaluation of '{results['population']}' holds no patients, whose episodes could be shown again."
        )
    kept = {k: one[k] for k in ("load", "reference") if k in one}
    try:
        return time_course(policy, one["patient"], one["seed"], kept, **settings)
    except InputError as error:
        said = brief(str(error))
        raise InputError(f"the evaluation of '{results['population']}', seed {one['seed']}: {said}") from None
