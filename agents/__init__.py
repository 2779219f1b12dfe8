"""Policies for the environments of exo_env, their training and their evaluation; see `python -m agents --help`.

The wheel carries this folder under the name `exo_agents`, so everything in it is imported relatively.

    environment   the ground, with checkpoint and provenance: environments by id, and how files are kept
    policies      the contract, the classical ones, and trained ones that run on NumPy
    training      configuration, algorithms, a run and its folder
    evaluation    measures, statistics, tables and figures
    export        folders of numbers and ONNX
    distributed   work shared out by Ray, and the environment for RLlib
    commands      the command line

Each may import those above it; training and evaluation know nothing of each other.
"""

from dms_core.renamed import moved_modules

from .old_names import MOVED

moved_modules(__name__, MOVED)
