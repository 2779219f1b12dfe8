"""The environments of this project."""

from typing import Any, ClassVar

from steady import FOLDER
from steady.hold_still import HoldStill
from steady.water import WaterDrag

from exo_env.drives.rope_tension import RopeTension
from exo_env.ecosystem.ecosystem import Ecosystem
from exo_env.envs.base_env import AssistanceEnv
from exo_env.envs.settings import EnvSettings
from exo_env.envs.vector_env import AssistanceVectorEnv


class Pool:
    """What joins the system: water about the forearm."""

    def bodies(self, flexion):
        return []

    def joints(self):
        return []

    def forces(self):
        return [WaterDrag(name="water", body="forearm", drag=4.0)]


class InWater(Ecosystem):
    """Arm, device and machine in a pool."""

    def more_parts(self, arm, worn):
        return [Pool()]


class HoldStillSettings(EnvSettings):
    """Three ropes, and patients with tremor."""

    patient: Any = str(FOLDER / "tremor.yaml")
    exoskeleton: Any = str(FOLDER / "three_ropes.yaml")
    drive_settings: Any = {"max_tension": [200.0, 100.0, 50.0]}
    observation: Any = ("device", "sum.total_tension")


class HoldStillEnv(AssistanceEnv):
    """Keep the arm still in water, with three ropes."""

    task_type: ClassVar = HoldStill
    settings_type: ClassVar = HoldStillSettings
    ecosystem_type: ClassVar = InWater
    drives: ClassVar = {"rope_tension": RopeTension}
    duration = 2.0


class HoldStillVectorEnv(AssistanceVectorEnv):
    """Many of them."""

    env_type: ClassVar = HoldStillEnv


class TwoMusclesSettings(EnvSettings):
    """An arm of one flexor and one extensor."""

    subject: str = str(FOLDER / "two_muscles.yaml")


class TwoMusclesEnv(AssistanceEnv):
    """The same task with another arm, on the device that exo_env ships."""

    task_type: ClassVar = HoldStill
    settings_type: ClassVar = TwoMusclesSettings
    duration = 2.0


class TwoMusclesVectorEnv(AssistanceVectorEnv):
    """Many of them."""

    env_type: ClassVar = TwoMusclesEnv
