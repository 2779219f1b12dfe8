"""The public face for kernels of other packages: what a task, a drive or a movement of one's own is written with.

A kernel is a compiled function of one packed world w, decorated with `compiled`. It takes views of arrays by name:

    drive = inner(w, WORLD.drive)
    action, wanted = floats(drive, DRIVE.action), floats(drive, DRIVE.wanted)

and, in a task, `readings(w)`, `first_of(w)`, `terms_of(w)`, `task_numbers(w)`, `step_of(w)` and `end_with(w, code)`.
All tables and their fields are in exo_env/tables.py. The machine code is kept on disk and used as long as nothing has
changed that went into it: the kernel, what it calls, and the constants that they name, in whichever file.
"""

from dms_core.compiled.jit import compiled
from dms_core.kernels import flags, floats, inner, ints, matrix
from exo_env.places import places
from exo_env.tables import (
    DRAW,
    DRIVE,
    DYNAMICS,
    EFFORT,
    GIVEN,
    OBSERVER,
    PATIENT_TABLES,
    PLAN,
    STATUS,
    TASK,
    WORLD,
)
from exo_env.tasks.task import (
    FIRST_EVENT,
    NOTHING,
    SOLVER,
    end_with,
    event_of,
    first_of,
    readings,
    step_of,
    task_numbers,
    terms_of,
)

__all__ = [
    "DRAW",
    "DRIVE",
    "DYNAMICS",
    "EFFORT",
    "FIRST_EVENT",
    "GIVEN",
    "NOTHING",
    "OBSERVER",
    "PATIENT_TABLES",
    "PLAN",
    "SOLVER",
    "STATUS",
    "TASK",
    "WORLD",
    "compiled",
    "end_with",
    "event_of",
    "first_of",
    "flags",
    "floats",
    "inner",
    "ints",
    "matrix",
    "places",
    "readings",
    "step_of",
    "task_numbers",
    "terms_of",
]
