"""Every reader of YAML, fed with files that grew hostile: what it does not take it refuses in a bounded sentence."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("hypothesis", reason='the extra "dev" is not installed')

from hypothesis import given
from hypothesis import strategies as st

from agents.environment import ENVIRONMENT
from agents.training.settings.config import Config
from dms_core.errors import DmsError
from dms_core.files.config_files import configs
from dms_core.model_files.model_file import load
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.ecosystem.gym_machine import GymMachine
from exo_env.ecosystem.subject import read_subject
from exo_env.paper.scenarios import Exercise, Scenario
from exo_env.patient.population import Population
from tests.agents.tiny import content as tiny
from tests.fuzz.mutations import TOKENS, mutated

MOST_SECONDS = 2.0
"""Processor time of one input."""
MOST_CHARACTERS, MOST_LINES = 1200, 6
"""Of a line of a message, and lines: one a mistake, and one that counts the others."""


@cache
def arguments() -> Callable[[Config], Any]:
    """The check of an algorithm's arguments, where the libraries of training are installed."""
    try:
        from agents.training.learners.algorithms import arguments as check
    except ImportError:
        return lambda config: None
    return check


READERS: dict[str, tuple[str, Callable[[Path], Any]]] = {
    "model": ("models/*.yaml", load),
    "population": ("patients/*.yaml", Population.read),
    "device": ("exoskeletons/*.yaml", Exoskeleton.from_file),
    "machine": ("gym_machine/*.yaml", GymMachine.from_file),
    "subject": ("subject/*.yaml", lambda path: read_subject(str(path))),
    "exercise": ("scenarios/exercise.yaml", Exercise.from_file),
    "scenario": ("scenarios/[1-4]*.yaml", Scenario.from_file),
    "config": ("agents/**/*.yml", lambda path: arguments()(Config.read(path))),
}


@cache
def grown(reader: str) -> st.SearchStrategy[bytes]:
    """Files that grew from the shipped ones of a reader."""
    return mutated([path.read_text("utf-8") for path in sorted(configs().glob(READERS[reader][0]))])


def tried(read: Callable[[], Any]) -> None:
    """Read; what is refused is said briefly, and nothing takes long."""
    begun = time.process_time()
    try:
        read()
    except DmsError as error:
        said = str(error)
        lines = said.splitlines()
        assert said and len(lines) <= MOST_LINES and max(map(len, lines)) <= MOST_CHARACTERS, said
        assert all(c.isprintable() or c == "\n" for c in said), repr(said)
    assert time.process_time() - begun < MOST_SECONDS


@pytest.fixture(scope="module", autouse=True)
def compiled():
    """Each shipped file is right; numba compiles here, outside of the measured time."""
    for pattern, read in READERS.values():
        for path in configs().glob(pattern):
            read(path)


@pytest.fixture
def refused_or_read(tmp_path):
    """Function that gives contents of a file to a reader."""
    path = tmp_path / "file.yaml"

    def check(reader: str, content: bytes) -> None:
        path.write_bytes(content)
        tried(lambda: READERS[reader][1](path))

    return check


@pytest.mark.parametrize("reader", READERS)
@given(data=st.data())
def test_a_file_is_read_or_refused(refused_or_read, reader, data):
    refused_or_read(reader, data.draw(grown(reader)))


KEYS = [
    *tiny()[ENVIRONMENT], *(f"training.{key}" for key in ("eval_every", "traces", "start", "device", "algorithm")),
    "policy_kwargs.net_arch", "env_kwargs.patient", "normalize.norm_obs", "training", "ent_coef", "x", "a.b.c", "",
]  # fmt: skip
PARTS = st.lists(st.sampled_from([*TOKENS, "64", "lin_1e-3", "dict(a=1)", "True"]) | st.text(max_size=4), max_size=4)


@given(st.sampled_from(KEYS), st.sampled_from(["=", "=", "=", ".a=", ""]), PARTS.map("".join))
def test_a_value_of_set_is_taken_or_refused(key, equals, value):
    tried(lambda: arguments()(Config.of(tiny(), "ppo", [f"{key}{equals}{value}"])))


@given(PARTS.map("".join))
def test_the_text_of_a_call_is_read_or_refused(value):
    tried(lambda: arguments()(Config.of(tiny(policy_kwargs=f"dict({value})"), "ppo")))
