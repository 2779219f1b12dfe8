"""A policy as ONNX (https://onnx.ai), normalisation and squashing included, for runtimes outside Python.

Inputs are `observation`, shape (1, inputs), stacked and filtered ones (traces.py) included, and for LSTM cells `hidden`
and `cell`, shape (layers, width), zeros at the start of an episode; outputs are `action` and the new `hidden` and
`cell`. An action is for `hold` control periods (policy.json). Numbers are double precision inside, as in network.py.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from dms_core.errors import DmsError, extra
from dms_core.files.output_file import write_bytes

from ..policies.learned import LearnedPolicy
from ..policies.network import Architecture

OPSET, IR_VERSION = 17, 9
"""Old enough for the runtimes of 2023 and later."""


def write_onnx(policy: LearnedPolicy, path: Path) -> None:
    """Write a policy.

    Raises:
        DmsError: the package onnx is missing.
    """
    try:
        import onnx
    except ImportError:
        raise DmsError(f"ONNX needs the package onnx. {extra('export')}") from None
    graph = _Graph(policy)
    model = onnx.helper.make_model(
        graph.made(), producer_name="exo_env", producer_version=policy.description.exo_env,
        opset_imports=[onnx.helper.make_opsetid("", OPSET)], ir_version=IR_VERSION,
    )  # fmt: skip
    onnx.checker.check_model(model, full_check=True)
    write_bytes(path, model.SerializeToString())


class _Graph:
    """Nodes of a policy, in order."""

    def __init__(self, policy: LearnedPolicy) -> None:
        import onnx

        self.helper, self.numpy, self.types = onnx.helper, onnx.numpy_helper, onnx.TensorProto
        self.shape: Architecture = policy.description.architecture
        self.arrays = {name: np.asarray(policy.arrays[name], dtype=np.float64) for name in self.shape.shapes()}
        self.nodes: list[Any] = []
        self.constants: list[Any] = []

    def made(self) -> Any:
        """The graph."""
        s, tensor = self.shape, self.helper.make_tensor_value_info
        inputs = [tensor("observation", self.types.FLOAT, [1, s.inputs])]
        outputs = [tensor("action", self.types.FLOAT, [1, s.outputs])]
        x = self.node("Cast", "observation", to=self.types.DOUBLE)
        if s.normalised:
            x = self._normalised(x)
        if s.lstm_layers:
            states = [s.lstm_layers, s.lstm_width]
            inputs += [tensor(name, self.types.FLOAT, states) for name in ("hidden", "cell")]
            outputs += [tensor(name, self.types.FLOAT, states) for name in ("new_hidden", "new_cell")]
            x = self._lstm(x)
        for k in range(len(s.hidden) + 1):
            x = self._linear(x, f"layer.{k}.weight", f"layer.{k}.bias")
            x = self._activated(x) if k < len(s.hidden) else x
        x = self.node("Tanh", x) if s.output == "tanh" else self._clipped(x, 1.0)
        self.node("Cast", x, to=self.types.FLOAT, name="action")
        return self.helper.make_graph(self.nodes, "policy", inputs, outputs, self.constants)

    def node(self, kind: str, *inputs: str, name: str | None = None, **attributes: Any) -> str:
        """One more node; its output's name."""
        name = name or f"{kind}_{len(self.nodes)}"
        self.nodes.append(self.helper.make_node(kind, list(inputs), [name], **attributes))
        return name

    def constant(self, value: Any, name: str | None = None) -> str:
        """One more constant; its name."""
        name = name or f"constant_{len(self.constants)}"
        self.constants.append(self.numpy.from_array(np.asarray(value), name))
        return name

    def _normalised(self, x: str) -> str:
        a, s = self.arrays, self.shape
        x = self.node("Sub", x, self.constant(a["mean"][None]))
        x = self.node("Div", x, self.constant(np.sqrt(a["variance"] + s.epsilon)[None]))
        return self._clipped(x, s.clip)

    def _clipped(self, x: str, most: float) -> str:
        x = self.node("Min", x, self.constant(np.array(most)))
        return self.node("Max", x, self.constant(np.array(-most)))

    def _linear(self, x: str, weight: str, bias: str) -> str:
        x = self.node("MatMul", x, self.constant(self.arrays[weight].T, weight))
        return self.node("Add", x, self.constant(self.arrays[bias][None], bias))

    def _activated(self, x: str) -> str:
        """An activation, from nodes that runtimes have in double precision."""
        zero, kind = self.constant(np.array(0.0)), self.shape.activation
        if kind == "silu":
            return self.node("Mul", x, self.node("Sigmoid", x))
        if kind == "elu":
            below = self.node("Sub", self.node("Exp", self.node("Min", x, zero)), self.constant(np.array(1.0)))
            return self.node("Add", self.node("Max", x, zero), below)
        if kind == "leakyrelu":
            return self.node("Max", x, self.node("Mul", x, self.constant(np.array(0.01))))
        return self.node("Tanh", x) if kind == "tanh" else self.node("Max", x, zero)

    def _lstm(self, x: str) -> str:
        """All cells, from plain nodes: runtimes have the LSTM operator in single precision only."""
        rows: list[list[str]] = [[], []]
        for k in range(self.shape.lstm_layers):
            h, c = (self._row(name, k) for name in ("hidden", "cell"))
            gates = self._linear(x, f"lstm.{k}.input", f"lstm.{k}.input_bias")
            gates = self.node("Add", gates, self._linear(h, f"lstm.{k}.state", f"lstm.{k}.state_bias"))
            parts = [f"gate_{k}_{part}" for part in ("enter", "forget", "new", "leave")]
            split = self.constant(np.full(4, self.shape.lstm_width))
            self.nodes.append(self.helper.make_node("Split", [gates, split], parts, axis=1))
            enter, forget, leave = (self.node("Sigmoid", parts[n]) for n in (0, 1, 3))
            kept, added = self.node("Mul", forget, c), self.node("Mul", enter, self.node("Tanh", parts[2]))
            c = self.node("Add", kept, added)
            x = self.node("Mul", leave, self.node("Tanh", c))
            rows[0].append(x)
            rows[1].append(c)
        for name, parts in zip(("new_hidden", "new_cell"), rows, strict=True):
            self.node("Cast", self.node("Concat", *parts, axis=0), to=self.types.FLOAT, name=name)
        return x

    def _row(self, name: str, k: int) -> str:
        """State of one layer, shape (1, width)."""
        x = self.node("Gather", name, self.constant(np.array([k])), axis=0)
        return self.node("Cast", x, to=self.types.DOUBLE)
