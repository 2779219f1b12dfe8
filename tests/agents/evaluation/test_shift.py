"""Shifts away from training: what each one changes, for whom, and the command."""

import csv

import pytest

from agents.__main__ import main
from agents.environment import check_settings, make
from agents.evaluation.comparison.evaluate import Plan
from agents.evaluation.studies.shift import SHIFTS
from agents.policies.baselines import policy
from agents.policies.policy import Policy
from exo_env.patient.population import Population

HIDDEN = "exo/HiddenIntent-v0"
PLAN = Plan("mixed", 2, 5, (), HIDDEN, {"episode_duration": 1.0})


class Listener(Policy):
    """Sees some of everything."""

    name, title, action_mode, observation = "listener", "listener", "rope_tension", ("device", "emg.emg", "imu")

    def reset(self, env):
        """Nothing."""

    def __call__(self, observation, info):
        """Slack ropes."""
        return [-1.0, -1.0]


@pytest.mark.parametrize("name", SHIFTS)
@pytest.mark.parametrize(
    "who", [policy("gravity"), policy("oracle"), policy("intent_pd"), Listener()], ids=lambda one: one.name
)
def test_every_size_is_a_possible_plan_and_the_first_is_none(name, who):
    shift = SHIFTS[name]
    assert list(shift.sizes) == sorted(set(shift.sizes)) and "[" in shift.label
    assert shift.plan(PLAN, who, shift.sizes[0]) is PLAN
    for size in shift.sizes[1:]:
        changed = shift.plan(PLAN, who, size)
        assert changed.settings["episode_duration"] == 1.0 and (changed.patients, changed.seed) == (2, 5)
        settings = {**changed.settings, "patient": changed.patient, "observation": list(who.observation)}
        check_settings(HIDDEN, settings | {"action_mode": who.action_mode})


def test_noise_and_delay_reach_the_sensors_that_are_seen_and_nothing_else():
    world = make(HIDDEN, observation=list(Listener.observation)).unwrapped
    before = {f"{g}.{c.name}": c.imperfection for g, c in world.observer.channels}
    noise = SHIFTS["sensor_noise"].plan(PLAN, Listener(), 4.0).settings["noise"]
    delay = SHIFTS["sensor_delay"].plan(PLAN, Listener(), 80.0).settings["noise"]
    bias = SHIFTS["sensor_bias"].plan(PLAN, Listener(), 0.05).settings["noise"]
    assert "device.last_action" not in {*noise, *delay, *bias}, "a device knows what it did"
    assert {*delay} == {*before} - {"device.last_action"} and "imu.gyro" in noise
    assert noise["device.angle"]["quantum"] == 4.0 * before["device.angle"].quantum
    assert noise["emg.emg"]["deviation"] == 4.0 * before["emg.emg"].deviation
    assert noise["emg.emg"]["delay"] == before["emg.emg"].delay
    assert delay["emg.emg"]["delay"] == pytest.approx(before["emg.emg"].delay + 0.08)
    assert bias["device.tension"]["bias"] == pytest.approx(0.05 * 100.0) and bias["device.tension"]["delay"] == 0.0
    oracle = SHIFTS["sensor_delay"].plan(PLAN, policy("oracle"), 80.0).settings.get("noise", {})
    assert not any(name.startswith("privileged") for name in oracle), "what no sensor measures has no fault"


class Believer(Listener):
    """Sees nothing but what the device's filter estimates."""

    name, observation = "believer", ("estimated.load",)


def test_noise_reaches_the_sensors_of_a_filter_and_not_its_estimates():
    changes = {name: SHIFTS[f"sensor_{name}"].plan(PLAN, Believer(), size).settings["noise"]
               for name, size in (("noise", 4.0), ("delay", 80.0), ("bias", 0.05))}  # fmt: skip
    for found in changes.values():
        assert {*found} == {"device.angle", "device.rate", "device.guide_force"}
        check_settings(HIDDEN, {"observation": ["estimated.load"], "noise": found})


def test_electrodes_are_worse_for_those_who_have_some():
    shift = SHIFTS["electrode_faults"]
    assert shift.plan(PLAN, policy("gravity"), 2.0) is PLAN
    changed = shift.plan(PLAN, policy("emg_proportional"), 2.0).settings["electrodes"]
    assert changed == {"gain_deviation": 0.6, "crosstalk": 0.4, "dropping": 0.4}


def test_patients_go_from_evaluation_to_shifted():
    shift = SHIFTS["patients"]
    ends = [shift.plan(PLAN, policy("gravity"), size).title for size in (shift.sizes[1], shift.sizes[-1])]
    assert ends == [Population.shipped(name).title for name in ("evaluation", "shifted")]
    assert shift.plan(PLAN, policy("gravity"), 0.5).title.startswith("0.333 of the way")


def test_the_hinge_is_where_the_label_says():
    offset = SHIFTS["hinge_offset"].plan(PLAN, policy("gravity"), 30.0).settings["misalignment"]["shift"]
    assert sum(x**2 for x in offset) ** 0.5 == pytest.approx(0.03)


@pytest.mark.slow
def test_the_command_writes_a_row_a_size_and_policy(tmp_path, capsys):
    out = tmp_path / "run"
    command = ["shift", "--policy", "gravity", "--shifts", "sensor_delay", "load", "--patients", "2", "--out", str(out)]
    assert main(command) == 0
    assert sorted(p.name for p in out.iterdir() if p.name[0] != ".") == ["shift.csv", "shift.md", "shift.png"]
    assert not (tmp_path / "run.partial.jsonl").exists()
    head, *lines = (out / "shift.csv").read_text().splitlines()
    assert head.startswith("# python -m agents shift --policy gravity")
    rows = list(csv.DictReader(lines))
    names = list(dict.fromkeys(row["policy"] for row in rows))
    assert names[0] == "gravity" and "oracle" in names and len(rows) == 10 * len(names)
    unshifted = [r for r in rows if (r["shift"], r["size"]) in {("sensor_delay", "0"), ("load", "1.25")}]
    by_policy = {}
    for row in unshifted:
        by_policy.setdefault(row["policy"], set()).add(tuple(v for k, v in row.items() if k not in ("shift", "size")))
    assert all(len(found) == 1 for found in by_policy.values()), "without a shift the episodes are the same"
    told = [r["return"] for r in rows if r["shift"] == "sensor_delay" and r["policy"] == "oracle"]
    blind = [r["return"] for r in rows if r["shift"] == "load" and r["policy"] == "gravity"]
    assert len(set(told)) == 1 and len(set(blind)) == 5
    assert "| 5 | oracle |" in (out / "shift.md").read_text()


def test_the_help_names_every_shift(capsys):
    with pytest.raises(SystemExit) as end:
        main(["shift", "--help"])
    words = capsys.readouterr().out.replace(",", " ").replace(";", " ").split()
    assert end.value.code == 0 and "cuff" in words and set(SHIFTS) <= set(words)


@pytest.mark.slow
def test_ray_gives_the_same(tmp_path):
    pytest.importorskip("ray")
    command = ["shift", "--policy", "gravity", "--shifts", "electrode_faults", "--patients", "2"]
    for name, more in (("here", []), ("ray", ["--address", "local", "--workers", "2"])):
        assert main([*command, "--out", str(tmp_path / name), *more]) == 0
    assert (tmp_path / "here" / "shift.csv").read_text() == (tmp_path / "ray" / "shift.csv").read_text()


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--shifts", "wind"], "--shifts wind: expected different ones of cuff, electrode_faults"),
        (["--shifts", "load", "load"], "--shifts load: expected different ones"),
        (["--env", "exo/ElbowLift-v2"], "expected one whose task hides the patient's plan"),
        (["--patients", "0"], "patients = 0: expected a whole number from 1"),
        (["--population", "martians"], "unknown population 'martians'"),
    ],
)
def test_bad_commands(more, said, tmp_path, capsys):
    assert main(["shift", "--policy", "gravity", "--out", str(tmp_path / "run"), *more]) == 2
    assert said in capsys.readouterr().err and not (tmp_path / "run").exists()
