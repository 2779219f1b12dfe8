"""Outlines of what `picture` draws, as polygons of shape (n, 2) in the units of their input."""

from __future__ import annotations

import numpy as np


def limb(a: np.ndarray, b: np.ndarray, radius_a: float, radius_b: float, corners: int = 24) -> np.ndarray:
    """Two discs and their common outer tangents: a limb that tapers from `a` to `b`.

    The tangents touch both discs at the angle beta from the axis, cos beta = (radius_a - radius_b) / |b - a|.
    """
    axis = b - a
    length = float(np.hypot(*axis))
    along = float(np.arctan2(axis[1], axis[0]))
    # Where one disc holds the other, beta is 0 or pi, and the outline is the larger disc.
    beta = float(np.arccos(np.clip((radius_a - radius_b) / max(length, 1e-12), -1.0, 1.0)))
    half = corners // 2
    about_b = along + np.linspace(-beta, beta, half)
    about_a = along + np.linspace(beta, 2.0 * np.pi - beta, half)
    return np.concatenate([b + radius_b * _circle(about_b), a + radius_a * _circle(about_a)])


def _circle(angles: np.ndarray) -> np.ndarray:
    """Points of the unit circle, shape (n, 2)."""
    return np.column_stack([np.cos(angles), np.sin(angles)])


def spindle(points: np.ndarray, belly: float, tendon: float, samples: int = 28) -> np.ndarray:
    """A ribbon along a polyline, `tendon` wide at its ends and `belly` wide in the middle, like a muscle."""
    s, path = _resampled(points, samples)
    rounded = path.copy()
    # A muscle bends smoothly where its path has a corner; the ends stay on the bone.
    for _ in range(2):
        rounded[1:-1] = 0.25 * (rounded[:-2] + 2.0 * rounded[1:-1] + rounded[2:])
    direction = np.gradient(rounded, axis=0)
    direction /= np.maximum(np.hypot(direction[:, 0], direction[:, 1]), 1e-12)[:, None]
    normal = np.column_stack([-direction[:, 1], direction[:, 0]])
    half = 0.5 * (tendon + (belly - tendon) * np.sin(np.pi * s) ** 1.5)[:, None]
    return np.concatenate([rounded + half * normal, (rounded - half * normal)[::-1]])


def dashes(outline: np.ndarray, length: float) -> list[np.ndarray]:
    """Every second piece of a closed outline, each about `length` long."""
    closed = np.concatenate([outline, outline[:1]])
    perimeter = float(np.hypot(*np.diff(closed, axis=0).T).sum())
    count = max(2 * round(perimeter / (2.0 * length)), 2)
    _, path = _resampled(closed, count + 1)
    return [path[k : k + 2] for k in range(0, count, 2)]


def rounded(corners: np.ndarray, rounds: int = 3) -> np.ndarray:
    """A closed outline whose corners are cut at a quarter of their sides, over and over (Chaikin 1974).

    The limit is the quadratic B-spline of the corners.
    """
    for _ in range(rounds):
        following = np.roll(corners, -1, axis=0)
        corners = np.stack([0.75 * corners + 0.25 * following, 0.25 * corners + 0.75 * following], axis=1)
        corners = corners.reshape(-1, 2)
    return corners


def _resampled(points: np.ndarray, samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Share of the length, shape (samples,), and the points of a polyline there, equally spaced."""
    passed = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    s = np.linspace(0.0, 1.0, samples)
    at = s * passed[-1]
    return s, np.column_stack([np.interp(at, passed, points[:, 0]), np.interp(at, passed, points[:, 1])])
