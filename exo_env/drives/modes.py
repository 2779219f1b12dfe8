"""The drives that environments have to choose from, by action mode."""

from exo_env.drives.assist_moment import AssistMoment
from exo_env.drives.drive import Drive
from exo_env.drives.impedance import Impedance
from exo_env.drives.pid_setpoint import PidSetpoint
from exo_env.drives.rope_tension import RopeTension

WITHOUT_REFERENCE: dict[str, type[Drive]] = {
    "rope_tension": RopeTension,
    "assist_moment": AssistMoment,
    "impedance": Impedance,
}
"""Those that need not know where the patient wants to go."""
DRIVES: dict[str, type[Drive]] = WITHOUT_REFERENCE | {"pid_setpoint": PidSetpoint}
"""All of them."""
