"""Error against work down to 1e-10: BDF2, SDIRK2 and Radau IIA beside SUNDIALS IDA, by steps, evaluations and CPU.

    python tests/benchmarks/digits.py [--out docs] [--ida FOLDER] [--repeats 3]

Problems: those of tests/dms_core/literature/motions.py and Andrews' squeezer, whose references hold twelve digits; the
error is the largest over all coordinates (m, or Euler parameters) at ten times, of Andrews that of the crank's angle at
the end [rad]. Nothing is recorded while the methods run. FOLDER is where the wheel of scikit-sundae lies
(`pip install --target FOLDER scikit-sundae`); IDA then solves the same residual with the same Jacobian and a dense LU
(peers/sundials_ida.py). Without it, rows of IDA are taken from the table that is there already. Takes some minutes.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import math
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import astuple, dataclass, fields
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

from dms_core import Model, SolverOptions, World
from dms_core.figures import drawn
from exo_env.rendering.panels import COLOURS, legend, log_scale, panels, save
from tests.benchmarks import csv_file
from tests.benchmarks.calibration import normalised
from tests.dms_core.literature.motions import MOTIONS
from tests.dms_core.literature.test_andrews import andrews, problem

TOLERANCES = {
    "bdf2": tuple(10.0**-k for k in range(4, 9)),
    "sdirk2": tuple(10.0**-k for k in range(3, 7)),
    "radau5": tuple(10.0**-k for k in range(3, 15)),
    "IDA": tuple(10.0**-k for k in range(4, 13)),
}
WORK = {"steps": "steps", "evaluations": "evaluations of the residual", "ms": "CPU [ms]"}
LENGTH = 0.1
"""Of Andrews' squeezer: absolute tolerances over relative ones."""


@dataclass(frozen=True)
class Case:
    """A problem of the study."""

    name: str
    model: Model
    times: np.ndarray
    error: Callable[[np.ndarray], float]
    """Of positions at the times, shape (k, n_q)."""
    atol: float | None = None
    """Over rtol; None: the nominal sizes."""


@dataclass(frozen=True)
class Row:
    """One run."""

    problem: str
    method: str
    rtol: float
    error: float
    steps: int
    iterations: int
    evaluations: int
    """Of the residual: three an iteration of Radau IIA, and one a step for its error."""
    factorisations: int
    """Of Radau IIA: pairs of a real and a complex matrix."""
    ms: float
    """CPU, normalised by calibration.py."""
    phi: float
    phi_v: float
    """Largest constraint errors of the run; nan where they are not known."""


def crank_error(model: Model) -> Callable[[np.ndarray], float]:
    """Of the angle of Andrews' crank at the end [rad]."""
    wanted, place = problem("ivp_andrews_index3")["reference"]["recomputed_y"][0], model.layout.offset["K1"]

    def error(q: np.ndarray) -> float:
        p = q[-1, place + 3 : place + 7]
        angle = 2.0 * math.atan2(p[3], p[0])
        return abs((angle - wanted + math.pi) % (2.0 * math.pi) - math.pi)

    return error


def cases() -> Iterator[Case]:
    """All problems."""
    squeezer = andrews("ivp_andrews_index3")
    yield Case("Andrews' squeezer", squeezer, np.array([0.03]), crank_error(squeezer), LENGTH)
    for name, motion in MOTIONS.items():
        wanted = motion.positions(motion.times)
        yield Case(name, motion.model(), motion.times, lambda q, w=wanted: float(np.abs(q - w).max()))


def ours(case: Case, method: str, repeats: int) -> Iterator[Row]:
    """Rows of one of our methods."""
    for rtol in TOLERANCES[method]:
        atol = None if case.atol is None else case.atol * rtol
        options = SolverOptions(rtol=rtol, atol=atol, method=method)  # type: ignore[arg-type]

        def run(options: SolverOptions = options) -> tuple[World, np.ndarray]:
            world, q = World(case.model, options), []
            for t in case.times:
                world.advance(float(t))
                q.append(world.state.q.copy())
            return world, np.array(q)

        if rtol == TOLERANCES[method][0]:
            run()
        cpu, (world, q) = normalised(run, repeats)
        s = world.stats()
        work = 3 * s.newton_iterations + s.steps if method == "radau5" else s.newton_iterations
        # Radau IIA's landings find their rates with a matrix of their own.
        pairs = s.factorisations - len(case.times) * (method == "radau5")
        yield Row(case.name, method, rtol, case.error(q), s.steps, s.newton_iterations, work, pairs, cpu * 1e3,
                  s.largest_phi, s.largest_phi_v)  # fmt: skip


def idas(case: Case, folder: Path, repeats: int) -> Iterator[Row]:
    """Rows of SUNDIALS IDA."""
    from tests.benchmarks.peers.sundials_ida import Ida

    ida, world = Ida(folder), World(case.model)
    scale = np.array([(c.scale, c.rate_scale) for c in case.model.layout.coordinates]).T
    if case.atol is not None:
        # Speeds of 10 m/s on lengths of 0.1 m; a first step of its own choice fails.
        scale = np.array([np.full(case.model.n_q, case.atol), np.full(case.model.n_q, 100.0 * case.atol)])
    for rtol in TOLERANCES["IDA"]:

        def run(rtol: float = rtol):  # noqa: ANN202
            return ida.run(World(case.model), case.times, rtol, (rtol * scale[0], rtol * scale[1]),
                           0.0 if case.atol is None else 1e-7)  # fmt: skip

        try:
            if rtol == TOLERANCES["IDA"][0]:
                run()
            cpu, (q, n) = normalised(run, repeats)
        except RuntimeError as error:
            print(f"{case.name}, IDA at {rtol:g}: {error}", file=sys.stderr)
            continue
        gap = max(float(np.abs(world.model.constraint_jacobian(x, np.zeros(len(x)))[0]).max()) for x in q)
        yield Row(case.name, "IDA", rtol, case.error(q), n.steps, n.iterations, n.residuals, n.factorisations,
                  cpu * 1e3, gap, math.nan)  # fmt: skip


def kept(path: Path) -> list[Row]:
    """Rows of IDA in a table that is there already."""
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        lines = csv.DictReader(line for line in file if not line.startswith("#"))
        kinds = {f.name: {"str": str, "int": int, "float": float}[str(f.type)] for f in fields(Row)}
        rows = [Row(**{name: kind(line[name]) for name, kind in kinds.items()}) for line in lines]
    return [row for row in rows if row.method == "IDA"]


@drawn
def draw(path: Path, rows: Sequence[Row]) -> None:
    """A row of panels a measure of work, a column a problem."""
    names = list(dict.fromkeys(row.problem for row in rows))
    figure, axes = panels(len(WORK), len(names), (3.2 * len(names), 3.0 * len(WORK)))
    styles = dict(zip(TOLERANCES, ("o-", "v-", "s-", "P--"), strict=True))
    for (work, label), (j, name) in itertools.product(WORK.items(), enumerate(names)):
        ax = axes[list(WORK).index(work), j]
        for k, (method, style) in enumerate(styles.items()):
            points = [(r.error, getattr(r, work)) for r in rows if r.problem == name and r.method == method]
            if points:
                ax.loglog(*zip(*points, strict=True), style, ms=4, lw=1, color=COLOURS[k], label=method)
        ax.set(ylabel=label if j == 0 else "", title=name if work == "steps" else "")
        ax.set(xlabel="largest error [m, rad or -]" if work == "ms" else "")
        ax.grid(alpha=0.3)
        log_scale(ax, "y")
    legend(figure, 4)
    save(figure, path)


def main(arguments: list[str] | None = None) -> None:
    """Measure, draw, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("docs"), help="folder of digits.png and digits.csv")
    parser.add_argument("--ida", type=Path, help="folder that holds the wheel of scikit-sundae")
    parser.add_argument("--repeats", type=int, default=3, help="of each timing; the median counts")
    given = parser.parse_args(arguments)
    table = given.out / "digits.csv"
    rows = [] if given.ida else kept(table)
    for case in cases():
        found = [row for method in ("bdf2", "sdirk2", "radau5") for row in ours(case, method, given.repeats)]
        found += idas(case, given.ida, given.repeats) if given.ida else []
        for row in found:
            print(f"{row.problem:18} {row.method:7} {row.rtol:6.0e} error {row.error:8.1e} steps {row.steps:7d} "
                  f"evaluations {row.evaluations:8d} {row.ms:9.2f} ms", flush=True)  # fmt: skip
        rows += found
    csv_file.write(table, [f.name for f in fields(Row)], [astuple(row) for row in rows])
    draw(given.out / "digits.png", rows)


if __name__ == "__main__":
    main()
