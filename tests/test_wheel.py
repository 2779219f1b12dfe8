"""What is shipped: the wheel carries both packages and the configuration, and finds it from an empty folder."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

from dms_core.files.config_files import configs

SCRIPT = """
import dms_core, sys
from dms_core.files.config_files import config_file, configs
from dms_core.model_files.model_file import load
print(dms_core.__file__)
print(sorted(str(p.relative_to(configs())) for p in configs().rglob("*.yaml")))
print(load(config_file("models/pendulum.yaml")).name)
"""


def test_the_configuration_is_found_from_an_empty_folder(installed, tmp_path):
    python, site = installed
    clean = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    done = subprocess.run([python, "-c", SCRIPT], cwd=tmp_path, env=clean, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    module, found, name = done.stdout.splitlines()
    assert Path(module).is_relative_to(site)
    assert found == str(sorted(str(p.relative_to(configs())) for p in configs().rglob("*.yaml")))
    assert name == "pendulum"
    assert list(tmp_path.iterdir()) == []


def test_both_packages_and_the_licences_are_in_it(installed):
    _, site = installed
    assert (site / "exo_env" / "__init__.py").is_file()
    names = {p.name for p in site.glob("exo_env-*.dist-info/licenses/*")}
    assert names == {"LICENSE", "NOTICE"}
    assert not (site / "tests").exists() and not (site / "configs").exists()
