"""Tables of an evaluation: a short one to print, and all measures to keep.

What is estimated is the interquartile mean over the patients; of differences and of unsafe episodes it is the mean.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from agents.evaluation.evaluate import COMPARED, able_ones, differences
from agents.evaluation.measures import MEASURES
from agents.evaluation.statistics import Estimate
from agents.policies.baselines import POLICIES

OF_THE_ABLE = ("return", "tracking_rms_deg", "device_work_share", "patient_work_share", "peak_reaction_N")
"""Measures that are printed of them."""
LEAST = 1e-6
"""Of what is printed, in the unit of any measure."""


def statistic(results: Mapping[str, Any]) -> str:
    """What the cells of a table are."""
    percent = 100.0 * results["confidence"]
    return f"{results['statistic']} (means of differences and of unsafe episodes) [{percent:g} % bootstrap interval]"


def heading(results: Mapping[str, Any]) -> str:
    """Whom a table is about."""
    often, loads = results.get("settings", {}).get("repetitions", 1), results.get("loads", ())
    count = results["patients"]
    said = f"{count} patient{'s' * (count > 1)} of '{results['population']}', seed {results['seed']}"
    said += f", loads {' '.join(f'{x:g}' for x in loads)} kg" if loads else ""
    return said + (f", {often} repetitions" if often > 1 else "")


def short_table(results: Mapping[str, Any]) -> str:
    """A row a policy: return, its difference to the first policy, tracking, device's share, unsafe episodes."""
    names, policies = _short_names(results["policies"]), list(results["policies"].values())
    rows = [["", "return", f"difference to {names[0]}", "tracking, rms [deg]", "device's share of work", "unsafe"]]
    for name, p in zip(names, policies, strict=True):
        shown = (p["summary"][k] for k in ("return", "tracking_rms_deg", "device_work_share"))
        returned, tracking, share = (_cell(Estimate(**one)) for one in shown)
        compared = "" if name == names[0] else _cell(Estimate(**p["difference"]["return"]))
        # A percentage would round a single one away.
        unsafe = f"{sum(e['measures']['unsafe'] for e in p['episodes']):.0f} of {len(p['episodes'])}"
        rows.append([name, returned, compared, tracking, share, unsafe])
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
    found = list(names)
    short = [Path(name).name for name in found]
    return short if len(set(short)) == len(found) else found


def whole_table(results: Mapping[str, Any]) -> list[str]:
    """Lines of Markdown: heading, a row a measure, a column a policy; then some of who can do something.

    That second part is left out where everybody can, and differences where there is one policy.
    """
    head, *rows = table_rows(results)
    return [
        f"## {heading(results)}", "", f"{statistic(results).capitalize()}.", "",
        f"| {' | '.join(head)} |", f"|{'---|' * len(head)}", *(f"| {' | '.join(row)} |" for row in rows), "",
    ]  # fmt: skip


def _rows(policies: Mapping[str, Any], summary: str, measures: Sequence[str]) -> list[list[str]]:
    """A row a measure."""
    found = []
    for m in MEASURES:
        if m.name in measures:
            label = m.label if m.unit == "-" else f"{m.label} [{m.unit}]"
            found.append([label, *(_cell(Estimate(**p[summary][m.name])) for p in policies.values())])
    return found


def table_rows(results: Mapping[str, Any]) -> list[list[str]]:
    """Cells of the table, the first row its head."""
    policies, seed = results["policies"], results["seed"]
    names = list(policies)
    everybody = policies[names[0]]["episodes"]
    able = able_ones(everybody)
    count, apart = len({e["seed"] for e in able}), len(able) < len(everybody)
    rows = [["", *names], *_rows(policies, "summary", [m.name for m in MEASURES])]
    if apart:
        rows += [[f"of the {count} with ability from {results['able']:g}", *("" for _ in names)]]
        rows += _rows(policies, "summary_able", OF_THE_ABLE)
    for other in dict.fromkeys([names[0], best_baseline(policies) or names[0]] if len(names) > 1 else []):
        those, said = policies[other]["episodes"], f"mean difference to {other}, patient by patient"
        for head, kept in ((said, list), (f"{said}, of these {count}", able_ones))[: 2 if apart else 1]:
            found = {
                n: {"d": differences(kept(p["episodes"]), kept(those), seed, p.get("trainings", 1))}
                for n, p in policies.items()
            }
            rows += [[head, *("" for _ in names)], *_rows(found, "d", COMPARED)]
    return rows


def best_baseline(policies: Mapping[str, Any]) -> str | None:
    """Name of the classical policy with the best return."""
    known = [name for name in policies if name in POLICIES]
    return max(known, key=lambda name: policies[name]["summary"]["return"]["value"], default=None)


def _cell(e: Estimate) -> str:
    """Value and interval; what is below `LEAST` is round-off, and 0."""
    value, low, high = (0.0 if abs(x) < LEAST else x for x in (e.value, e.low, e.high))
    return f"{_digits(value)} [{_digits(low)}, {_digits(high)}]"


def _digits(x: float) -> str:
    """Three digits, and all before the point."""
    return f"{x:.0f}" if abs(x) >= 999.5 else f"{x:.3g}"
