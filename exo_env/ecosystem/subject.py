"""A subject's anatomy as data: bodies, joints and muscles of a model file, and which of them play which part.

A file (configs/subject/arm26.yaml is shipped) holds gravity, bodies, joints, muscles and, under `roles`, the names of
those that the ecosystem of the elbow needs:

    roles: {torso: base, humerus: r_humerus, forearm: r_ulna_radius_hand,
            mount: offset, shoulder: r_shoulder, elbow: r_elbow, flexors: [BIClong, BICshort, BRA]}

Muscles that are no flexors are extensors. Another file may have other muscles, and any number of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from dms_core.config_files import config_file, configs
from dms_core.errors import InputError, choices
from dms_core.yaml_text import read_yaml

DEFAULT = "arm26"
BODY_ROLES, JOINT_ROLES = ("torso", "humerus", "forearm"), ("mount", "shoulder", "elbow")
SECTIONS = ("gravity", "roles", "grip", "bodies", "joints", "muscle_defaults", "muscles")


@cache
def subject_facts(source: str) -> dict[str, Any]:
    """Contents of a subject's file, checked and read once.

    Args:
        source: name of a shipped subject, or path of a YAML file.

    Raises:
        InputError: there is no such subject, or the file lacks something; names file and key.
    """
    path = _path(source)
    facts = read_yaml(path)
    missing = [name for name in SECTIONS if name not in facts]
    if missing:
        raise InputError(f"{path}: the section '{missing[0]}' is missing; expected {', '.join(SECTIONS)}.")
    roles = facts["roles"]
    for kinds, section in ((BODY_ROLES, "bodies"), (JOINT_ROLES, "joints")):
        for role in kinds:
            _check_role(path, role, roles.get(role), facts[section], section)
    if not isinstance(roles.get("flexors"), list) or not facts["muscles"]:
        raise InputError(f"{path}: roles: expected a list of muscles as 'flexors', got {roles.get('flexors')!r}.")
    for name in roles["flexors"]:
        _check_role(path, "flexors", name, facts["muscles"], "muscles")
    return facts


def _path(source: str) -> Path:
    """Path of the file of a subject."""
    if source.endswith((".yaml", ".yml")):
        return Path(source)
    shipped = sorted(p.stem for p in (configs() / "subject").glob("*.yaml"))
    if source not in shipped:
        raise InputError(f"subject = {source!r}: expected one of {choices(shipped)}, or a YAML file.")
    return config_file(f"subject/{source}.yaml")


def _check_role(path: Path, role: str, name: Any, known: Mapping[str, Any], section: str) -> None:
    """Refuse a role that nothing in the file has."""
    if name not in known:
        raise InputError(f"{path}: roles: {role} = {name!r}; expected one of the {section} {choices(known)}.")
