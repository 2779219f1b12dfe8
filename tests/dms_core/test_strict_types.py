"""A number in quotes is text and true is no number, in every class of settings; NumPy's numbers are numbers."""

from __future__ import annotations

from decimal import Decimal
from typing import Any, Literal

import numpy as np
import pytest
from pydantic import Field, model_validator

import exo_env.envs.elbow_lift
import exo_env.paper.scenarios  # noqa: F401
from dms_core.errors import InputError, ModelError
from dms_core.model import PointMass, RigidBody
from dms_core.validation import Checked


class _Part(Checked):
    size: float = 1.0


class _Thing(Checked):
    number: float = Field(default=1.0, gt=0.0)
    count: int = Field(default=1, ge=1)
    flag: bool = True
    point: tuple[float, float] = (0.0, 0.0)
    path: tuple[int, ...] = ()
    weights: dict[str, float] = {}
    maybe: float | None = None
    value: float | str = 0.0
    side: Literal["left", 1] = "left"
    part: _Part = _Part()

    @model_validator(mode="after")
    def _checked(self):
        return self


@pytest.mark.parametrize("value", ["1.8", "1", True, False, b"1", np.bool_(True)])
@pytest.mark.parametrize("key", ["number", "count", "point", "path", "weights", "maybe", "part"])
def test_what_is_no_number_is_refused(key, value):
    inside = {"point": (value, 0.0), "path": [value], "weights": {"a": value}, "part": {"size": value}}
    with pytest.raises(InputError, match="Expected a (whole )?number"):
        _Thing(**{key: inside.get(key, value)})


@pytest.mark.parametrize("value", ["true", "yes", 1, 0, 1.0, np.int64(1), None])
def test_what_is_no_truth_value_is_refused(value):
    with pytest.raises(InputError, match="flag = .*: Expected true or false"):
        _Thing(flag=value)


@pytest.mark.parametrize("value", [2, 2.0, np.float32(2), np.float64(2), np.int32(2), np.uint8(2), np.array(2.0)])
def test_numbers_of_all_kinds_are_taken(value):
    found = _Thing(
        number=value, count=value, point=[value, value], path=[value], weights={"a": value}, maybe=value, value=value,
        part={"size": value}, flag=np.bool_(False),
    )  # fmt: skip
    assert found == _Thing(
        number=2.0, count=2, point=(2.0, 2.0), path=(2,), weights={"a": 2.0}, maybe=2.0, value=2.0,
        part=_Part(size=2.0), flag=False,
    )  # fmt: skip
    assert type(found.number) is float and type(found.count) is int
    assert _Thing(number=Decimal("1.5")).number == 1.5


def test_arrays_are_lists_of_numbers():
    assert _Thing(point=np.array([1.0, 2.0]), path=np.arange(3)).path == (0, 1, 2)


@pytest.mark.parametrize("value", [1.5, np.float32(1.5), float("nan"), float("inf"), 1e300])
def test_whole_numbers_are_whole(value):
    with pytest.raises(InputError, match="count = .*Expected a (whole|finite) number"):
        _Thing(count=value)


def test_a_text_is_text_where_both_may_stand():
    assert _Thing(value="1.8").value == "1.8"
    with pytest.raises(InputError, match="value"):
        _Thing(value=True)


def test_elements_are_strict():
    with pytest.raises(ModelError, match=r"rigid_body 'rod': mass = '1.8': Expected a number"):
        RigidBody(name="rod", mass="1.8", inertia=(1, 1, 1))
    with pytest.raises(ModelError, match=r"inertia.1 = True: Expected a number"):
        RigidBody(name="rod", mass=1, inertia=(1, True, 1))
    assert PointMass(name="m", mass=np.float32(0.5), position=np.zeros(3)).mass == 0.5


def test_a_key_named_self_is_unknown():
    with pytest.raises(InputError, match="unknown key 'self'"):
        _Thing(**{"self": 1})


def test_messages_are_bounded():
    with pytest.raises(InputError) as caught:
        _Thing(path=["x" * 10_000] * 10_000, **{f"k{i}\n": i for i in range(1000)})
    lines = str(caught.value).splitlines()
    assert len(lines) == 6 and lines[-1] == "_Thing: 9996 further mistakes."
    # A file of another kind is known by its keys.
    assert lines[0].startswith("_Thing: unknown keys 'k0") and " and 995 others. Allowed: " in lines[0]
    assert max(map(len, lines)) < 200 and str(caught.value).replace("\n", "").isprintable()
    with pytest.raises(InputError, match="thousands of digits"):
        _Thing(number=10**5000)


def _classes(of: type) -> Any:
    for cls in of.__subclasses__():
        yield cls
        yield from _classes(cls)


def _lax(schema: Any, owner: type) -> list[str]:
    """Kinds of numbers and truth values in a class's schema that stand without our check."""
    if isinstance(schema, list | tuple):
        return [kind for part in schema for kind in _lax(part, owner)]
    if not isinstance(schema, dict) or schema.get("type") == "model" and schema["cls"] is not owner:
        return []
    kind = schema.get("type")
    if kind == "function-before" and schema["schema"].get("type") in ("float", "int"):
        return []
    if kind in ("float", "int") or kind == "bool" and not schema.get("strict"):
        return [kind]
    return [k for key, part in schema.items() if key not in ("default", "metadata") for k in _lax(part, owner)]


def test_no_class_is_lax():
    classes = set(_classes(Checked))
    assert len(classes) > 80
    assert not {cls.__name__: found for cls in classes if (found := _lax(cls.__pydantic_core_schema__, cls))}


def test_a_message_keeps_both_ends():
    said = str(InputError("load = " + "x" * 100_000 + ": expected a number."))
    assert len(said) < 4100 and said.startswith("load = x") and said.endswith("x: expected a number.")
