"""The networks of trained policies in numpy: normalised observation, LSTM cells if any, layers, squashed output.

Numbers are double precision although PyTorch trains in single: what differs is PyTorch's own round-off.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import FailFast, Field, model_validator

from dms_core.errors import InputError
from dms_core.files.json_text import brief
from exo_env.settings import Settings

ACTIVATIONS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "tanh": np.tanh,
    "relu": lambda x: np.maximum(x, 0.0),
    "elu": lambda x: np.where(x > 0.0, x, np.expm1(np.minimum(x, 0.0))),
    "silu": lambda x: x * sigmoid(x),
    "leakyrelu": lambda x: np.where(x > 0.0, x, 0.01 * x),
}
"""Activations as PyTorch computes them with its default arguments."""


Count = Annotated[int, Field(strict=True, ge=0)]
Size = Annotated[int, Field(strict=True, ge=1, le=100_000)]
"""Of a layer or an observation; far more than any network here has, and too little to fill a memory."""
Share = Annotated[float, Field(strict=True, ge=0.0, lt=1.0)]
Positive = Annotated[float, Field(strict=True, gt=0.0)]


class Architecture(Settings):
    """Shape of a network; its numbers are arrays by name (`names`)."""

    inputs: Size = Field(description="components of what it sees, stacked observations included")
    n_stack: Size = Field(default=1, description="observations that it sees at once, the newest last")
    hold: Size = Field(default=1, description="control periods of an action; what comes between is not looked at")
    traces: Annotated[tuple[Share, ...], FailFast()] = Field(
        default=(), max_length=100,
        description="shares that low-pass filters of what it sees keep from action to action, a filter each",
    )  # fmt: skip
    hidden: Annotated[tuple[Size, ...], FailFast()] = Field(
        max_length=100, description="widths of the layers before the output"
    )
    outputs: Size = 2
    activation: str = Field(description="between the layers")
    lstm_layers: Count = Field(default=0, le=100, description="of LSTM cells before the layers")
    lstm_width: Count = Field(default=0, le=100_000)
    output: Literal["clip", "tanh"] = Field(description="how the output becomes an action from -1 to 1")
    normalised: bool = Field(strict=True, description="observations are normalised by `mean` and `variance`")
    clip: Positive = Field(default=10.0, description="largest normalised observation")
    epsilon: Positive = Field(default=1e-8, description="added to the variance")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        """Inputs are whole observations, and cells have a width."""
        parts = self.n_stack * (1 + len(self.traces))
        if self.inputs % parts:
            raise ValueError(f"inputs = {self.inputs}: expected a multiple of n_stack and filters, {parts}")
        if self.lstm_layers and not self.lstm_width:
            raise ValueError("lstm_width = 0: expected a number of at least 1 where there are LSTM cells")
        return self

    @property
    def observed(self) -> int:
        """Components of one observation."""
        return self.inputs // (self.n_stack * (1 + len(self.traces)))

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shape of each array."""
        shapes: dict[str, tuple[int, ...]] = {}
        if self.normalised:
            shapes |= {"mean": (self.inputs,), "variance": (self.inputs,)}
        width, gates = self.inputs, 4 * self.lstm_width
        for k in range(self.lstm_layers):
            shapes |= {f"lstm.{k}.input": (gates, width), f"lstm.{k}.state": (gates, self.lstm_width)}
            shapes |= {f"lstm.{k}.input_bias": (gates,), f"lstm.{k}.state_bias": (gates,)}
            width = self.lstm_width
        for k, size in enumerate((*self.hidden, self.outputs)):
            shapes |= {f"layer.{k}.weight": (size, width), f"layer.{k}.bias": (size,)}
            width = size
        return shapes


class Network:
    """A network that acts.

    Args:
        shape: of the network.
        arrays: its numbers.

    Raises:
        InputError: an array is missing, has another shape or is not finite.
    """

    def __init__(self, shape: Architecture, arrays: Mapping[str, np.ndarray]) -> None:
        if shape.activation not in ACTIVATIONS:
            named = brief(shape.activation, 60)
            raise InputError(f"activation '{named}' is unknown; there are {', '.join(ACTIVATIONS)}.")
        for name, expected in shape.shapes().items():
            if name not in arrays:
                raise InputError(f"the weights lack '{name}'.")
            if arrays[name].shape != expected:
                raise InputError(f"weights '{name}' have shape {arrays[name].shape}: expected {expected}.")
            if not np.isfinite(arrays[name]).all():
                raise InputError(f"weights '{name}' are not finite.")
        if shape.normalised and (arrays["variance"] < 0.0).any():
            raise InputError("weights 'variance' are below 0.")
        self.shape = shape
        self._arrays = {name: np.asarray(arrays[name], dtype=float) for name in shape.shapes()}
        self._activation = ACTIVATIONS[shape.activation]
        self.reset()

    def reset(self, *worlds: int) -> None:
        """Forget what was seen.

        Args:
            worlds: number of worlds that it acts in at once from now on; without it one, whose arrays have no axis for
                worlds.
        """
        s = self.shape
        self._observed = (*worlds, s.observed)
        self._seen = np.zeros((*worlds, s.inputs // (1 + len(s.traces))), dtype=np.float32)
        self._memory: np.ndarray | None = None
        self._action, self._left = np.zeros((*worlds, s.outputs)), 0
        self._hidden = np.zeros((s.lstm_layers, *worlds, s.lstm_width))
        self._cell = np.zeros((s.lstm_layers, *worlds, s.lstm_width))

    def __call__(self, observation: np.ndarray) -> np.ndarray:
        """The action that the policy holds best, shape (outputs,) or (worlds, outputs), after one more observation.

        Raises:
            InputError: the observation has not the shape of those in training.
        """
        if observation.shape != self._observed:
            raise InputError(f"the observation has shape {observation.shape}: expected {self._observed}.")
        if self._left == 0:
            self._action, self._left = self._decided(observation), self.shape.hold
        self._left -= 1
        return self._action.copy()

    def _decided(self, observation: np.ndarray) -> np.ndarray:
        """A new action."""
        s = self.shape
        self._seen = np.concatenate([self._seen[..., s.observed :], observation.astype(np.float32)], axis=-1)
        x = self.normalise(self._remembered())
        for k in range(s.lstm_layers):
            x = self._lstm(k, x)
        last = len(s.hidden)
        for k in range(last + 1):
            x = x @ self._arrays[f"layer.{k}.weight"].T + self._arrays[f"layer.{k}.bias"]
            x = self._activation(x) if k < last else x
        return np.tanh(x) if s.output == "tanh" else np.clip(x, -1.0, 1.0)

    def _remembered(self) -> np.ndarray:
        """What is seen, followed by what the filters make of it."""
        if not self.shape.traces:
            return self._seen
        seen = self._seen[..., None, :]
        kept = np.array(self.shape.traces)[:, None]
        if self._memory is None:
            self._memory = np.repeat(seen, len(kept), axis=-2).astype(float)
        self._memory += (1.0 - kept) * (seen - self._memory)
        filtered = self._memory.reshape(*self._seen.shape[:-1], -1)
        return np.concatenate([self._seen, filtered], axis=-1, dtype=np.float32)

    def normalise(self, seen: np.ndarray) -> np.ndarray:
        """What the first layer gets."""
        s = self.shape
        if not s.normalised:
            return seen.astype(float)
        scaled = (seen - self._arrays["mean"]) / np.sqrt(self._arrays["variance"] + s.epsilon)
        return np.clip(scaled, -s.clip, s.clip)

    def _lstm(self, k: int, x: np.ndarray) -> np.ndarray:
        """One cell of layer k (Hochreiter and Schmidhuber 1997, with forget gate), gates in PyTorch's order."""
        a, h, c = self._arrays, self._hidden[k], self._cell[k]
        gates = x @ a[f"lstm.{k}.input"].T + a[f"lstm.{k}.input_bias"]
        gates = gates + h @ a[f"lstm.{k}.state"].T + a[f"lstm.{k}.state_bias"]
        enter, forget, new, leave = np.split(gates, 4, axis=-1)
        c = sigmoid(forget) * c + sigmoid(enter) * np.tanh(new)
        h = sigmoid(leave) * np.tanh(c)
        self._hidden[k], self._cell[k] = h, c
        return h


def sigmoid(x: np.ndarray) -> np.ndarray:
    """1 / (1 + exp(-x)), by tanh, which does not overflow."""
    return 0.5 * (1.0 + np.tanh(0.5 * x))
