"""Every reader of YAML, fed with files that grew hostile: what it does not take it refuses in a bounded sentence.

300 inputs a reader; EXO_FUZZ=deep, which `make fuzz` sets, gives 10,000.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("hypothesis", reason='the extra "dev" is not installed')

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from agents.environment import ENVIRONMENT
from agents.training.config import Config
from dms_core.config_files import configs
from dms_core.errors import DmsError
from dms_core.model_file import load
from exo_env.ecosystem.exoskeleton import Exoskeleton
from exo_env.ecosystem.gym_machine import GymMachine
from exo_env.ecosystem.subject import read_subject
from exo_env.paper.scenarios import Exercise, Scenario
from exo_env.patient.population import Population
from tests.agents.tiny import content
from tests.fuzz.mutations import TOKENS, mutated

INPUTS = 10_000 if os.environ.get("EXO_FUZZ") == "deep" else 300
MOST_SECONDS = 2.0
"""Processor time of one input."""
MOST_CHARACTERS = 4100
"""Of a message."""
fuzzed = settings(
    max_examples=INPUTS, derandomize=True, database=None, deadline=None, suppress_health_check=list(HealthCheck)
)


@cache
def arguments() -> Callable[[Config], Any]:
    """The check of an algorithm's arguments, where the libraries of training are installed."""
    try:
        from agents.training.algorithms import arguments as check
    except ImportError:
        return lambda config: None
    return check


def config(path: Path) -> None:
    """Read a configuration as `train` does, and as what is kept of it is read again."""
    used = Config.read(path)
    arguments()(used)


READERS: dict[str, tuple[str, Callable[[Path], Any]]] = {
    "model": ("models/*.yaml", load),
    "population": ("patients/*.yaml", Population.read),
    "device": ("exoskeletons/*.yaml", Exoskeleton.from_file),
    "machine": ("gym_machine/*.yaml", GymMachine.from_file),
    "subject": ("subject/*.yaml", lambda path: read_subject(str(path))),
    "exercise": ("scenarios/exercise.yaml", Exercise.from_file),
    "scenario": ("scenarios/[1-4]*.yaml", Scenario.from_file),
    "config": ("agents/**/*.yml", config),
}


def seeds(pattern: str) -> list[str]:
    """Texts of shipped files."""
    return [path.read_text(encoding="utf-8") for path in sorted(configs().glob(pattern))]


def tried(read: Callable[[], Any]) -> None:
    """Read; what is refused is said briefly, and nothing takes long."""
    begun = time.process_time()
    try:
        read()
    except DmsError as error:
        said = str(error)
        assert said and len(said) <= MOST_CHARACTERS, said
        assert all(c.isprintable() or c == "\n" for c in said), repr(said)
    assert time.process_time() - begun < MOST_SECONDS


@pytest.mark.parametrize("reader", READERS)
def test_a_file_is_read_or_refused(reader, tmp_path):
    pattern, read = READERS[reader]
    texts, path = seeds(pattern), tmp_path / "file.yaml"
    for text in texts:  # each is right as it is; numba compiles here, outside of the measured time
        path.write_text(text)
        read(path)
    refused = []

    @fuzzed
    @given(mutated(texts))
    def check(content):
        path.write_bytes(content)

        def one() -> None:
            try:
                read(path)
            except DmsError:
                refused.append(True)
                raise

        tried(one)

    check()
    assert len(refused) > INPUTS // 10  # the changes are felt


KEYS = [
    *content()[ENVIRONMENT], *(f"training.{key}" for key in ("eval_every", "traces", "start", "device", "algorithm")),
    "policy_kwargs.net_arch", "env_kwargs.patient", "normalize.norm_obs", "training", "ent_coef", "x", "a.b.c", "",
]  # fmt: skip
PARTS = st.lists(st.sampled_from([*TOKENS, "64", "lin_1e-3", "dict(a=1)", "True"]) | st.text(max_size=4), max_size=4)


@fuzzed
@given(st.sampled_from(KEYS), st.sampled_from(["=", "=", "=", ".a=", ""]), PARTS.map("".join))
def test_a_value_of_set_is_taken_or_refused(key, equals, value):
    tried(lambda: arguments()(Config.of(content(), "ppo", [f"{key}{equals}{value}"])))


@fuzzed
@given(PARTS.map("".join))
def test_the_text_of_a_call_is_read_or_refused(value):
    tried(lambda: arguments()(Config.of(content(policy_kwargs=f"dict({value})"), "ppo")))
