"""The README's linearisation runs and is right."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

README = Path(__file__).parents[3] / "dms_core" / "README.md"


def test_the_pendulum_of_the_readme_has_its_frequency(capsys):
    blocks = re.findall(r"```python\n(.*?)```", README.read_text(), re.S)
    code = next(block for block in blocks if "null_space" in block)
    names: dict = {}
    exec(code, names)
    # A thin rod of 1 m: J = m L^2 / 3 about its end, the centre of mass at L / 2.
    frequency = math.sqrt(9.80665 * 0.5 * 2.0 / (2.0 / 3.0))
    assert f"{frequency:.3f}" in code
    assert float(capsys.readouterr().out.strip("[] \n")) == pytest.approx(
        frequency, rel=1e-8
    )  # as many digits are printed
    assert names["M"].shape == (1, 1)
    assert np.abs(names["C"]).max() < 1e-12
    # At rest under 1 N at the tip, 1 m below the hinge: theta = 1 Nm / (m g L / 2), and p3 = theta / 2.
    change = names["N"] @ np.linalg.solve(names["K"], names["Q"])
    assert 2.0 * change[6] == pytest.approx(1.0 / (2.0 * 9.80665 * 0.5), rel=1e-12)
