"""Imitation: what the teacher says, what the student sees and learns, and networks that a training begins with."""

import numpy as np
import pytest

pytest.importorskip("sb3_contrib")

import torch

from agents.__main__ import main
from agents.checkpoint import Store
from agents.distributed.sweep import in_order, planned
from agents.environment import ENVIRONMENT, make, make_vector
from agents.policies.learned import LearnedPolicy, find_policy
from agents.training.learners.algorithms import arguments, build
from agents.training.learners.dagger import Dagger
from agents.training.learners.demonstrations import Demonstrations
from agents.training.networks.initial import initial_policy
from agents.training.settings.config import Config
from agents.training.worlds import wrapped
from agents.training.wrappers.teacher import Teacher
from dms_core.errors import InputError
from tests.agents.tiny import ENV_KWARGS, config_file, content

SEEN = {**ENV_KWARGS, "action_mode": "rope_tension", "observation": ["device.angle", "device.rate"]}
"""What a student sees."""
WIDE = {**SEEN, "observation": ["device", "privileged"]}
"""What a teacher sees."""


def train(*arguments):
    return main(["train", *map(str, arguments)])


@pytest.fixture(scope="module")
def teacher(tmp_path_factory):
    """A trained policy that sees what no device shows."""
    folder = tmp_path_factory.mktemp("teacher")
    path = config_file(folder, env_kwargs=WIDE)
    assert train("--config", path, "--out", folder / "run", "--set", "n_timesteps=64") == 0
    return folder / "run"


def student(tmp_path, teacher, training=None, **changes):
    """A configuration of a student of a teacher."""
    own = {"imitation": {"teacher": str(teacher), "driven": 0, "kept": 2, "segment": 8}, **(training or {})}
    return config_file(tmp_path, "dagger", training=own, env_kwargs=SEEN, **changes)


@pytest.mark.parametrize("memory", [{}, {"lstm_layers": 2}])
def test_a_network_acts_in_many_worlds_as_in_each(memory):
    from agents.policies.network import Architecture, Network

    shape = Architecture(
        inputs=12, n_stack=2, traces=(0.5,), hold=2, hidden=(4,), outputs=2, activation="tanh", output="clip",
        normalised=True, lstm_width=5 if memory else 0, **memory,
    )  # fmt: skip
    generator = np.random.default_rng(0)
    arrays = {name: np.abs(generator.normal(size=size)) for name, size in shape.shapes().items()}
    together, alone = Network(shape, arrays), [Network(shape, arrays) for _ in range(3)]
    together.reset(3)
    for _ in range(5):
        seen = generator.normal(size=(3, 3)).astype(np.float32)
        one_by_one = [network(row) for network, row in zip(alone, seen, strict=True)]
        # Sums of some ten numbers in double precision, added in another order.
        np.testing.assert_allclose(together(seen), one_by_one, atol=1e-13)
    with pytest.raises(InputError, match="expected \\(3, 3\\)"):
        together(seen[0])


def test_the_teacher_sees_its_own_and_the_student_no_more_than_its_own(teacher, tmp_path):
    """What the worlds of a training say is what the teacher says of the same episode, alone."""
    config = Config.read(student(tmp_path, teacher))
    worlds = wrapped(config, 3)
    taught = worlds.venv
    assert worlds.observation_space.shape == (2,)
    worlds.reset()
    env, policy = make(ENVIRONMENT, **WIDE), find_policy(str(teacher))
    seen, info = env.reset(seed=3)
    policy.reset(env)
    for _ in range(10):
        wanted = policy(seen, info)
        np.testing.assert_allclose(taught.advice[0], wanted, atol=1e-6)  # single precision
        np.testing.assert_array_equal(worlds.get_original_obs()[0], seen[:2])
        worlds.step(np.tile(wanted, (2, 1)))
        seen, _, _, _, info = env.step(wanted)
    worlds.close()


def test_a_policy_that_acts_in_one_world_at_a_time_teaches_too():
    one = Teacher("pid", ENVIRONMENT, {**SEEN, "action_mode": "pid_setpoint"})
    one.begin(3)
    np.testing.assert_array_equal(one.act(np.zeros((3, 100), np.float32)), [[0.0, 1.0]] * 3)


def test_the_student_learns_what_the_teacher_says(tmp_path):
    """A teacher that always says -1 (no tension) is learned in a few rounds by a network that begins near 0."""
    path = config_file(tmp_path, "dagger", learning_rate=0.03, n_epochs=10)
    assert train("--config", path, "--out", tmp_path / "run", "--set", "n_timesteps=400") == 0
    policy = LearnedPolicy.load(next((tmp_path / "run" / "checkpoints").glob("steps_0000000400")))
    env = make(ENVIRONMENT, **ENV_KWARGS)
    seen, info = env.reset(seed=1)
    policy.reset(env)
    assert np.abs(policy(seen, info) + 1.0).max() < 0.2


def test_a_student_acts_as_its_exported_form(teacher, tmp_path):
    config = Config.read(student(tmp_path, teacher))
    from agents.training.networks.extraction import Origin, extract

    worlds = wrapped(config, 3)
    model = build(config, worlds, 3)
    assert isinstance(model, Dagger)
    model.learn(80)
    policy = extract(model, make(ENVIRONMENT, **SEEN), Origin(ENVIRONMENT, "dagger"))
    generator, state = np.random.default_rng(0), None
    policy.begin(make(ENVIRONMENT, **SEEN), 2)
    for _ in range(5):
        seen = generator.normal(size=(2, 2)).astype(np.float32)
        inputs = torch.as_tensor(worlds.normalize_obs(seen), dtype=torch.float32)
        with torch.no_grad():
            mean, state = model.acting(inputs[None], state)
        np.testing.assert_allclose(policy.act(seen), np.clip(mean[0].numpy(), -1, 1), atol=1e-6)


def test_decisions_behind_an_episode_do_not_count():
    """Their loss is left out: with other advice there the same is learned."""
    demonstrations = [Demonstrations(2, (4, 1, 2, 1)) for _ in range(2)]
    live = np.array([[True], [True], [False], [False]])
    for one, behind in zip(demonstrations, (5.0, -5.0), strict=True):
        advice = np.where(live, 0.5, behind)[..., None].astype(np.float32)
        one.add(np.ones((4, 1, 2), np.float32), advice, live)
        one.add(np.ones((4, 1, 2), np.float32), advice, live)
        one.add(np.ones((4, 1, 2), np.float32), advice, live)
        assert one.episodes()[0].shape == (4, 2, 2)  # the last two of three rounds
    losses = []
    for one in demonstrations:
        torch.manual_seed(0)
        layer = torch.nn.Linear(2, 1)
        seen, advice, counted = (torch.as_tensor(x, dtype=torch.float32) for x in one.episodes())
        losses.append(fit_losses(layer, seen, advice, counted))
    assert losses[0] == losses[1] and len(losses[0]) == 1


def fit_losses(layer, seen, advice, counted):
    """Losses of Dagger's fit with a layer in place of a policy."""
    from agents.training.settings.imitation import Imitation

    class Student(Dagger):
        def __init__(self):
            self.imitation, self.max_grad_norm, self.policy = Imitation(teacher="none", segment=2), 1.0, layer
            layer.optimizer = torch.optim.Adam(layer.parameters())

        def acting(self, seen, state):
            return layer(seen), state

    return Student()._fit(seen, advice, counted)


def test_learning_goes_on_with_the_networks_of_another_policy(teacher, tmp_path):
    """With held networks the first policy is the student, and it stays it; then it learns on."""
    first, second = tmp_path / "student", tmp_path / "on"
    assert train("--config", student(tmp_path, teacher), "--out", first) == 0
    known, newest = initial_policy(str(first)), LearnedPolicy.load(Store(first / "checkpoints").latest())
    assert known.description.steps == newest.description.steps > 0, "the newest, not the one of the best return"
    path = config_file(
        tmp_path, "recurrent_ppo", training={"initial": "../student", "critic": ["privileged"], "held": 64},
        env_kwargs=SEEN,
        policy_kwargs="dict(net_arch=dict(pi=[8], vf=[8]), lstm_hidden_size=6, n_lstm_layers=2, enable_critic_lstm=False)",  # noqa: E501
    )  # fmt: skip
    assert train("--config", path, "--out", second, "--set", "n_timesteps=64") == 0
    held = LearnedPolicy.load(next((second / "checkpoints").glob("steps_0000000064")))
    layers = [name for name in known.arrays if name.startswith(("layer", "lstm"))]
    assert all(np.array_equal(held.arrays[name], known.arrays[name]) for name in layers)
    assert train("--resume", second, "--set", "n_timesteps=128") == 0
    after = LearnedPolicy.load(next((second / "checkpoints").glob("steps_0000000128")))
    assert not all(np.array_equal(after.arrays[name], known.arrays[name]) for name in layers)
    assert after.description.architecture == known.description.architecture


def test_a_recurrent_critic_sees_more_and_the_actor_does_not(tmp_path):
    path = config_file(tmp_path, "recurrent_ppo", training={"critic": ["privileged"]}, env_kwargs=SEEN)
    config = Config.read(path)
    model = build(config, wrapped(config, 0), 0)
    policy, n = model.policy, model.observation_space.shape[0]
    assert policy.seen == [0, 1] and policy.lstm_actor.input_size == 2 and policy.lstm_critic.input_size == n
    torch.manual_seed(0)
    seen = torch.randn(10, n)
    state = tuple(torch.randn(2, 2, 6) for _ in range(2))
    starts = torch.tensor([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    for lstm, inputs in ((policy.lstm_actor, seen[:, :2]), (policy.lstm_critic, seen)):
        quick, _ = policy._process_sequence(seen, state, starts, lstm)
        plain, _ = super(type(policy), policy)._process_sequence(inputs, state, starts, lstm)
        torch.testing.assert_close(quick, plain)
    later = torch.cat([starts[1:6], starts[:5]])
    inputs = seen[:, :2]
    quick, _ = policy._process_sequence(seen, state, later, policy.lstm_actor)
    plain, _ = super(type(policy), policy)._process_sequence(inputs, state, later, policy.lstm_actor)
    torch.testing.assert_close(quick, plain)


@pytest.mark.parametrize(
    "said, changes",
    [
        ("training.imitation.teacher: unknown policy 'nobody'", ["training.imitation.teacher=nobody"]),
        ("training.imitation.teacher: policy 'nowhere/else': there is no such folder",
         ["training.imitation.teacher=nowhere/else"]),
        ("acts by pid_setpoint: expected action_mode rope_tension", ["training.imitation.teacher=pid"]),
        ("teacher: policy '{teacher}' was trained with another control period",
         ["env_kwargs.control_rate=100"]),
        ("kept", ["training.imitation.kept=0"]),
        ("segment", ["training.imitation.segment=0"]),
        ("driven", ["training.imitation.driven=-1"]),
        ("dagger needs a teacher", ["training.imitation=null"]),
        ("training.imitation is for the algorithm dagger, not for recurrent_ppo", ["training.algorithm=recurrent_ppo"]),
        ("training.against does nothing with dagger", ["training.against=[0, 0]"]),
        ("training.held holds the networks of training.initial", ["training.held=10", "training.imitation=null",
                                                                  "training.algorithm=recurrent_ppo"]),
        ("training.initial: policy '{teacher}' was trained with another observation", ["training.initial={teacher}"]),
        ("dagger: unknown key 'gamma'", ["gamma=0.9"]),
    ],
)  # fmt: skip
def test_mistakes_are_named_and_leave_no_folder(said, changes, teacher, tmp_path, capsys):
    out = tmp_path / "run"
    path = student(tmp_path, teacher)
    assert train("--config", path, "--out", out, "--set", *(one.format(teacher=teacher) for one in changes)) == 2
    errors = capsys.readouterr().err
    assert said.format(teacher=teacher) in errors and errors.count("\n") == 1 and not out.exists()


def test_recurrent_weights_of_a_wrong_shape_are_refused(teacher, tmp_path, capsys):
    assert train("--config", student(tmp_path, teacher), "--out", tmp_path / "student") == 0
    path = config_file(tmp_path, "recurrent_ppo", training={"initial": "../student"}, env_kwargs=SEEN)
    capsys.readouterr()
    assert train("--config", path, "--out", tmp_path / "on", "--set", "policy_kwargs.lstm_hidden_size=7") == 2
    assert "lstm_width 6 in place of 7" in capsys.readouterr().err


def test_another_teacher_in_the_same_place_is_noticed(teacher, tmp_path, capsys):
    import shutil

    shutil.copytree(teacher, tmp_path / "teacher")
    out = tmp_path / "student"
    assert train("--config", student(tmp_path, "../teacher"), "--out", out, "--set", "n_timesteps=40") == 0
    shutil.rmtree(tmp_path / "teacher")
    path = config_file(tmp_path, env_kwargs=WIDE)
    assert train("--config", path, "--out", tmp_path / "teacher", "--seed", 5, "--set", "n_timesteps=32") == 0
    capsys.readouterr()
    assert train("--resume", out, "--set", "n_timesteps=80") == 2
    assert "content of the teacher was" in capsys.readouterr().err


def test_names_of_other_trainings_are_beside_the_own_folder(tmp_path):
    training = {"imitation": {"teacher": "../teacher_{seed}"}, "initial": "elsewhere/{seed}"}
    placed = Config.of(content("dagger", training=training), "dagger").placed(tmp_path / "runs" / "student_4", 4)
    assert placed.training.imitation.teacher == str(tmp_path / "runs" / "teacher_4")
    assert placed.training.initial == "elsewhere/4"
    assert Config.of(placed.content(), "").training == placed.training


def test_trainings_of_a_sweep_wait_for_those_that_they_learn_from(tmp_path):
    (tmp_path / "a").mkdir()
    student_file = config_file(tmp_path, "dagger", training={"imitation": {"teacher": "../ppo_{seed}"}})
    on = config_file(tmp_path, "recurrent_ppo", training={"initial": "../dagger_{seed}"})
    plan = planned((on, student_file, config_file(tmp_path)), (0, 1), (), tmp_path / "out")
    names = [[folder.rpartition("/")[2] for _, _, folder in group] for group in in_order(plan)]
    assert names == [["ppo_0", "ppo_1"], ["dagger_0", "dagger_1"], ["recurrent_ppo_0", "recurrent_ppo_1"]]
    content, seed, folder = plan[0]
    content["training"]["initial"] = folder
    with pytest.raises(InputError, match="wait for each other"):
        in_order([(content, seed, folder)])


def test_stored_demonstrations_that_do_not_fit_are_refused():
    one = Demonstrations(2, (4, 1, 2, 1))
    for _ in range(3):
        one.add(np.ones((4, 1, 2), np.float32), np.ones((4, 1, 1), np.float32), np.ones((4, 1), bool))
    stored = dict(one.columns)
    Demonstrations(2, (4, 1, 2, 1)).restore(stored)
    for wrong, size in (("seen", (2, (4, 1, 3, 1))), ("seen", (1, (4, 1, 2, 1)))):
        with pytest.raises(InputError, match=f"{wrong} does not fit"):
            Demonstrations(*size).restore(stored)
    short = {name: stored[name] for name in ("seen", "advice")}
    for bad in ({**stored, "advice": stored["advice"][:1]}, short, {**stored, "seen": stored["seen"] * np.nan}):
        with pytest.raises(InputError, match="does not fit"):
            Demonstrations(2, (4, 1, 2, 1)).restore(bad)


def test_vector_environments_have_a_length():
    """A round of an imitation is as long as this says."""
    assert make_vector(ENVIRONMENT, 1, **ENV_KWARGS).steps == 20


def test_arguments_of_dagger_are_those_of_its_signature():
    assert set(arguments(Config.of(content("dagger"), "dagger"))) == {"batch_size", "n_epochs", "policy_kwargs"}


def test_a_student_is_exported_as_all_others(tmp_path):
    """Its folder, and the model.zip that Stable-Baselines3 writes, give the same numbers."""
    out = tmp_path / "run"
    assert train("--config", config_file(tmp_path, "dagger", normalize=False), "--out", out) == 0
    assert main(["export", str(out), "--last", "--out", str(tmp_path / "policy")]) == 0
    exported = LearnedPolicy.load(tmp_path / "policy")
    model = next((out / "checkpoints").glob(f"*{exported.description.steps}")) / "model.zip"
    more = ["--trust", "--algorithm", "dagger", "--action-mode", "rope_tension", "--no-onnx"]
    assert main(["export", str(model), "--out", str(tmp_path / "zip"), *more]) == 0
    again = LearnedPolicy.load(tmp_path / "zip")
    assert all(np.array_equal(again.arrays[name], one) for name, one in exported.arrays.items())
    runtime = pytest.importorskip("onnxruntime")
    session = runtime.InferenceSession(str(tmp_path / "policy" / "policy.onnx"))
    inputs = {one.name: np.zeros(one.shape, np.float32) for one in session.get_inputs()}
    exported.network.reset()
    wanted = exported.network(np.zeros(exported.description.architecture.observed, np.float32))
    np.testing.assert_allclose(session.run(["action"], inputs)[0].ravel(), wanted, atol=1e-6)  # single precision
