"""The unscented form: mean and covariance from 2 n points instead of derivatives (Julier and Uhlmann 1997).

    x_i = x +- sqrt(n) column i of the root of P,    each of weight 1 / 2 n

which is the choice kappa = 0, with positive weights whatever n is (the cubature filter of Arasaratnam and Haykin 2009).
Every point lies on the constraints, and goes through the model's own steps and sensors.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.linalg as la

from dms_core.estimation.estimated import Belief
from dms_core.estimation.filter.charts import chart_at
from dms_core.estimation.filter.gaussian import symmetric
from dms_core.estimation.filter.kalman import Correction, KalmanFilter, Predicted


class UnscentedFilter(KalmanFilter):
    """As `KalmanFilter`, without a derivative in prediction and correction; 2 n runs a period."""

    def _points(self, belief: Belief) -> tuple[np.ndarray, list[Belief]]:
        """Displacements as columns, shape (n, 2 n), and the beliefs there."""
        n = len(belief.P)
        root = np.linalg.cholesky(symmetric(belief.P)) * np.sqrt(n)
        shifts = np.hstack([root, -root])
        x = belief.mean
        return shifts, [self.moved(belief, x + shift) for shift in shifts.T]

    def predict(self, belief: Belief, t: float) -> Predicted:
        """A belief at a later time [s].

        Raises:
            SimulationError: the equations cannot be solved from one of the points.
        """
        shifts, points = self._points(belief)
        middle = self.moved_on(belief, t)
        ends = [self.moved_on(point, t) for point in points]
        about = middle.mean
        spread = np.column_stack([np.concatenate([middle.chart.read(e.q, e.v), e.rest]) - about for e in ends])
        mean = spread.mean(axis=1)
        spread -= mean[:, None]
        P = symmetric(spread @ spread.T / spread.shape[1] + self.estimated.noise(middle.chart, t - belief.t))
        joint = shifts @ spread.T / spread.shape[1]
        end = self.moved(middle, about + mean)
        end = replace(end, P=P, chart=chart_at(self.model, end.q, end.v, t, middle.chart, keep=True))
        return Predicted(end, joint, la.solve(belief.P, joint, assume_a="sym").T)

    def _corrected(self, belief: Belief, names: list[str], y: np.ndarray, R: np.ndarray) -> Correction:
        """The correction from readings of all points."""
        shifts, points = self._points(belief)
        at, biases = [self.estimated.outputs[name] for name in names], self.estimated.biases(names)
        shown = np.array([self.read(point)[at] + biases @ point.rest for point in points])
        apart = self.residual(names, shown, shown[0])
        expected = shown[0] + apart.mean(axis=0)
        spread = (apart - apart.mean(axis=0)).T
        S = symmetric(spread @ spread.T / len(points) + R)
        K = la.solve(S, spread @ shifts.T / len(points), assume_a="pos").T
        r = self.residual(names, y, expected)
        here = self.moved(belief, belief.mean + K @ r)
        P = symmetric(belief.P - K @ S @ K.T)
        return Correction(replace(here, P=P), float(r @ la.solve(S, r, assume_a="pos")), r)
