"""The chain of N links that several programs are timed with, solved by itself in minimal coordinates.

Link i = 0..N-1 is a thin rod of 1 m and 1 kg, inertia about its centre diag(1e-3, 1/12, 1/12) kg m^2 (along the rod, y,
z; the first is arbitrary, the motion is planar). Hinge i is at the left end of link i, axis z, hinge 0 at the origin of
the ground. Gravity (0, -9.81, 0); at rest at first, all links along +x; 1 s. With the absolute angles theta and the
number of links beyond the later of two, n_ij = N - 1 - max(i, j):

    M_ij = (n_ij + 1/2) cos(theta_i - theta_j),  M_ii = n_ii + 1/3
    sum_j M_ij theta_j'' = - sum_j (n_ij + 1/2) sin(theta_i - theta_j) theta_j'^2 - 9.81 (n_ii + 1/2) cos theta_i

    python tests/benchmarks/chain_reference.py [N ...]
"""

from __future__ import annotations

import argparse

import numpy as np
from scipy.integrate import solve_ivp

TIP = {
    1: (-0.999966588072, -0.008174517717),
    2: (-1.662115135816, -1.041466637193),
    4: (-1.001231213963, -3.607961551270),
    8: (5.183553317252, -4.878764572808),
    16: (14.037422088005, -4.905051600163),
    32: (30.530246507830, -4.905000000057),
    64: (62.869093243961, -4.905000000000),
}
"""Right end of the last link at 1 s [m], as `tip` gives it."""


def tip(links: int) -> np.ndarray:
    """Right end of the last link at 1 s [m], shape (2,), by DOP853 with tolerances of 1e-12."""
    i = np.arange(links)
    after = links - 1 - i
    masses = (links - 1 - np.maximum.outer(i, i)) + 0.5
    np.fill_diagonal(masses, after + 1 / 3)

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        theta, omega = y[:links], y[links:]
        between = theta[:, None] - theta[None, :]
        right = -(masses * np.sin(between)) @ omega**2 - 9.81 * (after + 0.5) * np.cos(theta)
        return np.concatenate([omega, np.linalg.solve(masses * np.cos(between), right)])

    theta = solve_ivp(rates, (0.0, 1.0), np.zeros(2 * links), method="DOP853", rtol=1e-12, atol=1e-12).y[:links, -1]
    return np.array([np.cos(theta).sum(), np.sin(theta).sum()])


def main(arguments: list[str] | None = None) -> None:
    """Print the tips."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("links", type=int, nargs="*", default=list(TIP))
    for links in parser.parse_args(arguments).links:
        x, y = tip(links)
        print(f"{links:4d} {x:18.12f} {y:18.12f}", flush=True)


if __name__ == "__main__":
    main()
