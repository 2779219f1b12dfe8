"""Tables of an evaluation: a short one to print, and all measures to keep.

What is estimated is the interquartile mean over the patients; of differences and of unsafe episodes it is the mean.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from dms_core.errors import counted, printable
from dms_core.files.output_file import markdown_cell

from ...environment import ENVIRONMENT
from ...policies.baselines import POLICIES
from ..comparison.evaluate import COMPARED, able_ones, differences
from ..comparison.gap import GAP
from ..comparison.statistics import Estimate
from ..episodes.measures import MEASURES, REPETITIONS, measures_among

OF_THE_ABLE = ("return", "tracking_rms_deg", "device_work_share", "patient_work_share", "peak_reaction_N")
"""Measures that are printed of them."""
SHORT = {
    "tracking_rms_deg": "tracking, rms [deg]", "device_work_share": "device's share of work",
    "opposing_power_W": "power against patient [W]",
}  # fmt: skip
"""Measures of the short table beside the return, and their heads."""
LEAST = 1e-6
"""Least number that is printed as one, in the unit of any measure; what is below is 0."""


def records_text(records: Sequence[Mapping[str, Any]], command: str) -> str:
    """Records of the same keys as CSV, below a line with the command that made them."""
    text = io.StringIO()
    text.write(f"# {printable(command)}\n")
    writer = csv.DictWriter(text, list(records[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(records)
    return text.getvalue()


def statistic(results: Mapping[str, Any]) -> str:
    """What the cells of a table are."""
    percent = 100.0 * results["confidence"]
    means = "differences, of the gap closed" if _with_gap(results["policies"]) else "differences"
    return f"{results['statistic']} (means of {means} and of unsafe episodes) [{percent:g} % bootstrap interval]"


def gap_lines(results: Mapping[str, Any]) -> list[str]:
    """Lines on what the gap is that policies close, and on why some have none; none where no plan is hidden."""
    known = {name: gap for name, p in results["policies"].items() if (gap := p["summary"].get(GAP))}
    if not known:
        return []
    between, reasons = dict[tuple[str, str], list[str]](), dict[str, list[str]]()
    for name, gap in known.items():
        between.setdefault((gap["opponent"], gap["oracle"]), []).append(name)
        if gap["reason"]:
            reasons.setdefault(gap["reason"], []).append(name)
    said = "; ".join(f"from {a} to {b} for {', '.join(names)}" for (a, b), names in between.items())
    told = ", ".join(name for name, p in results["policies"].items() if p.get("informed"))
    return [
        f"Gap closed: {said}. Opponent and oracle were chosen on training patients. Told the plan: {told or 'nobody'}.",
        *(f"No gap for {', '.join(names)}: {reason}." for reason, names in reasons.items()),
    ]


def heading(results: Mapping[str, Any]) -> str:
    """Whom a table is about."""
    often, loads = results.get("settings", {}).get("repetitions", 1), results.get("loads", ())
    whom = f"{counted(results['patients'], 'patient')} of '{results['population']}', seed {results['seed']}"
    whom += f", loads {' '.join(f'{x:g}' for x in loads)} kg" if loads else ""
    whom += f", {often} repetitions" if often > 1 else ""
    return whom + (f", in {where}" if (where := results.get("environment", ENVIRONMENT)) != ENVIRONMENT else "")


def short_table(results: Mapping[str, Any]) -> str:
    """A row a policy: return, its difference to the first policy, gap closed, tracking, help, unsafe episodes."""
    names, policies = _short_names(results["policies"]), list(results["policies"].values())
    shown = {k: label for k, label in SHORT.items() if all(k in p["summary"] for p in policies)}
    gap = ["gap closed"] * _with_gap(results["policies"])
    rows = [["", "return", f"difference to {names[0]}", *gap, *shown.values(), "unsafe"]]
    for name, p in zip(names, policies, strict=True):
        returned, *others = (cell(Estimate(**p["summary"][k])) for k in ("return", *shown))
        compared = "" if name == names[0] else cell(Estimate(**p["difference"]["return"]))
        # A percentage would round a single one away.
        unsafe = f"{sum(e['measures']['unsafe'] for e in p['episodes']):.0f} of {len(p['episodes'])}"
        closed = [gap_cell(p["summary"])] if gap else []
        rows.append([name, returned, compared, *closed, *others, unsafe])
    if len(policies) == 1:
        rows = [[*row[:2], *row[3:]] for row in rows]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(
            cell.ljust(w) if k == 0 else cell.rjust(w) for k, (cell, w) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    )


def _short_names(names: Iterable[str]) -> list[str]:
    """Policies by name, trained ones by the last part of their folder where these differ."""
    whole = list(names)
    short = [Path(name).name for name in whole]
    return short if len(set(short)) == len(whole) else whole


def left_out_lines(results: Mapping[str, Any]) -> list[str]:
    """A line on the measures that the environment does not allow; none where it allows all."""
    left = results.get("left_out", {})
    if not left:
        return []
    labels = {m.name: m.label for m in MEASURES}
    lacking = list(dict.fromkeys(what for needs in left.values() for what in needs))
    readings = ", ".join(name for name in lacking if name != REPETITIONS)
    missing = [f"no reading {readings}"] * bool(readings) + ["no repetitions of a lift"] * (REPETITIONS in lacking)
    return [
        f"Left out: {', '.join(labels.get(name, name) for name in left)}; "
        f"{results['environment']} has {' and '.join(missing)}."
    ]


def whole_table(results: Mapping[str, Any]) -> list[str]:
    """Lines of Markdown: heading, a row a measure, a column a policy; then some of who can do something.

    That second part is left out where everybody can, and differences where there is one policy.
    """
    head, *rows = ([markdown_cell(cell) for cell in row] for row in table_rows(results))
    return [
        f"## {printable(heading(results))}", "", f"{statistic(results).capitalize()}.",
        *map(printable, [*gap_lines(results), *left_out_lines(results)]), "",
        f"| {' | '.join(head)} |", f"|{'---|' * len(head)}", *(f"| {' | '.join(row)} |" for row in rows), "",
    ]  # fmt: skip


def _rows(policies: Mapping[str, Any], summary: str, measures: Sequence[str]) -> list[list[str]]:
    """A row a measure."""
    rows = []
    for m in measures_among(measures):
        if all(m.name in p[summary] for p in policies.values()):
            label = m.label if m.unit == "-" else f"{m.label} [{m.unit}]"
            rows.append([label, *(cell(Estimate(**p[summary][m.name])) for p in policies.values())])
        if m.name == "return" and summary != "d" and _with_gap(policies):
            rows.append(["gap closed", *(gap_cell(p[summary]) for p in policies.values())])
    return rows


def _with_gap(policies: Mapping[str, Any]) -> bool:
    """Whether the gap closed is known of any policy."""
    return any(GAP in p["summary"] for p in policies.values())


def gap_cell(summary: Mapping[str, Any]) -> str:
    """The gap closed, or a dash where there is none."""
    gap = summary.get(GAP)
    if gap is None or gap["reason"]:
        return "-"
    return cell(Estimate(gap["value"], gap["low"], gap["high"], gap["count"]))


def table_rows(results: Mapping[str, Any]) -> list[list[str]]:
    """Cells of the table, the first row its head."""
    policies, seed = results["policies"], results["seed"]
    names = list(policies)
    everybody = policies[names[0]]["episodes"]
    able = able_ones(everybody)
    count, apart = len({e["seed"] for e in able}), len(able) < len(everybody)
    rows = [["", *names], *_rows(policies, "summary", list(policies[names[0]]["summary"]))]
    if apart:
        rows += [[f"of the {count} with ability from {results['able']:g}", *("" for _ in names)]]
        rows += _rows(policies, "summary_able", OF_THE_ABLE)
    for other in dict.fromkeys([names[0], *_opponents(policies)] if len(names) > 1 else []):
        those, what = policies[other]["episodes"], f"mean difference to {other}, patient by patient"
        for head, kept in ((what, list), (f"{what}, of these {count}", able_ones))[: 2 if apart else 1]:
            between = {
                n: {"d": differences(kept(p["episodes"]), kept(those), seed, p.get("trainings", 1))}
                for n, p in policies.items()
            }
            rows += [[head, *("" for _ in names)], *_rows(between, "d", COMPARED)]
    return rows


def _opponents(policies: Mapping[str, Any]) -> list[str]:
    """Names of those that gaps are measured from; where there are none, of the best classical policy."""
    named = {gap["opponent"] for p in policies.values() if (gap := p["summary"].get(GAP))}
    best = best_baseline(policies)
    return [name for name in policies if name in named] or ([best] if best else [])


def best_baseline(policies: Mapping[str, Any]) -> str | None:
    """Name of the classical policy with the best return; one that is told the plan is none."""
    known = [name for name in policies if name in POLICIES and not POLICIES[name].informed]
    return max(known, key=lambda name: policies[name]["summary"]["return"]["value"], default=None)


def cell(e: Estimate) -> str:
    """Value and interval; what is below `LEAST` is round-off, and 0."""
    value, low, high = (0.0 if abs(x) < LEAST else x for x in (e.value, e.low, e.high))
    return f"{_digits(value)} [{_digits(low)}, {_digits(high)}]"


def _digits(x: float) -> str:
    """Three digits, and all before the point."""
    return f"{x:.0f}" if abs(x) >= 999.5 else f"{x:.3g}"
