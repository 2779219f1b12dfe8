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

from dms_core.compilation import drop_stale_code

drop_stale_code()

from dms_core.assembly.model import Model  # noqa: E402
from dms_core.errors import AssemblyError, DmsError, InputError, ModelError, SimulationError  # noqa: E402
from dms_core.model.system import System  # noqa: E402
from dms_core.results import Result, SolveStats, States, Trajectory  # noqa: E402
from dms_core.simulation.dynamics import Simulation, SolverOptions, World, simulate  # noqa: E402

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
