"""Time the other programs, one after the other, and collect their rows.

    make bench-peers
    python tests/benchmarks/peers/run.py [--quick] [--opensim-model arm26.osim] [--ship]

The programs live in virtual environments of their own (requirements-*.txt); each script runs with one thread in a
scratch folder, so that logs are not left behind. bench.py and env_speed.py print ratios to the file written here. With
--ship the rows go into peers.csv, too, in place of those of the same program and kind of system.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[3]))

from tests.benchmarks.calibration import lump
from tests.benchmarks.peer_table import SHIPPED, write_shipped

HERE = Path(__file__).parent
SCRIPTS = {
    "myosuite_env.py": "myo", "mujoco_chain.py": "myo", "exudyn_chain.py": "exu", "exudyn_elbow.py": "exu",
    "exudyn_flexible.py": "exu",
}  # fmt: skip
"""And the environments that they run in."""
QUICK = {
    "myosuite_env.py": ["--steps", "300"], "exudyn_elbow.py": ["--steps", "0.002", "0.001"],
    "exudyn_flexible.py": ["--elements", "8"],
}  # fmt: skip
ONE_THREAD = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL")}


def rows_of(script: str, python: Path, extra: list[str]) -> list[dict[str, Any]]:
    """What a script measures."""
    with tempfile.TemporaryDirectory() as scratch:
        rows = Path(scratch) / "rows.json"
        # The bytecode of foreign versions has no place in the tree.
        environment = os.environ | ONE_THREAD | {"PYTHONDONTWRITEBYTECODE": "1"}
        command = [str(python), str(HERE / script), "--json", str(rows), *extra]
        subprocess.run(command, check=True, cwd=scratch, env=environment)
        return json.loads(rows.read_text(encoding="utf-8"))


def machine() -> dict[str, Any]:
    """Where and how the rows were taken."""
    model = next(
        (line.partition(":")[2].strip() for line in _cpuinfo().splitlines() if line.startswith("model name")), "unknown"
    )
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    return {
        "taken": datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"), "processor": model, "cores": os.cpu_count(),
        "load": round(load, 2), "lump_ms": round(min(lump() for _ in range(5)), 2),
    }  # fmt: skip


def _cpuinfo() -> str:
    path = Path("/proc/cpuinfo")
    return path.read_text(encoding="utf-8") if path.exists() else ""


def main(arguments: list[str] | None = None) -> None:
    """Run all scripts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--venvs", type=Path, default=Path(".venv-peers"), help="folder with myo, exu and osim in it")
    parser.add_argument("--out", type=Path, default=Path("out/bench/peers.json"))
    parser.add_argument("--opensim-model", type=Path, help="arm26.osim; without it OpenSim is left out")
    parser.add_argument("--quick", action="store_true", help="fewer sizes, two repeats: to see that it runs")
    parser.add_argument("--ship", action="store_true", help=f"put the rows into {SHIPPED.name}, too")
    given = parser.parse_args(arguments)
    scripts, extra = dict(SCRIPTS), dict[str, list[str]]()
    if given.opensim_model is not None:
        scripts["opensim_arm26.py"] = "osim"
        extra["opensim_arm26.py"] = ["--model", str(given.opensim_model.resolve())]
    found, rows = machine(), []
    for script, venv in scripts.items():
        python = given.venvs.absolute() / venv / "bin" / "python"
        if not python.exists():
            parser.error(f"{python} is missing; `make bench-peers` installs it, see {HERE.name}/README.md")
        links = ["--links", "1", "8"] if script.endswith("chain.py") else []
        quick = ["--repeats", "2", *QUICK.get(script, []), *links] if given.quick else []
        rows += rows_of(script, python, [*extra.get(script, []), *quick])
    given.out.parent.mkdir(parents=True, exist_ok=True)
    given.out.write_text(json.dumps(found | {"quick": given.quick, "rows": rows}, indent=1), encoding="utf-8")
    print(f"written: {given.out}")
    if given.ship:
        write_shipped(rows, found["taken"].split()[0])


if __name__ == "__main__":
    main()
