"""What a drive of one's own may declare wrongly, and the sentence that names it."""

import math

import numpy as np
import pytest

from dms_core.errors import InputError
from exo_env.drives.checked import check_drive
from exo_env.drives.drive import Command
from exo_env.drives.pid_setpoint import SETPOINT, PidSetpoint
from exo_env.drives.rope_tension import RopeTension
from exo_env.ecosystem.ecosystem import ASSISTANCE
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.envs.elbow_lift import ElbowLiftEnv

DEVICE = Exoskeleton.named("elbow")


def made(base=RopeTension, kernel=None, **answers):
    """A drive with other answers to what a drive is asked."""
    methods = {name: (lambda self, device, x=x: x) for name, x in answers.items()}
    if kernel is not None:
        methods["kernel"] = kernel
    return type("Own", (base,), {**methods, "__module__": __name__})()


def two(**changes):
    """Two commands, the second with changes."""
    return (Command("one", math.inf), Command(**{"name": "two", "rate": 1.0, **changes}))


@pytest.mark.parametrize(
    ("answers", "complaint"),
    [
        ({"numbers": np.zeros((1, 2))}, r"numbers have shape \(1, 2\); .* \(2, 2\), .*agonist_command"),
        ({"numbers": np.zeros(4)}, r"numbers have shape \(4,\)"),
        ({"numbers": np.array([[0.0, np.nan]] * 2)}, "expected an array of finite numbers"),
        ({"numbers": [[0.0, 1.0]] * 2}, "expected an array of finite numbers"),
        ({"commands": two(rate=math.nan)}, "command 'two': rate = nan; expected a number above 0"),
        ({"commands": two(rate=-5.0)}, "command 'two': rate = -5.0"),
        ({"commands": two(start=math.inf)}, "command 'two': start = inf"),
        ({"commands": two(holds=-1.0)}, "command 'two': holds = -1.0"),
        ({"commands": two(apart=math.nan)}, "command 'two': apart = nan; expected a finite number"),
        ({"commands": two(name="one")}, "commands = .'one', 'one'.; expected different names"),
        ({"commands": two(carries=(1.0, math.nan))}, "command 'two': carries = .*; expected two finite moments"),
        ({"commands": ()}, r"commands = \[\]; expected different names, at least one"),
        ({"actions": ("up",)}, "1 actions for 2 commands"),
        ({"actions": ("up", "up")}, "actions = .*different names"),
        ({"kernel": lambda w: None}, "kernel is the Python function '<lambda>'"),
    ],
)
def test_declarations(answers, complaint):
    with pytest.raises(InputError, match=f"Own: .*{complaint}"):
        check_drive(made(**answers), DEVICE)


@pytest.mark.parametrize("kind", list(ElbowLiftEnv.drives.values()))
def test_shipped_drives_pass(kind):
    check_drive(kind(), DEVICE)


@pytest.mark.parametrize(
    ("answers", "complaint"),
    [
        ({"numbers": np.zeros((1, 2))}, "numbers have shape"),
        (
            {"commands": (Command(SETPOINT, math.inf), Command(ASSISTANCE, 1.0, motor="nope"))},
            "command 'assistance': motor 'nope' is unknown; there are .*agonist",
        ),
    ],
)
def test_a_world_checks_its_drive(answers, complaint):
    env_type = type("OwnEnv", (ElbowLiftEnv,), {"drives": {"own": type(made(PidSetpoint, **answers))}})
    with pytest.raises(InputError, match=f"Own: .*{complaint}"):
        env_type(action_mode="own").reset(seed=0)


def test_a_command_too_few_for_the_ropes():
    answers = {"commands": (Command("agonist_command", 1.0),), "numbers": np.zeros((1, 2))}
    env_type = type("OwnEnv", (ElbowLiftEnv,), {"drives": {"own": type(made(**answers))}})
    with pytest.raises(InputError, match=r"Own: 1 commands \(agonist_command\); expected one for each of .* 2 ropes"):
        env_type(action_mode="own").reset(seed=0)
