"""The drives that environments have to choose from, by action mode."""

from exo_env.drives.assist_moment import AssistMoment
from exo_env.drives.drive import Drive
from exo_env.drives.impedance import Impedance
from exo_env.drives.pid_setpoint import PidSetpoint
from exo_env.drives.rope_tension import RopeTension

DRIVES: dict[str, type[Drive]] = {
    "rope_tension": RopeTension,
    "pid_setpoint": PidSetpoint,
    "assist_moment": AssistMoment,
    "impedance": Impedance,
}
"""All of them."""
WITHOUT_REFERENCE = {name: drive for name, drive in DRIVES.items() if drive is not PidSetpoint}
"""Those that need not know where the patient wants to go."""
