"""The environment exo/ElbowLift-v0."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium import spaces

from dms_core import SolverOptions
from dms_core.config_files import configs
from dms_core.errors import InputError, choices
from dms_core.results import Result
from exo_env import rewards
from exo_env.actions import checked_action, drive
from exo_env.distributions import distribution
from exo_env.ecosystem import Ecosystem
from exo_env.episode import Episode
from exo_env.events import Limits, event
from exo_env.exoskeleton import Exoskeleton
from exo_env.human import MUSCLES
from exo_env.observations import PREVIEW, Observer, Slice, patient_channels
from exo_env.population import Source, population
from exo_env.repetition import Repetition, Repetitions
from exo_env.scene import Scene

OPTIONS = ("patient", "load", "reference", "initial_angle_deg")
SMALLEST_STEP, MOST_STEPS = 1e-9, 500_000
"""Of the solver in one episode: a run that needs less [s], or more, has failed."""


class ElbowLiftEnv(gymnasium.Env):
    """The real docstring stands in `lift_page.py` and is put here below."""

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["human", "rgb_array"], "render_fps": 50}

    def __init__(
        self,
        *,
        patient: Source = "mixed",
        load: float | Mapping[str, Any] | None = None,
        exoskeleton: str | Mapping[str, Any] | None = None,
        reference: Mapping[str, Any] | None = None,
        action_mode: str = "rope_tension",
        drive_settings: Mapping[str, Any] | None = None,
        observation: Sequence[str] = ("device",),
        noise: bool | Mapping[str, Any] = True,
        reward_weights: Mapping[str, float] | None = None,
        limits: Mapping[str, float] | None = None,
        control_rate: float = 50.0,
        episode_duration: float = 6.0,
        rtol: float = 1e-2,
        render_mode: str | None = None,
    ) -> None:
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            modes = choices(self.metadata["render_modes"])
            raise InputError(f"render_mode = {render_mode!r}; one of {modes} is wanted, or None.")
        for name, value, low, high in (
            ("control_rate", control_rate, 5.0, 1000.0),
            ("episode_duration", episode_duration, 0.1, 120.0),
            ("rtol", rtol, 1e-8, 5e-2),
        ):
            if not low <= value <= high:
                raise InputError(f"{name} = {value!r}; a number from {low:g} to {high:g} is wanted.")
        self.render_mode = render_mode
        self.metadata = {**type(self).metadata, "render_fps": round(control_rate)}
        self.period, self.duration = 1.0 / control_rate, float(episode_duration)
        self.population = population(patient)
        self.load = _load(load)
        self.repetitions = Repetitions.of(reference)
        self.ecosystem = Ecosystem(device=_device(exoskeleton))
        self.action_mode, self.drive = action_mode, drive(action_mode, dict(drive_settings or {}))
        self.weights, self.limits = rewards.Weights(**(reward_weights or {})), Limits(**(limits or {}))
        self.solver = SolverOptions(rtol=rtol, h_min=SMALLEST_STEP, max_steps=MOST_STEPS)
        self.observer = Observer(observation, noise, self.period)
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
        self.observation_space = spaces.Box(*self.observer.limits, dtype=np.float32)
        self._settings = {
            "patient": patient, "load": load, "exoskeleton": exoskeleton, "reference": reference,
            "action_mode": action_mode, "drive_settings": drive_settings, "observation": observation, "noise": noise,
            "reward_weights": reward_weights, "limits": limits, "control_rate": control_rate,
            "episode_duration": episode_duration, "rtol": rtol, "render_mode": render_mode,
        }  # fmt: skip
        self._episode: Episode | None = None
        self._over = False
        self._renderer: Any = None

    @property
    def observation_structure(self) -> tuple[Slice, ...]:
        """Group, name, place, unit, scale and range of each part of the observation, in order."""
        return self.observer.structure

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """A new patient at the start of a repetition.

        Args:
            seed: of the environment's one generator.
            options: may fix 'patient' (whatever the constructor takes), 'load' [kg], 'reference' (fields of a
                repetition) and 'initial_angle_deg' [deg]. What is fixed is drawn all the same, so that nothing else
                changes.

        Raises:
            InputError: an option is unknown or not usable.
        """
        super().reset(seed=seed)
        options = options or {}
        for name in options:
            if name not in OPTIONS:
                raise InputError(f"reset option '{name}' is unknown; there are {choices(OPTIONS)}.")
        self._over, self._episode = True, None
        self._begin(options)
        self._over = False
        self._read()
        observation = self.observer.observe(self._reading(), self.np_random, first=True)
        self._last = observation
        if self.render_mode == "human":
            self.render()
        return observation.copy(), self._start_info()

    def _begin(self, options: Mapping[str, Any]) -> None:
        """Draw an episode; two generators of the same draws keep what is fixed from shifting what is not."""
        patients, loads, repetitions = self.population, self.load, self.repetitions
        patient = patients.sample(self.np_random)
        load = float(loads.quantile(self.np_random.random()))
        repetition = repetitions.sample(self.np_random)
        seed = int(self.np_random.integers(2**63))
        fixed = np.random.default_rng(seed)
        if "patient" in options:
            patient = population(options["patient"]).sample(fixed)
        if "load" in options:
            load = float(_load(options["load"]).quantile(fixed.random()))
        if "reference" in options:
            repetition = Repetitions.of(options["reference"]).sample(fixed)
        start_deg = options.get("initial_angle_deg", repetition.start_deg)
        if not self.limits.lowest_deg <= start_deg <= self.limits.highest_deg:
            low, high = self.limits.lowest_deg, self.limits.highest_deg
            raise InputError(f"initial_angle_deg = {start_deg!r}; a number from {low:g} to {high:g} is wanted.")
        self._episode = self._simulated(patient, load, repetition, math.radians(start_deg))
        self._step = 0
        self._action = np.zeros(2)
        self._result = Result.SUCCESS

    def _simulated(self, patient: Any, load: float, repetition: Repetition, start: float) -> Episode:
        episode = Episode(
            ecosystem=self.ecosystem.changed(weight=load), mode=self.action_mode, drive=self.drive, patient=patient,
            repetition=repetition, start=start, period=self.period, duration=self.duration, generator=self.np_random,
            options=self.solver,
        )  # fmt: skip
        n = episode.names
        self._y = np.zeros(len(n))
        self._at = np.array([n[name] for name in _READ])
        self._muscle_force = np.array([n[f"{m}.sensor.tendon_force"] for m in MUSCLES])
        self._muscle_activation = np.array([n[f"{m}.sensor.activation"] for m in MUSCLES])
        self._course = episode.reference(episode.times)
        ahead = [np.minimum(episode.times + t, self.duration) for t in PREVIEW]
        self._preview = np.stack([episode.reference(times)[:, 0] for times in ahead], axis=1)
        self._patient_row = {c.name: getattr(patient, c.name) for c in patient_channels()}
        # How the guide pushes: along the plane's normal, the x axis of the lower link.
        self._axes = episode.worn.axes
        return episode

    @property
    def episode(self) -> Episode:
        """The present episode.

        Raises:
            DmsError: `reset` was not called.
        """
        if self._episode is None:
            raise gymnasium.error.ResetNeeded("The environment has no episode; call reset() first.")
        return self._episode

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Hold an action over one control period.

        Args:
            action: two numbers; beyond -1 to 1 they are clipped.

        Raises:
            InputError: the action has another shape or is not finite.
            gymnasium.error.ResetNeeded: there is no episode, or it is over.
        """
        episode, used = self.episode, checked_action(action)
        if self._over:
            raise gymnasium.error.ResetNeeded("The episode is over; call reset() before the next step().")
        k, before = self._step, self._action
        excitations = episode.effort.step(
            episode.wanted[k], error=self._course[k, 0] - self._angle, rate=self._rate, share=self._share
        )
        episode.advance(k, self.drive.held(used, episode.held, self.period), excitations)
        self._step, self._action, self._result = k + 1, used, episode.world.result
        happened = self._failure()
        if happened is None:
            self._read()
            self._last = self.observer.observe(self._reading(), self.np_random, first=False)
            happened = event(self.limits, self._angle, self._tensions, self._reaction)
        found = rewards.terms(
            error=self._angle - self._course[k + 1, 0], moment=self._exo_moment, reaction=self._reaction, action=used,
            before=before, unsafe=happened is not None,
        )  # fmt: skip
        terminated, truncated = happened is not None, k + 1 == len(episode.times) - 1
        self._over = terminated or truncated
        if self.render_mode == "human":
            self.render()
        return self._last.copy(), rewards.total(found, self.weights), terminated, truncated, self._info(found, happened)

    def _failure(self) -> str | None:
        """The sentence of a solver that gave up, or None."""
        if self._result is not Result.SUCCESS:
            return f"{self._result.value} Stopped at t = {self.episode.world.time:.6g} s."
        return None

    def _read(self) -> None:
        """True readings at the present time, and what follows from them."""
        self.episode.world.read(self._y)
        y = self._y[self._at]
        self._angle, self._rate, self._hinge, self._hinge_rate = map(float, y[:4])
        self._tensions = np.maximum(y[4:6], 0.0)
        self._muscle_moment, self._exo_moment = float(y[6]), float(y[7])
        self._reaction = float(np.linalg.norm(y[8:11]))
        normal = self._axes @ (math.cos(self._hinge), math.sin(self._hinge), 0.0)
        self._guide = float(y[11:14] @ normal)
        self._share = device_share(self._muscle_moment, self._exo_moment)

    def _reading(self) -> dict[str, Any]:
        """What the channels show, [unit of the channel]."""
        k, effort = self._step, self.episode.effort
        return {
            "angle": self._hinge, "rate": self._hinge_rate, "tension": self._tensions, "guide_force": self._guide,
            "reference": self._course[k, 0], "reference_rate": self._course[k, 1], "preview": self._preview[k],
            "last_action": self._action, "emg": self._y[self._muscle_activation], **self._patient_row,
            "load": self.episode.ecosystem.weight, "muscle_force": self._y[self._muscle_force],
            "fatigued": effort.fatigued, "effort": effort.effort, "device_share": self._share,
        }  # fmt: skip

    def readings(self) -> dict[str, float]:
        """Everything of the paper's figures 9 to 13 at the present time, without noise: every sensor of the model.

        Beside them 'time' [s], 'reference' [rad], 'tracking_error' [rad], 'elbow_reaction' [N], 'device_share',
        'effort' [-], the inputs held, and counts and worst errors of the solver. Units: `reading_units()`.
        """
        episode = self.episode
        found = {name: float(self._y[k]) for name, k in episode.names.items()}
        found |= {
            "time": episode.world.time, "reference": float(self._course[self._step, 0]),
            "tracking_error": self._angle - float(self._course[self._step, 0]), "elbow_reaction": self._reaction,
            "device_share": self._share, "effort": episode.effort.effort,
        }  # fmt: skip
        found |= {name: float(x) for name, x in zip(self.drive.inputs, episode.held, strict=True)}
        return found | {f"solver.{name}": float(x) for name, x in episode.world.stats().as_dict().items()}

    def reading_units(self) -> dict[str, str]:
        """Unit of each sensor in `readings`."""
        return dict(self.episode.model.layout.outputs)

    def _start_info(self) -> dict[str, Any]:
        """What the episode is made of."""
        e = self.episode
        return {
            "patient": e.patient.model_dump(),
            "load": float(e.ecosystem.weight),
            "reference": e.repetition.model_dump(),
            "initial_angle_deg": math.degrees(self._angle),
        }

    def _info(self, found: dict[str, float], happened: str | None) -> dict[str, Any]:
        """Of a step."""
        info: dict[str, Any] = {
            "reward_terms": dict(found),
            "reward_weights": self.weights.model_dump(),
            "time": float(self.episode.times[self._step]),
            "tracking_error_deg": math.degrees(self._angle - self._course[self._step, 0]),
            "device_share": self._share,
            "effort": self.episode.effort.effort,
            "elbow_reaction": self._reaction,
            "solver_failed": self._result is not Result.SUCCESS,
        }
        if happened is not None:
            info["event"] = happened
        return info

    def scene(self) -> Scene:
        """What a picture shows of the present time."""
        from exo_env.staging import staged

        episode = self.episode
        k = self._step
        return staged(
            episode, self._angle, self._hinge, float(self._course[k, 0]), self._tensions,
            self._y[self._muscle_activation], self._label(),
        )  # fmt: skip

    def _label(self) -> str:
        """Names the patient in a picture."""
        p = self.episode.patient
        title = self.population.title or "patient"
        flexors, extensors = p.maximum_activation_flexors, p.maximum_activation_extensors
        return f"{title}: flexors {flexors:.0%}, extensors {extensors:.0%}"

    def render(self) -> np.ndarray | None:
        """The arm from the side: an array of shape (480, 480, 3) in mode 'rgb_array', a window in mode 'human'."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() was called without a render_mode; give one to gymnasium.make.")
            return None
        if self._renderer is None:
            from exo_env.rendering import Renderer

            self._renderer = Renderer(self.render_mode, fps=self.metadata["render_fps"])
        return self._renderer.draw(self.scene())

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def __getstate__(self) -> dict[str, Any]:
        """Settings and generator; the episode's compiled world stays behind, and a copy must be reset."""
        return {"settings": self._settings, "generator": self._np_random, "seed": self._np_random_seed}

    def __setstate__(self, state: dict[str, Any]) -> None:
        type(self).__init__(self, **state["settings"])
        self._np_random, self._np_random_seed = state["generator"], state["seed"]


_READ = (
    "elbow_angle.angle", "elbow_angle.rate", "exo_angle.angle", "exo_angle.rate", "agonist_tension",
    "antagonist_tension", "muscle_moment", "exo_moment", *(f"elbow_reaction.F{x}" for x in "xyz"),
    *(f"guide_force.F{x}" for x in "xyz"),
)  # fmt: skip
"""Sensors that a step needs."""


def device_share(muscles: float, device: float) -> float:
    """What the device carries of the moment that both give, from 0 to 1 [-].

    Args:
        muscles: moment of the muscles [Nm].
        device: moment of the device [Nm].
    """
    both = muscles + device
    if both == 0.0:
        return 0.0
    way = math.copysign(1.0, both)
    carried, own = max(way * device, 0.0), max(way * muscles, 0.0)
    return carried / (carried + own)


def _load(load: float | Mapping[str, Any] | None) -> Any:
    """Distribution of the weight on the machine [kg]."""
    spec = {"uniform": [0.5, 2.0]} if load is None else load
    try:
        found = distribution(spec)
        if any(isinstance(x, str) or not 0.05 <= x <= 50.0 for x in found.limits()):
            raise InputError("numbers from 0.05 to 50 kg are wanted.")
    except InputError as error:
        raise InputError(f"load = {load!r}: {error}") from None
    return found


def _device(source: str | Mapping[str, Any] | None) -> Exoskeleton:
    """A shipped device by name, or the default with some values changed."""
    shipped = sorted(p.stem for p in (configs() / "exoskeletons").glob("*.yaml"))
    if source is None or isinstance(source, Mapping):
        return Exoskeleton.from_config("exoskeletons/elbow.yaml").changed(**(source or {}))
    if source not in shipped:
        raise InputError(f"exoskeleton = {source!r}; a mapping or one of {choices(shipped)} is wanted.")
    return Exoskeleton.from_config(f"exoskeletons/{source}.yaml")
