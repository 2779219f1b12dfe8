"""Small models on which solvers of redundant, singular or stiff mechanisms fail; each file says what it stands for."""

from pathlib import Path

from dms_core import Model
from dms_core.model_files.model_file import load


def model(name: str) -> Model:
    """The model of a case, by the name of its file."""
    return Model(load(Path(__file__).with_name(f"{name}.yaml")))
