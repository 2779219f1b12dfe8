"""Modules of the core load by the names that they had, with a warning that says the new one."""

import sys
from importlib import import_module

import pytest

from dms_core.old_names import MOVED


@pytest.mark.parametrize("old", MOVED)
def test_a_module_loads_by_its_old_name(old):
    sys.modules.pop(f"dms_core.{old}", None)
    with pytest.warns(FutureWarning, match=f"'dms_core.{old}' is now 'dms_core.{MOVED[old]}'"):
        found = import_module(f"dms_core.{old}")
    assert found is import_module(f"dms_core.{MOVED[old]}")
