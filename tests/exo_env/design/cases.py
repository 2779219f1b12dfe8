"""A small movement and its wearers, for tests that differentiate and search."""

from functools import cache

from dms_core import SolverOptions
from exo_env.design.space import Design, DesignSpace
from exo_env.design.wearer import Setting, Wearer, wearers
from exo_env.ecosystem.cuff import Cuff
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.ecosystem.worn_exoskeleton import Misalignment
from exo_env.paper.scenarios import Exercise
from exo_env.patient.population import population

EXERCISE = {"times": [0.02, 0.18], "angles_deg": [40.0, 46.0], "duration": 0.2, "proprioception": {}}
"""Too short for its peaks to mean anything; long enough for muscles, ropes and controllers to move."""
ALIGNED = (0.0, 0.0, 0.0)
ASKEW = (0.01, -0.008, 0.0)
"""A shift of the hinge [m] with which the start depends on the guide."""
OPTIONS = SolverOptions(rtol=1e-6)


def few(count: int, shift=ALIGNED, exercise=EXERCISE, *, cuff: bool = False) -> list[Wearer]:
    """Wearers of a small movement, whose orders of elimination are those of `first`."""
    setting = Setting(exercise=Exercise(**exercise), misalignment=Misalignment(shift=shift))
    found = wearers(population("wide"), 0, count, setting)
    return [Wearer(who.name, who.patient, setting, first(cuff)) for who in found]


@cache
def first(cuff: bool) -> Wearer:
    """A wearer whose model is known: finding its orders takes longer than a run."""
    (who,) = wearers(population("wide"), 0, 1, Setting(exercise=Exercise(**EXERCISE)))
    who.model(space(cuff).today)
    return who


def space(cuff: bool = False, bounds=None) -> DesignSpace:
    """Around the shipped device."""
    return DesignSpace(Design(Exoskeleton.named("elbow"), Cuff() if cuff else None), bounds)
