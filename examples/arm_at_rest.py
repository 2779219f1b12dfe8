"""Where does the elbow come to rest under a weight, held by muscles alone or by the device?"""

import numpy as np

from dms_core import Model
from dms_core.analyses import static_equilibrium
from dms_core.model import Constant
from exo_env.ecosystem.ecosystem import Ecosystem

reference = np.radians(60.0)
flexors = {m: Constant(value=0.3) for m in ("BIClong", "BICshort", "BRA")}
print("weight   flexors at 0.3, no device         device at its reference of 60 deg, relaxed arm")
for weight in (0.5, 1.0, 2.0, 4.0, 10.0):
    line = f"{weight:4.1f} kg"
    for excitations, assistance in ((flexors, 0.0), ({}, 1.0)):
        system = Ecosystem(weight=weight).system(
            reference, Constant(value=reference), excitations, assistance=assistance
        )
        rest = static_equilibrium(Model(system))
        y = {name: x[-1] for name, x in rest.states().sensors().items()}
        kind = "stable" if rest.last.stable else "unstable"
        moment = y["exo_moment"] if assistance else y["muscle_moment"]
        line += f"   rests at {np.degrees(y['elbow_angle.angle']):6.2f} deg ({kind}), {moment:5.2f} Nm"
    print(line)
