"""Names of older versions load with a warning, or end in an error that names what replaces them."""

import subprocess
import sys
from importlib import import_module

import pytest

from exo_env.old_names import MOVED, NAMES

FOLDERS = ("ecosystem", "patient", "rendering")


@pytest.mark.parametrize("old", [name for name in MOVED if name not in ("sb3",)])
def test_a_module_loads_by_its_old_name(old):
    import sys

    sys.modules.pop(f"exo_env.{old}", None)
    with pytest.warns(FutureWarning, match=f"'exo_env.{old}' is now 'exo_env.{MOVED[old]}'"):
        found = import_module(f"exo_env.{old}")
    new = import_module(f"exo_env.{MOVED[old]}")
    public = [name for name in vars(new) if not name.startswith("_") and name not in NAMES.get(old, {})]
    assert all(getattr(found, name) is getattr(new, name) for name in public)
    assert new.__spec__.name == f"exo_env.{MOVED[old]}"


@pytest.mark.filterwarnings("ignore::FutureWarning")
@pytest.mark.parametrize(("old", "name"), [(old, name) for old, names in NAMES.items() for name in names])
def test_a_name_loads_or_its_replacement_is_named(old, name):
    module, place = import_module(f"exo_env.{old}"), NAMES[old][name]
    if " " in place:
        with pytest.raises(ImportError) as caught:
            getattr(module, name)
        assert place in str(caught.value)
    else:
        home, _, attribute = place.partition(":")
        assert getattr(module, name) is getattr(import_module(f"exo_env.{home}"), attribute)


def test_what_a_users_project_wrote_in_version_0_1():
    with pytest.warns(FutureWarning):
        from exo_env.human import Arm, Person
        from exo_env.lift_env import ElbowLiftEnv
        from exo_env.vector_env import ElbowLiftVectorEnv

        from exo_env.ecosystem import Ecosystem
        from exo_env.patient import Patient
    assert ElbowLiftVectorEnv.env_type is ElbowLiftEnv
    assert Arm(Patient(strength=0.5).person).person == Person(strength=0.5)
    assert Ecosystem().weight == 1.0
    with pytest.raises(ImportError, match="Muscles come from the arm"):
        from exo_env.human import MUSCLES  # noqa: F401


@pytest.mark.filterwarnings("ignore::FutureWarning")
def test_what_a_users_project_wrote_in_version_0_3():
    from exo_env.tasks.movement import Movement
    from exo_env.world.episode import Episode

    from exo_env.tasks import rewards

    assert rewards.Weights is import_module("exo_env.tasks.judgement.rewards").Weights
    assert Movement is import_module("exo_env.tasks.movements.movement").Movement
    assert Episode is import_module("exo_env.world.episodes.episode").Episode


@pytest.mark.filterwarnings("ignore:'exo_env.human:FutureWarning")
def test_a_star_gives_the_names_that_have_moved():
    found = {}
    with pytest.warns(FutureWarning, match="'exo_env.human.Person' is now 'exo_env.ecosystem.person.Person'"):
        exec("from exo_env.human import *", found)
    assert found["Arm"] is import_module("exo_env.ecosystem.arm").Arm
    assert found["Person"] is import_module("exo_env.ecosystem.person").Person
    # What is gone has nothing to give; by its name it says what replaces it.
    assert "MUSCLES" not in found


@pytest.mark.parametrize("folder", FOLDERS)
def test_a_name_that_never_was_is_an_ordinary_error(folder):
    with pytest.raises(AttributeError, match="has no attribute 'horse'"):
        import_module(f"exo_env.{folder}").horse  # noqa: B018


def test_python_m_with_an_old_name_says_the_new_one():
    done = subprocess.run([sys.executable, "-m", "exo_env.soak"], capture_output=True, text=True)
    assert done.returncode == 1
    assert "'exo_env.soak' is now 'exo_env.envs.soak'; run it by that name." in done.stderr
    assert "Traceback" not in done.stderr
