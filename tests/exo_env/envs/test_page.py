"""The environment page (the class docstring) against the spaces, the weights and the constructor."""

import inspect
import re

import numpy as np
import pytest

from exo_env.drives.assist_moment import AssistMoment
from exo_env.drives.impedance import Impedance
from exo_env.drives.pid_setpoint import PidSetpoint
from exo_env.drives.rope_tension import RopeTension
from exo_env.envs.elbow_lift import ElbowLiftEnv
from exo_env.tasks.judgement.rewards import Weights

PAGE = inspect.getdoc(ElbowLiftEnv)


def _tables(section):
    """Tables of a section as lists of rows, the heading left out."""
    text = PAGE.split(f"## {section}\n")[1].split("\n## ")[0]
    found = []
    for block in re.findall(r"(?:^\|.*\n?)+", text, re.MULTILINE):
        rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in block.strip().splitlines()]
        found.append(rows[2:])
    return found


def test_it_has_the_sections_of_the_template():
    wanted = ["Description", "Action Space", "Observation Space", "Rewards", "Starting State", "Episode End",
              "Arguments", "Version History"]  # fmt: skip
    assert re.findall(r"^## (.*)$", PAGE, re.MULTILINE) == wanted


def _range_of_commands(drive, device):
    """Least and most of what each component of an action means."""
    if isinstance(drive, AssistMoment):
        return np.array([[-drive.max_moment, 0.0], [drive.max_moment, drive.max_co_tension]])
    offset, gain = drive.numbers(device).T
    return offset - gain, offset + gain


@pytest.mark.parametrize(("table", "mode"), list(enumerate(ElbowLiftEnv.drives)))
def test_actions(table, mode):
    env, rows = ElbowLiftEnv(action_mode=mode), _tables("Action Space")[table]
    assert len(_tables("Action Space")) == len(ElbowLiftEnv.drives) and f'`action_mode="{mode}"`' in PAGE
    assert [row[1] for row in rows] == list(env.drive.actions(env.ecosystem.device))
    low, high = _range_of_commands(env.drive, env.ecosystem.device)
    for k, (_, _, least, most, control_least, control_most, _) in enumerate(rows):
        assert (env.action_space.low[k], env.action_space.high[k]) == (float(least), float(most))
        assert (low[k], high[k]) == (float(control_least), float(control_most))


def test_numbers_in_the_text_are_those_of_the_settings():
    env = ElbowLiftEnv()
    drive, limits, pid, law = RopeTension(), env.limits, PidSetpoint(), Impedance()
    for sentence in (
        f"{drive.rate_limit:g} N/s and follow with a lag of {drive.time_constant:g} s",
        f"filter of {pid.filter_frequency:g} rad/s; its authority changes by at most {pid.authority_rate:g} 1/s",
        f"follows the hinge with a time constant of {law.relaxation_time:g} s, a damper",
        f"follow this law with a lag of {law.time_constant:g} s",
        f"changes by at most {law.change_rate:g} times its largest value in a second",
        f"the elbow leaves {limits.lowest_deg:g} to {limits.highest_deg:g} deg",
        "The elbow has stops at {:g} and {:g} deg".format(*env.ecosystem.arm().within_stops(-180.0, 180.0)),
        "`initial_angle_deg` ({:g} to {:g})".format(*env.ecosystem.arm().within_stops(*env.task.start_range())),
        f"a rope exceeds {limits.tension:g} N",
        f"elbow reaction exceeds {limits.reaction:g} N",
        f"`episode_duration` ({env.duration:g} s)",
        "load ({:g} to {:g} kg)".format(*env.load.limits()),
    ):
        assert sentence in re.sub(r"\s+", " ", PAGE), sentence


def test_observations():
    env, rows = ElbowLiftEnv(), _tables("Observation Space")[0]
    assert len(rows) == env.observation_space.shape[0]
    parts = [(s, label) for s in env.observation_structure for label in s.labels]
    for k, ((number, name, low, high, unit, scale), (part, label)) in enumerate(zip(rows, parts, strict=True)):
        assert (int(number), name) == (k, f"{part.name}, {label}" if label else part.name)
        assert (unit, float(scale)) == (part.unit, part.scale)
        assert (env.observation_space.low[k], env.observation_space.high[k]) == (float(low), float(high))


def test_rewards():
    assert {row[0]: float(row[2]) for row in _tables("Rewards")[0]} == Weights().model_dump()


def test_arguments():
    fields, rows = ElbowLiftEnv.settings_type.model_fields, _tables("Arguments")[0]
    assert [row[0].strip("`") for row in rows] == list(fields)
    for name, default, _ in rows:
        known = fields[name.strip("`")].default
        said = eval(default.strip("`"))  # noqa: S307  our own page
        assert (list(known) if isinstance(known, tuple) else known) == said, name


def test_summary_names_terms_channels_and_actions():
    said = ElbowLiftEnv(observation=["device", "privileged.load"]).summary()
    for words in ("tracking", "0.75", "device.preview", "7-9", "privileged.load", "agonist tension", "solver"):
        assert words in said, said
