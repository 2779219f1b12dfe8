"""Fatigue: the three-compartment controller (Xia and Frey-Law 2008, J. Biomech. 41:3046-3052).

Motor units are active (M_A), fatigued (M_F) or at rest (M_R = 1 - M_A - M_F), as shares of those that effort can
recruit. For a wanted share T:

    M_A' = C - F M_A,   M_F' = F M_A - R M_F
    C = L min(T - M_A, M_R)  for M_A < T,   L (T - M_A)  otherwise,   L = 10 1/s

At rest, T below 0.05 (assumed; the publication has T = 0), R is multiplied by r, since blood returns (Looft, Herkert
and Frey-Law 2018, J. Biomech. 77:16-25). Effort can activate no more than 1 - M_F. The lag 1/L is the controller's,
not the muscle's: what the muscle receives is min(T, 1 - M_F), and the muscle has activation dynamics of its own.
"""

from __future__ import annotations

from dms_core.compiled.jit import compiled

L = 10.0
"""Speed at which units are recruited and let go [1/s]."""
REST = 0.05
"""Wanted share below which a muscle rests [-]."""
LONGEST_STEP = 0.02
"""Longest step of the integration [s]: a fifth of 1/L, where four stages are accurate to 1e-5."""


@compiled
def fatigue_rates(active, fatigued, wanted, fatigue_rate, recovery_rate):
    """Rates M_A' and M_F' of the active and the fatigued share [1/s]."""
    missing = wanted - active
    if missing > 0.0:
        missing = min(missing, 1.0 - active - fatigued)
    lost = fatigue_rate * active
    return L * missing - lost, lost - recovery_rate * fatigued


@compiled
def advance_fatigue(active, fatigued, wanted, fatigue_rate, recovery_rate, rest_recovery, duration):
    """(M_A, M_F) after a time [s] under a constant wanted share: classical Runge-Kutta steps of order 4."""
    recovery = recovery_rate * rest_recovery if wanted < REST else recovery_rate
    n = max(int(duration / LONGEST_STEP + 0.999999), 1)
    h = duration / n
    for _ in range(n):
        a1, f1 = fatigue_rates(active, fatigued, wanted, fatigue_rate, recovery)
        a2, f2 = fatigue_rates(active + 0.5 * h * a1, fatigued + 0.5 * h * f1, wanted, fatigue_rate, recovery)
        a3, f3 = fatigue_rates(active + 0.5 * h * a2, fatigued + 0.5 * h * f2, wanted, fatigue_rate, recovery)
        a4, f4 = fatigue_rates(active + h * a3, fatigued + h * f3, wanted, fatigue_rate, recovery)
        active += h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)
        fatigued += h / 6.0 * (f1 + 2.0 * (f2 + f3) + f4)
    return active, fatigued
