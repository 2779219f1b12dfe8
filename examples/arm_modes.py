"""How does an arm with its device swing, and how stiff does the controller make it?"""

import numpy as np

from dms_core import Model
from dms_core.analyses import static_equilibrium
from dms_core.model import Constant
from exo_env.ecosystem.ecosystem import Ecosystem

angle = np.radians(60.0)
system = Ecosystem(weight=1.0).system(angle, Constant(value=angle), assistance=1.0)
linear = static_equilibrium(Model(system)).last.linearisation
print(f"{len(linear.states)} states, {'stable' if linear.stable else 'unstable'}; what swings or moves the elbow:")
elbow = [name for name, _ in linear.outputs].index("elbow_angle.angle")
for mode in linear.modes():
    # Modes in which little but an activation or a fibre changes leave the elbow where it is.
    if mode.damped_frequency > 0.0 or abs(linear.C[elbow] @ mode.state) > 0.3 * np.abs(mode.state).max():
        print(f"{mode.frequency:9.3f} Hz, damping {mode.damping:6.3f}: {mode.words}")
psi = linear.inputs.index("psi")
gain = linear.C[elbow] @ np.linalg.solve(-linear.A, linear.B[:, psi])
print(f"the elbow follows a slow reference with gain {gain:.4f}")
