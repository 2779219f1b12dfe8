"""What pydantic finds wrong is said in plain sentences, for the types of mistakes that users make."""

from __future__ import annotations

import math
from typing import ClassVar, Literal

import numpy as np
import pytest
from pydantic import Field, field_validator, model_validator

from dms_core.errors import InputError, ModelError
from dms_core.validation import Checked


class _Part(Checked):
    size: float = 1.0


class _Whole(Checked):
    """Refused as a whole by a check of our own, as settings that ask other settings are."""

    part: float = 0.0

    @model_validator(mode="after")
    def _refused(self):
        raise InputError("expected something else.")


class _Thing(Checked):
    kind: ClassVar[str] = "thing"
    name: str = Field(default="box", min_length=1)
    number: float = Field(default=1.0, gt=0.0, le=5.0)
    share: float = Field(default=0.5, ge=0.0, lt=1.0)
    count: int = 1
    flag: bool = True
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    path: tuple[float, ...] = Field(default=(1.0, 2.0), min_length=2, max_length=4)
    side: Literal["left", "right"] = "left"
    part: _Part = _Part()

    @field_validator("count")
    @classmethod
    def _even(cls, value):
        if value == 13:
            raise ValueError("13 brings bad luck; take 12")
        return value


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"number": -1}, "thing 'box': number = -1: Expected a number above 0."),
        ({"number": 6.0}, "thing 'box': number = 6.0: Expected a number of at most 5."),
        ({"share": -0.5}, "thing 'box': share = -0.5: Expected a number of at least 0."),
        ({"share": 1.0}, "thing 'box': share = 1.0: Expected a number below 1."),
        ({"number": "heavy"}, "thing 'box': number = 'heavy': Expected a number."),
        ({"number": np.float64(-1.0)}, "thing 'box': number = -1.0: Expected a number above 0."),
        ({"path": [np.float64(1.0)]}, "thing 'box': path = [1.0]: Expected at least 2 items, got 1."),
        ({"point": np.array([1.0, 2.0])}, "thing 'box': point = [1.0, 2.0]: Expected 3 items, got 2."),
        ({"number": None}, "thing 'box': number = None: Expected a number."),
        ({"number": math.nan}, "thing 'box': number = nan: Expected a finite number."),
        ({"count": 1.5}, "thing 'box': count = 1.5: Expected a whole number."),
        ({"count": 13}, "thing 'box': count = 13: 13 brings bad luck; take 12."),
        ({"flag": "perhaps"}, "thing 'box': flag = 'perhaps': Expected true or false."),
        ({"point": (1.0, 2.0)}, "thing 'box': point = (1.0, 2.0): Expected 3 items, got 2."),
        ({"point": ()}, "thing 'box': point = (): Expected 3 items, got 0."),
        ({"point": (1, 2, 3, 4)}, "thing 'box': point = (1, 2, 3, 4): Expected at most 3 items, got 4."),
        ({"point": (1.0, 2.0, "x")}, "thing 'box': point.2 = 'x': Expected a number."),
        ({"point": 3}, "thing 'box': point = 3: Expected a list."),
        ({"path": (1.0,)}, "thing 'box': path = (1.0,): Expected at least 2 items, got 1."),
        ({"side": "up"}, "thing 'box': side = 'up': Expected 'left' or 'right'."),
        ({"name": ""}, "thing '': name = '': Expected a text that is not empty."),
        ({"name": 3}, "thing '3': name = 3: Expected a text."),
        ({"part": 3}, "thing 'box': part = 3: Expected a mapping of keys to values."),
        ({"part": {"size": "big"}}, "thing 'box': part: _Part: size = 'big': Expected a number."),
        ({"colour": "red"}, "thing 'box': unknown key 'colour'. Allowed: count, flag, name, number, part, path,"),
    ],
)
def test_one_sentence_for_each_kind_of_mistake(values, sentence):
    with pytest.raises(InputError) as found:
        _Thing(**{"name": "box", **values})
    assert str(found.value).startswith(sentence)
    assert "\n" not in str(found.value) and "should" not in str(found.value)


def test_every_mistake_has_a_line_of_its_own():
    with pytest.raises(InputError) as found:
        _Thing(name="box", number=0, count="many")
    assert len(str(found.value).splitlines()) == 2


def test_a_class_chooses_its_error():
    class Part(_Thing):
        wrong: ClassVar = ModelError

    with pytest.raises(ModelError, match="number = 0"):
        Part(number=0)


def test_a_mistake_without_a_key_is_said_without_one():
    with pytest.raises(InputError) as caught:
        _Whole()
    assert str(caught.value) == "_Whole: expected something else."
