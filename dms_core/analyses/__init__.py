"""Simulations beside those in time: static, kinematic, inverse dynamics, linearisation (paper Fig. 1).

    from dms_core.analyses import static_equilibrium, follow_path, kinematic, inverse_dynamics, linearise

| question | function |
|---|---|
| where does it rest, and is that stable? | `static_equilibrium` |
| what happens as the load grows: does it snap through or buckle? | `follow_path` |
| how does a mechanism move that drivers move? | `kinematic` |
| which moments make a recorded motion? | `inverse_dynamics`, `motion_of` |
| which muscles could give them? | `static_optimisation` |
| how does it swing, and how does it answer to its inputs? | `linearise` |
"""

from dms_core.analyses.inverse import InverseResult, inverse_dynamics, motion_of
from dms_core.analyses.kinematic import KinematicResult, driver_loads, kinematic
from dms_core.analyses.linearise import Linearisation, Mode, linearise
from dms_core.analyses.path import EquilibriumPath, follow_path
from dms_core.analyses.static import Equilibrium, StaticResult, static_equilibrium
from dms_core.analyses.static_optimisation import MuscleResult, static_optimisation

__all__ = [
    "Equilibrium",
    "EquilibriumPath",
    "InverseResult",
    "KinematicResult",
    "Linearisation",
    "Mode",
    "MuscleResult",
    "StaticResult",
    "driver_loads",
    "follow_path",
    "inverse_dynamics",
    "kinematic",
    "linearise",
    "motion_of",
    "static_equilibrium",
    "static_optimisation",
]
