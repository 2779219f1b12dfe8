"""A weight that changes within an episode: the patient picks something up, or puts it down.

What is picked up moves with the hand already, so that coordinates and rates go on and no impulse acts; accelerations
and forces jump.
"""

from __future__ import annotations

from dms_core.compiled.jit import compiled
from dms_core.kernels import floats, inner, ints, renumber
from exo_env.tables import DYNAMICS, PLAN, REST, SCALING, STATUS, WORLD
from exo_env.world.kernels.scaling import put_numbers

CONSTRAINTS = 1
"""Place of the numbers of constraints among the numbers of the model (`Model.numbers`)."""


@compiled
def put_load(w):
    """Put the weight of the coming period on the machine, where it is another one than before."""
    loads, k = floats(inner(w, WORLD.plan), PLAN.loads), ints(w, WORLD.status)[STATUS.step]
    if k == 0 or loads[k] == loads[k - 1]:
        return
    # The rope stays as long as it is; its length does not follow from the sizes alone (rest_pose.py).
    numbers = floats(inner(inner(w, WORLD.scaling), SCALING.targets), CONSTRAINTS)
    rope = ints(inner(w, WORLD.rest), REST.rope)[0]
    length = numbers[rope]
    put_numbers(w, loads[k])
    numbers[rope] = length
    renumber(inner(inner(w, WORLD.dynamics), DYNAMICS.state))
