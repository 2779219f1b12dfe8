"""The DMS platform: multi-physical systems as differential-algebraic equations (Adduci et al., Machines 2025, 13, 895).

Letters, as in the paper (SI units, radians):

    q, v      generalised coordinates and velocities           lam, mu   Lagrange multipliers
    phi       constraint equations, phi_q their Jacobian       M         mass matrix
    f_nl      nonlinear generalised forces                     u         inputs
    y         sensors                                          psi       reference of a controller
    theta     joint angle                                      tau       rope tension
    rho       fibre force                                      sigma     tendon force
    alpha     pennation angle                                  a         muscle activation
    F0        maximum isometric force                          L0        optimal fibre length
    Ls        tendon slack length                              p         Euler parameters, scalar first
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from dms_core.old_names import MOVED
from dms_core.renamed import moved_modules

if TYPE_CHECKING:
    from dms_core.assembly.model import Model
    from dms_core.errors import AssemblyError, DmsError, InputError, ModelError, SimulationError
    from dms_core.model.system import System
    from dms_core.results import Result, SolveStats, States, Trajectory
    from dms_core.simulation.dynamics import Simulation, World, simulate
    from dms_core.simulation.options import SolverOptions

moved_modules("dms_core", MOVED)

__all__ = [
    "AssemblyError",
    "DmsError",
    "InputError",
    "Model",
    "ModelError",
    "Result",
    "Simulation",
    "SimulationError",
    "SolveStats",
    "SolverOptions",
    "States",
    "System",
    "Trajectory",
    "World",
    "simulate",
]

_MODULES = {
    "errors": ("AssemblyError", "DmsError", "InputError", "ModelError", "SimulationError"),
    "assembly.model": ("Model",),
    "model.system": ("System",),
    "results": ("Result", "SolveStats", "States", "Trajectory"),
    "simulation.dynamics": ("Simulation", "World", "simulate"),
    "simulation.options": ("SolverOptions",),
}
"""Where each public name is declared; it is loaded when it is first asked for, so that the import is quick."""


def __getattr__(name: str) -> Any:
    for module, names in _MODULES.items():
        if name in names:
            return getattr(import_module(f"dms_core.{module}"), name)
    raise AttributeError(f"module 'dms_core' has no attribute '{name}'; it has {', '.join(__all__)}.")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
