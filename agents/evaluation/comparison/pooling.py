"""Trainings that differ in nothing but the seed, taken together."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .evaluate import able_ones, summary
from .gap import GAP, pooled_gap


def pooled(policies: Mapping[str, Any], seed: int) -> dict[str, Any]:
    """Trainings that differ in nothing but the seed, as one: its numbers are means over the trainings."""
    groups: dict[tuple[str, str | None], list[Any]] = {}
    for one in policies.values():
        name, seeded, number = one["title"].rpartition(", seed ")
        if seeded and number.strip():
            groups.setdefault((name, one.get("training")), []).append(one)
    together: dict[str, Any] = {}
    for (name, _), ones in groups.items():
        titles, parts = [one["title"] for one in ones], [one["episodes"] for one in ones]
        seeds = {title.rpartition(", seed ")[2].split()[0] for title in titles}
        alike = len({(len(part), *part[0]["measures"]) for part in parts}) == 1
        if len(parts) == len(seeds) > 1 and alike:
            episodes, title = [e for part in parts for e in part], f"{name}, {len(parts)} seeds"
            title += f" ({len(together) + 1})" if title in together else ""
            together[title] = {
                "title": title, "trainings": len(parts), "episodes": episodes, "of": titles,
                "summary": summary(episodes, seed, len(parts)),
                "summary_able": summary(
                    able_ones(episodes), seed, len(parts), episodes[0]["measures"]
                ),
            }  # fmt: skip
            for kind, kept in (("summary", list), ("summary_able", able_ones)):
                gap = pooled_gap(ones, policies, kind, kept, seed)
                together[title][kind] |= {GAP: gap} if gap else {}
    return together
