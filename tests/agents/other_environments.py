"""Environments that are not the default one, registered for tests as a package outside would register them."""

from gymnasium.envs.registration import load_env_creator, register

from agents.environment import ENVIRONMENT, spec_of

LIFT = spec_of(ENVIRONMENT)
MISSING = ("reference", "tracking_error", "device_share", "elbow_angle.rate")


class NoReference(load_env_creator(LIFT.entry_point)):
    """A task that shows neither a reference nor the joint's rate, and tells nothing of ability and movement."""

    def readings(self):
        return {name: value for name, value in super().readings().items() if name not in MISSING}

    def start_info(self):
        return {name: value for name, value in super().start_info().items() if name not in ("reference", "ability")}


register(
    id="tests/Light-v2",
    entry_point=LIFT.entry_point,
    vector_entry_point=LIFT.vector_entry_point,
    disable_env_checker=True,
    kwargs={"load": 0.6},
)
register(id="tests/NoReference-v0", entry_point=NoReference, disable_env_checker=True)
