"""`python -m agents report`: tables and figures from what trainings and evaluations left behind."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import Positional, arg

from agents.evaluation import report_figures
from agents.evaluation.evaluate import able_ones, differences, summary
from agents.evaluation.report_figures import Group
from agents.evaluation.tables import whole_table
from agents.evaluation.time_course import Course, course
from agents.policies.baselines import POLICIES
from agents.policies.learned import find_policy, repetitions_of, shipped_policies
from agents.policies.policy import Policy
from agents.training.config import Config
from agents.training.run_folder import CONFIG, EVALUATIONS, RECORD, read_record
from dms_core.errors import InputError
from dms_core.output_file import check_writable, whole_file
from exo_env.patient.population import population, shipped_populations
from exo_env.rendering.panels import require_matplotlib

EVALUATION = "evaluation.json"


def report(
    runs: Positional[tuple[Path, ...]],
    out: Path,
    policy_names: Annotated[tuple[str, ...], arg(name="policies", metavar="A B")] = (),
    mild: str = "stroke_mild",
    severe: str = "stroke_severe",
    seed: int = 0,
) -> int:
    """Rebuild tables and figures: learning curves, tracking over help, patients over time, the worst patient.

    Args:
        runs: folders of trainings, and evaluation.json files or their folders.
        out: folder for report.md and its pictures; made where it is missing.
        policy_names: two to show over time; the best trained one and the best baseline where none are given.
        mild: population of the first patient over time.
        severe: population of the second.
        seed: of these patients.
    """
    require_matplotlib()
    trainings, evaluations = collected(runs)
    check_writable(out / "report.md")
    lines = ["# Report", ""]
    if trainings:
        lines += _trainings(out, trainings)
    for k, results in enumerate(evaluations):
        lines += _evaluation(out, results, "" if k == 0 else f"_{k + 1}")
    shown = _shown(policy_names, evaluations, trainings)
    if shown:
        settings = evaluations[0].get("settings", {}) if evaluations else {"repetitions": repetitions_of(shown)}
        lines += _patients(out, shown, {f"mild: {mild}": mild, f"severe: {severe}": severe}, seed, settings)
    if shown and evaluations:
        lines += _worst(out, shown, evaluations[0])
    with whole_file(out / "report.md") as file:
        file.write("\n".join(lines))
    print(f"written: {out}")
    return 0


def collected(paths: Sequence[Path]) -> tuple[dict[Path, list[dict[str, Any]]], list[dict[str, Any]]]:
    """Learning curves by folder, and evaluations; those of the same patients are one.

    Raises:
        InputError: a path is neither, or a file is not whole.
    """
    if not paths:
        raise InputError("folders of trainings or evaluation.json files are wanted.")
    trainings: dict[Path, list[dict[str, Any]]] = {}
    evaluations: dict[tuple[Any, ...], dict[str, Any]] = {}
    for path in paths:
        if (path / RECORD).is_file():
            trainings[path] = _json(path / EVALUATIONS) if (path / EVALUATIONS).is_file() else []
        elif path.is_file() or (path / EVALUATION).is_file():
            found = _json(path if path.is_file() else path / EVALUATION)
            if not isinstance(found, dict) or not {"population", "patients", "seed", "policies"} <= found.keys():
                raise InputError(f"'{path}' is not an evaluation.")
            settings = json.dumps(found.get("settings", {}), sort_keys=True)
            key = (*(found[k] for k in ("population", "patients", "seed")), settings, *found.get("loads", ()))
            known = evaluations.setdefault(key, {**found, "policies": {}})
            known["policies"] |= found["policies"]
        else:
            raise InputError(f"'{path}' is neither the folder of a training nor an evaluation.")
    for known in evaluations.values():
        known["policies"] |= pooled(known["policies"], known["seed"])
        first = next(iter(known["policies"].values()))["episodes"]
        for one in known["policies"].values():
            one["difference"] = differences(one["episodes"], first, known["seed"], one.get("trainings", 1))
    return trainings, list(evaluations.values())


def pooled(policies: Mapping[str, Any], seed: int) -> dict[str, Any]:
    """Trainings that differ in nothing but the seed, as one: its numbers are means over the trainings."""
    groups: dict[tuple[str, str | None], list[Any]] = {}
    for one in policies.values():
        name, seeded, _ = one["title"].rpartition(", seed ")
        if seeded:
            groups.setdefault((name, one.get("training")), []).append(one)
    found: dict[str, Any] = {}
    for (name, _), ones in groups.items():
        titles, parts = [one["title"] for one in ones], [one["episodes"] for one in ones]
        seeds = {title.rpartition(", seed ")[2].split()[0] for title in titles}
        if len(parts) == len(seeds) > 1 and len({len(part) for part in parts}) == 1:
            episodes, title = [e for part in parts for e in part], f"{name}, {len(parts)} seeds"
            title += f" ({len(found) + 1})" if title in found else ""
            found[title] = {
                "title": title, "trainings": len(parts), "episodes": episodes, "of": titles,
                "summary": summary(episodes, seed, len(parts)),
                "summary_able": summary(able_ones(episodes), seed, len(parts)),
            }  # fmt: skip
    return found


def _json(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"'{path}' cannot be read: {error}.") from None


def grouped(trainings: Mapping[Path, list[dict[str, Any]]]) -> list[Group]:
    """Trainings of one configuration together."""
    found: dict[str, list[Path]] = {}
    for path in trainings:
        content = Config.read(path / CONFIG).content()
        found.setdefault(json.dumps(content, sort_keys=True), []).append(path)
    names = [read_record(paths[0])["algorithm"] for paths in found.values()]
    groups = []
    for name, paths in zip(names, found.values(), strict=True):
        label = name if names.count(name) == 1 else f"{name}, {paths[0].name}"
        groups.append(Group(label, [trainings[p] for p in paths if trainings[p]]))
    return [g for g in groups if g.curves]


def _trainings(out: Path, trainings: Mapping[Path, list[dict[str, Any]]]) -> list[str]:
    """Figure and table of the learning curves."""
    groups = grouped(trainings)
    if groups:
        report_figures.learning_curves(out / "learning_curves.png", groups)
    lines = [
        "## Trainings",
        "",
        "| run | algorithm | seed | steps | time [s] | best return | tracking [deg] | device share |",
        f"|{'---|' * 8}",
    ]
    for path, curve in trainings.items():
        record = read_record(path)
        who = f"{path.name} | {record['algorithm']} | {record['seed']}"
        if not curve:
            lines.append(f"| {who} | no evaluation yet | | | | |")
            continue
        best, last = max(curve, key=lambda e: e["return"]), curve[-1]
        numbers = " | ".join(_number(best[k]) for k in ("return", "tracking_rms_deg", "device_work_share"))
        lines.append(f"| {who} | {last['steps']} | {last['seconds']:.0f} | {numbers} |")
    return [*lines, "", *(["![Learning curves](learning_curves.png)", ""] if groups else [])]


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"


def _evaluation(out: Path, results: dict[str, Any], suffix: str) -> list[str]:
    """Figure and table of an evaluation."""
    for found in results["policies"].values():
        for estimate in found["summary"].values():
            estimate.update({k: float("nan") for k, v in estimate.items() if v is None})
    report_figures.pareto(out / f"pareto{suffix}.png", results)
    return [*whole_table(results), f"![Tracking over the share of the device](pareto{suffix}.png)", ""]


def _shown(names: Sequence[str], evaluations: Sequence[dict[str, Any]], trainings: Mapping[Path, Any]) -> list[Policy]:
    """The two policies to show over time."""
    if names:
        if len(set(names)) != 2:
            raise InputError(f"--policies {' '.join(names)}: two different names are wanted.")
        return [find_policy(name) for name in names]
    found = evaluations[0]["policies"] if evaluations else {}
    ranked = sorted(found, key=lambda n: found[n]["summary"]["return"]["value"], reverse=True)
    learned = [n for n in ranked if n not in POLICIES] + [str(path) for path, curve in trainings.items() if curve]
    baselines = [n for n in ranked if n in POLICIES] + ["pid", "none"]
    shown: list[Policy] = []
    for name in dict.fromkeys([*learned[:1], *baselines]):
        # The folder of a policy that was evaluated may be gone.
        if name in POLICIES or name in shipped_policies() or Path(name).is_dir():
            shown.append(find_policy(name))
    return shown[:2]


def _patients(
    out: Path, shown: Sequence[Policy], whom: Mapping[str, str], seed: int, settings: Mapping[str, Any]
) -> list[str]:
    """Figure of patients over time."""
    columns = {title: [course(p, source, seed, **settings) for p in shown] for title, source in whom.items()}
    report_figures.courses(out / "patients.png", columns)
    return ["## Patients over time", "", "![Two patients under two policies](patients.png)", ""]


def _worst(out: Path, shown: Sequence[Policy], results: Mapping[str, Any]) -> list[str]:
    """Figure of the patient with whom the first policy that was evaluated did worst."""
    judged = next((p for p in shown if p.name in results["policies"]), None)
    if judged is None:
        return []
    episodes = results["policies"][judged.name]["episodes"]
    worst = max(episodes, key=lambda e: (e["measures"]["unsafe"], e["measures"]["tracking_rms_deg"]))
    why = "ended early" if worst["measures"]["unsafe"] else "largest error"
    columns = {f"{why} of {len(episodes)} episodes with {judged.title}": [_again(p, worst, results) for p in shown]}
    report_figures.courses(out / "worst_patient.png", columns)
    m = worst["measures"]
    said = worst["event"] or f"tracking {m['tracking_rms_deg']:.3g} deg rms, {m['tracking_peak_deg']:.3g} deg at most"
    return [f"## Worst patient of {judged.title}", "", said, "", "![The worst patient](worst_patient.png)", ""]


def _again(policy: Policy, one: Mapping[str, Any], results: Mapping[str, Any]) -> Course:
    """An episode of an evaluation once more: to the last bit where its population is a shipped one."""
    settings = results.get("settings", {})
    for name in shipped_populations():
        if population(name).title == results["population"]:
            load = {"load": one["load"]} if results.get("loads") else None
            return course(policy, name, one["seed"], load, **settings)
    return course(policy, one["patient"], one["seed"], {k: one[k] for k in ("load", "reference")}, **settings)
