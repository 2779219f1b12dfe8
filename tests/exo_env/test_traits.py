"""How a trait may be declared."""

import pytest

from dms_core.errors import InputError
from exo_env.settings import Settings
from exo_env.traits import range_of, trait


class Own(Settings):
    """A model of two traits."""

    grip: float = trait(1.0, ge=0.5, le=2.0, acts="effort", description="with both ends")
    reach: float = trait(1.0, ge=0.5, acts="effort", description="without a greatest value")


def test_range():
    assert range_of(Own, "grip") == (0.5, 2.0)


def test_a_trait_without_a_greatest_value():
    with pytest.raises(InputError, match="Own: trait 'reach' has no greatest value; expected le="):
        range_of(Own, "reach")
