"""The two matrices of a Radau step, real and complex, and their solves; parts of a step, called by address.

Both are the Newton matrix of sparsity.py, scaled alike, for c0 = REAL / h and c0 = COMPLEX / h.
"""

from dms_core.assembly.residual import evaluate_newton_pair
from dms_core.assembly.tables import MODEL
from dms_core.compiled.arena import complexes, floats, inner
from dms_core.compiled.jit import compiled
from dms_core.simulation.iteration.linear_solve import back_substitute, factorise
from dms_core.simulation.iteration.order_watch import note_pivot
from dms_core.simulation.methods.radau_constants import COMPLEX, REAL
from dms_core.simulation.methods.radau_state import RADAU
from dms_core.simulation.state import CLOCK, STATE


@compiled
def radau_matrices(m, s):
    """Residual and both factorised matrices at the iterate, for the c0 in clock[CLOCK.c0_factored].

    The pivot that is noted is the smaller of their smallest relative ones.
    """
    values, radau = floats(s, STATE.newton_values), inner(s, STATE.radau)
    complex_values, c0 = complexes(radau, RADAU.values), floats(s, STATE.clock)[CLOCK.c0_factored]
    evaluate_newton_pair(
        inner(m, MODEL.dynamics), inner(m, MODEL.constraints), inner(m, MODEL.newton), inner(s, STATE.w), c0, values,
        c0 / REAL * COMPLEX, complex_values,
    )  # fmt: skip
    one = factorise(m, MODEL.newton_lu, values, floats(s, STATE.newton_work))
    other = factorise(m, MODEL.newton_lu, complex_values, complexes(radau, RADAU.work))
    note_pivot(s, min(one, other))


@compiled
def radau_solutions(m, s):
    """Both systems: x from b, real and complex."""
    radau = inner(s, STATE.radau)
    values, work = floats(s, STATE.newton_values), floats(s, STATE.newton_work)
    back_substitute(m, MODEL.newton_lu, values, floats(s, STATE.b), floats(s, STATE.x), work)
    complex_values, complex_work = complexes(radau, RADAU.values), complexes(radau, RADAU.work)
    b, x = complexes(radau, RADAU.b), complexes(radau, RADAU.x)
    back_substitute(m, MODEL.newton_lu, complex_values, b, x, complex_work)
