"""The command `arm26`: the bare arm under a table of excitations."""

from __future__ import annotations

import math
import sys
from pathlib import Path

from dms_core import Simulation, SolverOptions
from dms_core.command_line import FAILED_RUN, FileOut, bar_of_run, moves
from dms_core.errors import InputError, Stopped
from dms_core.files.output_file import check_size, write_csv
from dms_core.files.outputs import OutputFile, Outputs, partial
from dms_core.model.muscles.activation import MINIMUM
from dms_core.results import Result
from dms_core.simulation.options import MethodName
from exo_env.ecosystem import bare_arm as bare

COLUMNS = 1 + 3 + 6 * 4 + 6
"""Of the table, roughly: time, elbow, six muscles and the elbow's reaction."""


def arm26(
    excitations: Path,
    out: FileOut,
    t_end: float,
    start_deg: float = 20.0,
    start_activation: float = 0.05,
    rtol: float = SolverOptions.rtol,
    method: MethodName = SolverOptions.method,
    sample: float = 0.01,
    overwrite: bool = False,
) -> int:
    """Drive the bare arm26 by a table of excitations and write its motion, muscles and elbow reaction as CSV.

    Args:
        excitations: CSV file with the columns time_s [s], BIClong, BICshort, BRA, TRIlong, TRIlat, TRImed [-, 0 to 1];
            each row holds until the next, and the first stands at 0.
        out: CSV file to write; its folder is made where it is missing.
        t_end: end time [s].
        start_deg: elbow flexion at the start [deg].
        start_activation: of every muscle at the start, 0.01 to 1 [-].
        rtol: relative tolerance of the error per step.
        method: method of integration: bdf2, sdirk2 or radau5.
        sample: time between rows [s].
        overwrite: replace a file of this name.
    """
    _check(t_end, sample, start_deg, start_activation)
    with Outputs("arm26", files=[OutputFile("--out", out)], inputs=[excitations], overwrite=overwrite) as outputs:
        system = bare.bare_arm(math.radians(start_deg), bare.read_excitations(excitations), start_activation)
        simulation = Simulation(system, SolverOptions(rtol=rtol, method=method))
        with bar_of_run(t_end) as bar:
            simulation.advance(t_end, moves(bar))
        trajectory = simulation.trajectory()
        if trajectory.result is Result.INTERRUPTED:
            write_csv(part := partial(out), bare.table(trajectory, sample))
            raise Stopped(f"{trajectory.t[-1]:.4g} of {t_end:.4g} s are in '{outputs.where(part)}'.")
        write_csv(out, bare.table(trajectory, sample))
    print(f"{trajectory.message} {trajectory.stats.steps} steps. Written: {outputs.where(out)}")
    for warning in bare.warnings(trajectory):
        print(f"warning: {warning}", file=sys.stderr)
    if not trajectory.success:
        print(f"The run failed; '{outputs.where(out)}' holds the part before.", file=sys.stderr)
        return FAILED_RUN
    return FAILED_RUN if outputs.failed else 0


def _check(t_end: float, sample: float, start_deg: float, start_activation: float) -> None:
    """Refuse options that are out of their ranges.

    Raises:
        InputError: names the option and what is allowed.
    """
    for name, value in (("--t-end", t_end), ("--sample", sample)):
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(f"{name} {value}: expected a time above 0 s.")
    if not -180.0 < start_deg < 180.0:
        raise InputError(f"--start-deg {start_deg}: expected an angle between -180 and 180 deg.")
    if not MINIMUM <= start_activation <= 1.0:
        raise InputError(f"--start-activation {start_activation}: expected a number from {MINIMUM} to 1.")
    check_size("--sample", t_end, sample, COLUMNS)
