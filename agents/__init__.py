"""Policies for the environments of exo_env, their training and their evaluation; see `python -m agents --help`.

The wheel carries this folder under the name `exo_agents`, so everything in it is imported relatively.

    environment   the ground, with checkpoint and provenance: environments by id, and how files are kept
    policies      the contract, the classical ones, and trained ones that run on NumPy
    training      a run, its worlds and its learning curve
        settings      the configuration file
        wrappers      what stands between a world and the algorithm; the teacher that is imitated
        learners      the algorithms
        networks      from a trained model to a policy, and back
        files         what a run leaves on disk and goes on from
    evaluation    how good a policy is
        episodes      one episode: how it is played, what a policy may see of it, its measures
        comparison    policies on the same patients: opponents, statistics, gap closed
        sharing       long work in shares, and the file that keeps them
        results       the file of an evaluation, and tables of it
        search        numbers of the baselines, and what could be reached at most
        studies       shifts away from training, and getting used to a patient
        figures       pictures of all these
    export        folders of numbers and ONNX
    distributed   work shared out by Ray, and the environment for RLlib
    commands      the command line: training, search, studies, pictures, and `evaluate`

Each may import those above it; training and evaluation know nothing of each other.
"""

from dms_core.renamed import moved_modules

from .old_names import MOVED

moved_modules(__name__, MOVED)
