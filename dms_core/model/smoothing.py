"""Low-pass filter for recorded motions: Butterworth of order 2, forwards and backwards, so that nothing is delayed.

Both passes together fall to 1 / sqrt 2 at the stated cut-off: each is designed for a frequency that is higher by
1 / (sqrt 2 - 1)^(1/4) = 1.2465 (Winter 2009, sect. 2.4.4.2; on the scale of the bilinear transform).
"""

from __future__ import annotations

import numpy as np

from dms_core.errors import InputError

EVEN = 1e-3
"""Largest difference between two intervals of an evenly sampled table, over the interval: times are rounded."""
FEWEST = 16
"""Samples that the filter needs to settle at both ends."""
HIGHEST = 0.45
"""Largest cut-off over the sampling rate; at a half of it there is nothing left to filter."""
BOTH_PASSES = (np.sqrt(2.0) - 1.0) ** 0.25


def low_pass(times: np.ndarray, values: np.ndarray, cutoff: float, what: str) -> np.ndarray:
    """Values without what is faster than the cut-off; beyond the ends they are continued by point reflection.

    Args:
        times: evenly spaced [s], shape (n,).
        values: shape (n,) or (n, k).
        cutoff: frequency at which a half of the power passes [Hz].
        what: whose values they are, for errors.

    Raises:
        InputError: the times are not even, too few, or too far apart for that frequency.
    """
    # Late, since it takes a second that whoever filters nothing does not have to wait.
    from scipy.signal import butter, sosfiltfilt

    steps = np.diff(times)
    if len(times) < FEWEST:
        raise InputError(f"{what}: Expected at least {FEWEST} rows to filter, got {len(times)}.")
    if np.ptp(steps) > EVEN * steps.mean():
        raise InputError(
            f"{what}: Expected evenly spaced times to filter, got intervals from {steps.min():.6g} to "
            f"{steps.max():.6g} s. Resample the table, or leave the cutoff out."
        )
    rate = 1.0 / float(steps.mean())
    highest = HIGHEST * rate
    if not 0.0 < cutoff < highest:
        raise InputError(
            f"{what}: Expected a cutoff above 0 and below {highest:.4g} Hz for rows {1.0 / rate:.4g} s apart, got "
            f"{cutoff:g} Hz."
        )
    warped = np.tan(np.pi * cutoff / rate) / BOTH_PASSES
    design = 2.0 * np.arctan(warped) / np.pi
    filtered = sosfiltfilt(butter(2, design, output="sos"), values, axis=0)
    return np.asarray(filtered)
