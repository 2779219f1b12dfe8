"""One loop plays every episode: evaluation, time course and film of a seed are of the same one."""

import ast
from pathlib import Path

import pytest

import agents
from agents.commands.pictures.video import Stage
from agents.evaluation.episodes.episode import episode, world_of
from agents.evaluation.episodes.playing import Playing
from agents.evaluation.episodes.time_course import time_course
from agents.policies.learned import find_policy
from exo_env.patient.population import population

FOLDER = Path(agents.__file__).parent
STEPPING = {
    "evaluation/episodes/playing.py",
    # Many worlds at once, as one batch.
    "evaluation/search/batch_trials.py",
    "evaluation/search/upper_bound.py",
}
SHORT = {"episode_duration": 0.6}


@pytest.mark.parametrize(
    ("environment", "name", "settings"),
    [
        ("exo/ElbowLift-v2", "pid", SHORT),
        ("exo/HiddenIntent-v0", "emg_proportional", SHORT),
        ("exo/ElbowLift-v2", "pid", {**SHORT, "limits": {"tension": 20.0}}),
    ],
    ids=["reference", "hidden plan", "ended early"],
)
def test_evaluation_time_course_and_film_are_of_the_same_episode(environment, name, settings):
    one, seed = find_policy(name, environment), 4
    env = world_of(one, population("stroke_severe").model_dump(), environment, **settings)
    evaluated = episode(env, one, seed)
    course = time_course(one, "stroke_severe", seed, environment=environment, **settings)
    stage = Stage(one, "stroke_severe", seed, environment, **settings)
    stage.run()
    assert course.measures == evaluated["measures"] and course.event == evaluated["event"]
    assert [scene.time for scene in stage.scenes] == course.columns["time"].tolist()
    assert [scene.elbow_angle for scene in stage.scenes] == course.columns["elbow_angle.angle"].tolist()
    assert stage.playing.event == evaluated["event"]
    assert bool(stage.event) == bool(evaluated["event"]) == ("limits" in settings)


def test_an_episode_is_watched_before_the_first_step_and_after_each():
    one = find_policy("none", "exo/ElbowLift-v2")
    env = world_of(one, "healthy", **SHORT)
    playing = Playing(env, one, 2)
    assert playing.info is playing.drawn and playing.event is None
    times = [env.unwrapped.readings()["time"] for _ in playing.steps()]
    period = env.unwrapped.period
    # Times are sums of periods; 30 roundings of numbers below 1.
    assert times == pytest.approx([k * period for k in range(1, 31)], abs=1e-14)


def test_no_other_module_steps_an_environment_of_its_own():
    found = set()
    for path in [*FOLDER.glob("evaluation/**/*.py"), *FOLDER.glob("commands/**/*.py")]:
        calls = [node.func for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call)]
        names = {ast.unparse(call) for call in calls if isinstance(call, ast.Attribute) and call.attr == "step"}
        if names - {"ax.step"}:
            found.add(str(path.relative_to(FOLDER)))
    assert found == STEPPING
