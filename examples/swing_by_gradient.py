"""Which moments bring a pendulum to a posture? A policy is trained by gradients through the equations of motion.

`ControlPeriod` is a function of state and action that torch differentiates, by the adjoint of the solver's own steps.
"""

import torch

from dms_core import Model
from dms_core.model import Gravity, Input, JointMotor, Revolute, RigidBody, System
from dms_core.sensitivity.torch_functions import ControlPeriod

rod = RigidBody(name="rod", mass=1.0, inertia=(0.02, 1e-4, 0.02), centre_of_mass=(0.0, -0.25, 0.0))
hinge = Revolute(name="hinge", body_j="rod")
forces = [
    Gravity(name="weight", acceleration=(0.0, -9.81, 0.0)),
    JointMotor(name="motor", joint="hinge", input="moment"),
]
model = Model(System("pendulum", bodies=[rod], constraints=[hinge], forces=forces, inputs=[Input(name="moment")]))
period, x = ControlPeriod(model, ["moment"], 0.05), model.layout.index["rod.x"]

torch.manual_seed(0)
policy = torch.nn.Sequential(torch.nn.Linear(2, 8), torch.nn.Tanh(), torch.nn.Linear(8, 1)).double()
optimiser, losses = torch.optim.Adam(policy.parameters(), lr=0.05), []
for _ in range(15):
    state, loss = period.start(), torch.zeros((), dtype=torch.float64)
    for k in range(12):
        moment = 4.0 * torch.tanh(policy(state[[x, model.n_q + x]]))
        state = period(state, moment)
        # The centre of mass shall hang at x = 0.15 m from 0.4 s on, with little effort.
        loss = loss + 1e-3 * (moment**2).sum() + (100.0 * (state[x] - 0.15) ** 2 if k >= 8 else 0.0)
    optimiser.zero_grad()
    loss.backward()
    optimiser.step()
    losses.append(loss.item())
print(f"loss of the first episode {losses[0]:.3f}, of the last {losses[-1]:.3f}")
