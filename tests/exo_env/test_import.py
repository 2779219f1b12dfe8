"""`import exo_env` is light and silent."""

import subprocess
import sys


def test_import_loads_nothing_heavy():
    code = "import sys, exo_env; print(sorted({'numba', 'matplotlib', 'pygame', 'torch'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert (done.stdout.strip(), done.stderr) == ("[]", "")
