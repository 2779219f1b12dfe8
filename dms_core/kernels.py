"""The public face for compiled code of other packages: what a kernel, a task or a batch of worlds is written with.

A world is two packed tables (arena.py): m, its constant tables (`World.tables`), and s, its state (`World.packed`).
Compiled code takes views of their fields by name and calls, without touching a Python object:

    advance(m, s, o, t_end, record, 0)    steps to t_end; gives (a code of OUTCOME, rows recorded)
    restart(m, s, o)                      accelerations and multipliers behind a jump; False if there are none
    rewind(s, q, v, step)                 back to t = 0 at other coordinates and rates
    renumber(s)                           says that numbers of the model have changed
    read_sensors(sensing, signals, t, q, v, vd, lam, behind, y)     all sensors of one state
    constraint_gap(m, s)                  largest |phi| of the present state

with o an `Options` (`SolverOptions.numbers()`). A function of one packed table can be called by its address: `address`
gives it, `call_with_table` calls it, and one compiled loop serves every function that exists or is written later.

A first run compiles in two processes: `compile_beside_models("module:function")`, called when a package is imported,
names a function without arguments that compiles what the package builds on a world.
"""

from dms_core.assembly.readings.sensing import read_sensors
from dms_core.assembly.tables import MODEL, SIGNALS
from dms_core.compiled.arena import (
    Packed,
    fields,
    flags,
    floats,
    indices,
    inner,
    ints,
    matrix,
    naturals,
    number,
    table_at,
)
from dms_core.compiled.calls import TABLE, TABLE_CALL, address, call_with_table
from dms_core.compiled.jit import compiled
from dms_core.compiled.side_by_side import register as compile_beside_models
from dms_core.simulation.iteration.newton import largest_errors
from dms_core.simulation.iteration.parts import PARTS, advance, restart, run_part
from dms_core.simulation.state import CLOCK, COUNTS, LARGEST, STATE, Options, renumber, rewind
from dms_core.simulation.step_control import OUTCOME

T = CLOCK.t
DONE, MATRIX_SINGULAR = OUTCOME.done, OUTCOME.matrix_singular

__all__ = [
    "CLOCK",
    "COUNTS",
    "DONE",
    "LARGEST",
    "MATRIX_SINGULAR",
    "MODEL",
    "OUTCOME",
    "SIGNALS",
    "STATE",
    "TABLE",
    "TABLE_CALL",
    "Options",
    "Packed",
    "T",
    "address",
    "advance",
    "call_with_table",
    "compile_beside_models",
    "compiled",
    "constraint_gap",
    "fields",
    "flags",
    "floats",
    "indices",
    "inner",
    "ints",
    "matrix",
    "naturals",
    "number",
    "read_sensors",
    "renumber",
    "restart",
    "rewind",
    "table_at",
]


@compiled
def constraint_gap(m, s):
    """Largest |phi| of the present state [m or -]."""
    run_part(m, s, PARTS.constraints)
    return largest_errors(s)[0]
