"""How do I describe a patient, or a population, of my own? As a mapping or as a YAML file; the rest is healthy."""

import tempfile
from pathlib import Path

from exo_env.envs.elbow_lift import ElbowLiftEnv

# One patient: any fields of exo_env/patient/patient.py.
env = ElbowLiftEnv(patient={"maximum_activation_flexors": 0.1, "slacking_rate": 0.2}, load=1.0)
_, info = env.reset(seed=0)
print(f"a patient of a tenth of the strength can hold {info['ability']:.0%} of arm and weight")

# A population: a distribution for each field, here for one field more than those of a shipped population.
file = Path(tempfile.mkdtemp()) / "frail.yaml"
file.write_text("title: frail\nbase: stroke_mild\nfields:\n  maximum_activation_flexors: {uniform: [0.05, 0.15]}\n")
env = ElbowLiftEnv(patient=str(file))
abilities = [env.reset(seed=k)[1]["ability"] for k in range(5)]
print("abilities of five patients of the population:", [f"{x:.2f}" for x in abilities])

# With `cycle=5` the sixth reset brings the first of five patients again.
