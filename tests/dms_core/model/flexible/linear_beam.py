"""Mass and stiffness of a straight beam of linear elements along x, six freedoms a node: what a program would export.

Cubic bending without shear, linear stretch and twist (J. S. Przemieniecki (1968), Theory of Matrix Structural Analysis,
sect. 5.6 and 11.3), rotary inertia about x only.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dms_core.model import BeamSection


class LinearBeam(NamedTuple):
    """Nodes (k, 3), mass and stiffness (6 k, 6 k)."""

    nodes: np.ndarray
    mass: np.ndarray
    stiffness: np.ndarray


def linear_beam(section: BeamSection, length: float, elements: int, start: float = 0.0) -> LinearBeam:
    """The beam from x = start on."""
    h, k = length / elements, elements + 1
    M, K = np.zeros((6 * k, 6 * k)), np.zeros((6 * k, 6 * k))
    bend = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]], float)
    heavy = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]], float) / 420.0
    rod, share = np.array([[1, -1], [-1, 1]], float), np.array([[2, 1], [1, 2]], float) / 6.0
    E, G, m = section.youngs_modulus, section.shear_modulus, section.mass_per_length * h
    for e in range(elements):
        o = 6 * e
        for along, stiffness, weight in (
            (0, E * section.area, m), (3, G * section.torsion_constant, section.inertia_per_length[0] * h)
        ):  # fmt: skip
            at = np.ix_([o + along, o + 6 + along], [o + along, o + 6 + along])
            K[at] += stiffness / h * rod
            M[at] += weight * share
        for across, turn, sign, inertia in ((1, 5, 1.0, section.inertia_z), (2, 4, -1.0, section.inertia_y)):
            scale = np.array([1.0, sign * h, 1.0, sign * h])
            places = [o + across, o + turn, o + 6 + across, o + 6 + turn]
            K[np.ix_(places, places)] += E * inertia / h**3 * bend * np.outer(scale, scale)
            M[np.ix_(places, places)] += m * heavy * np.outer(scale, scale)
    nodes = np.zeros((k, 3))
    nodes[:, 0] = start + h * np.arange(k)
    return LinearBeam(nodes, M, K)


def loads_per_length(beam: LinearBeam, near: float = 1.0, far: float = 1.0) -> np.ndarray:
    """Nodal loads of an intensity from `near` to `far` along x, y and z, shape (6 k, 3): what does the cubic's work.

    An element of the length h from q_i to q_j has the forces h (7 q_i + 3 q_j) / 20 and h (3 q_i + 7 q_j) / 20, and the
    moments h^2 (3 q_i + 2 q_j) / 60 and -h^2 (2 q_i + 3 q_j) / 60; along it h (2 q_i + q_j) / 6.
    """
    x, B = beam.nodes[:, 0], np.zeros((len(beam.mass), 3))
    share = near + (far - near) * (x - x[0]) / (x[-1] - x[0])
    for e, h in enumerate(np.diff(x)):
        i, j, o = share[e], share[e + 1], 6 * e
        B[[o, o + 6], 0] += h * np.array([2.0 * i + j, i + 2.0 * j]) / 6.0
        forces = h * np.array([7.0 * i + 3.0 * j, 3.0 * i + 7.0 * j]) / 20.0
        moments = h * h * np.array([3.0 * i + 2.0 * j, -2.0 * i - 3.0 * j]) / 60.0
        for across, turn, sign in ((1, 5, 1.0), (2, 4, -1.0)):
            B[[o + across, o + 6 + across], across] += forces
            B[[o + turn, o + 6 + turn], across] += sign * moments
    return B
