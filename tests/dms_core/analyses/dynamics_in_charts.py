"""The dynamics of a model in its independent coordinates, by Newton's method, to test a linearisation."""

from __future__ import annotations

import numpy as np

from dms_core.assembly.derivatives.blocks import OperatingPoint


class Charted:
    """xdot and y as functions of x = (q[chosen], v[chosen], first-order states) and of inputs u, shape (n_u, 3)."""

    def __init__(self, model, linear) -> None:  # noqa: ANN001
        names = list(model.layout.names)
        self.model = model
        self.z = [k for k in (names.index(s[2:]) for s in linear.states if s[0] == "q") if model.second_order[k]]
        self.s = [k for k in (names.index(s[2:]) for s in linear.states if s[0] == "q") if not model.second_order[k]]
        self.second = np.flatnonzero(model.second_order)
        self.guess = linear.point

    def start(self) -> np.ndarray:
        """x of the point of the linearisation."""
        p = self.guess
        return np.concatenate([p.q[self.z], p.v[self.z], p.q[self.s]])

    def __call__(self, x: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        n, p = len(self.z), self.guess
        q, v = p.q.copy(), p.v.copy()
        q[self.s] = x[2 * n :]
        for _ in range(30):
            b = self._blocks(q, v, p.a, p.lam, u)
            open_ = np.concatenate([b.r3, q[self.z] - x[:n]])
            q[self.second] -= np.linalg.lstsq(self._square(b), open_, rcond=1e-12)[0]
        b = self._blocks(q, np.zeros_like(v), p.a, p.lam, u)
        v[self.second] = np.linalg.lstsq(self._square(b), np.concatenate([-b.r4, x[n : 2 * n]]), rcond=1e-12)[0]
        v, a, lam = self._rates(q, v, u)
        y = self.model.derivatives.sensor_blocks(OperatingPoint(q, v, v, a, lam, 0.0 * lam, u)).y
        return np.concatenate([v[self.z], a[self.z], v[self.s]]), y

    def _blocks(self, q, v, a, lam, u):  # noqa: ANN001, ANN202
        return self.model.derivatives.blocks(OperatingPoint(q, v, v, a, lam, 0.0 * lam, u))

    def _square(self, b) -> np.ndarray:  # noqa: ANN001
        G = b.phi_q.toarray()[:, self.second]
        return np.vstack([G, np.eye(self.model.n_q)[self.z][:, self.second]])

    def _rates(self, q, v, u):  # noqa: ANN001, ANN202
        """First-order rates, accelerations and multipliers by Newton's method; phi_tt from phi_t over a small time."""
        a, lam = self.guess.a.copy(), self.guess.lam.copy()
        first = np.setdiff1d(np.arange(self.model.n_q), self.second)
        n_s = len(self.second)
        for _ in range(30):
            b = self._blocks(q, v, a, lam, u)
            G, W = b.phi_q.toarray(), b.r4_q.toarray()
            phi_tt = np.einsum("ij,j->i", b.r4_u[:, :, 1], u[:, 2])
            J = np.zeros((self.model.n_q + len(lam), self.model.n_q + len(lam)))
            J[: self.model.n_q, :n_s] = b.r2_a.toarray()[:, self.second]
            J[: self.model.n_q, n_s : self.model.n_q] = b.r2_v.toarray()[:, first]
            J[: self.model.n_q, self.model.n_q :] = G.T
            J[self.model.n_q :, :n_s] = G[:, self.second]
            change = np.linalg.lstsq(J, -np.concatenate([b.r2, G @ a + W @ v + phi_tt]), rcond=1e-13)[0]
            a[self.second] += change[:n_s]
            v[first] += change[n_s : self.model.n_q]
            lam += change[self.model.n_q :]
        return v, a, lam


def differences(f, x: np.ndarray, u: np.ndarray, h: float = 1e-6) -> tuple[np.ndarray, ...]:
    """(A, [B, B_rate, B_acceleration], C, [D, ...]) by central differences of the charted dynamics."""
    columns = []
    for k in range(len(x)):
        d = np.zeros_like(x)
        d[k] = h
        high, low = f(x + d, u), f(x - d, u)
        columns.append([(a - b) / (2.0 * h) for a, b in zip(high, low, strict=True)])
    A, C = (np.array([c[i] for c in columns]).T for i in (0, 1))
    B, D = [], []
    for j in range(3):
        columns = []
        for k in range(len(u)):
            d = np.zeros_like(u)
            d[k, j] = h
            high, low = f(x, u + d), f(x, u - d)
            columns.append([(a - b) / (2.0 * h) for a, b in zip(high, low, strict=True)])
        B.append(np.array([c[0] for c in columns]).T)
        D.append(np.array([c[1] for c in columns]).T)
    return A, B, C, D
