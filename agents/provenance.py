"""What a result was made with."""

from __future__ import annotations

import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import exo_env

PACKAGES = ("numpy", "numba", "gymnasium", "torch", "stable-baselines3", "sb3-contrib")


def package_version() -> str:
    """Version of exo_env, also of a checkout that is not installed."""
    try:
        return version("exo-env")
    except PackageNotFoundError:
        import tomllib

        project = Path(exo_env.__file__).resolve().parents[1] / "pyproject.toml"
        return tomllib.loads(project.read_text(encoding="utf-8"))["project"]["version"] if project.is_file() else "?"


def versions() -> dict[str, str]:
    """Versions of Python, of this package and of what it stands on."""
    versions = {"python": platform.python_version(), "exo_env": package_version()}
    for name in PACKAGES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            continue
    return versions


def revision() -> str | None:
    """Git revision of the checkout, with '+' where files differ from it; None where there is none."""
    folder = Path(exo_env.__file__).resolve().parents[1]
    if not (folder / "pyproject.toml").is_file():
        return None  # Installed: a repository around it is somebody else's.
    try:
        commands = [["git", "rev-parse", "HEAD"], ["git", "status", "--porcelain", "--untracked-files=no"]]
        done = [subprocess.run(a, cwd=folder, capture_output=True, text=True, timeout=10, check=True) for a in commands]
    except (OSError, subprocess.SubprocessError):
        return None
    return done[0].stdout.strip() + ("+" if done[1].stdout.strip() else "")
