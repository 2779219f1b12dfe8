"""Muscle with elastic tendon and contractile fibre along a path (paper sect. 3.4, eq. 14 to 20; Thelen 2003).

Fibre length q_m [m] and activation a [-] are coordinates of the system:

    body rows          r = sigma l_q^T                                  (f = -sigma l_q^T)
    fibre row          F0 (a fl fv + fp) cos(alpha) - sigma = 0         (eq. 18) [N]
    activation row     v_a - adot(a, u) = 0                             [1/s]

    sigma = F0 ft(e),   e = l_T / Ls - 1,   l_T = l(q) - q_m cos(alpha),   sin(alpha) = L0 sin(alpha0) / q_m

u is an input, or an input plus gain x, where x is a coordinate of another element (a reflex): u = u(t) + gain q_x.

The fibre's height L0 sin(alpha0) is constant; cos(alpha) is not let below 0.1. With the force-velocity curve inverted
in closed form the fibre row holds q_m and its rate directly, without an inner iteration.

A fibre has a smallest length, which a stop keeps it above (fibre.py).
"""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from pydantic import Field, model_validator

from dms_core.compiled.jit import compiled
from dms_core.errors import ModelError
from dms_core.model.element import Coordinate, Force, Limit, Pattern, Placement
from dms_core.model.geometry.path import (
    PathPoint,
    PathTable,
    add_path_gradient,
    add_path_hessian,
    path_length,
    path_pattern,
    path_table,
)
from dms_core.model.muscles.activation import MINIMUM, activation_rate, limited
from dms_core.model.muscles.fibre import (
    LEAST_COSINE,
    MUSCLE,
    STOP_WIDTH,
    fibre_at_rest,
    fibre_pull,
    smallest_fibre,
    stop_begins,
    tendon_state,
)
from dms_core.model.muscles.thelen_curves import ThelenCurves
from dms_core.model.places import numbers_at

MOST_PASSIVE = 1e3
"""Passive force over F0 beyond which a fibre is not let start."""
PATH_INTEGERS = 2
"""Index in `ip` where the path begins: before it, 1 for activation dynamics (2 with a reflex, 0 where the input is the
activation), and the number m of body coordinates: q_m is local coordinate m, a is m + 1, a reflex m + 2."""


PATH_NUMBERS = MUSCLE.path


@compiled
def muscle_activation(ip, q, u):
    """(activation [-], its derivative by the input where the input is the activation)."""
    if ip[0] > 0:
        return q[ip[1] + 1], 0.0
    return limited(u[0, 0])


@compiled
def muscle_excitation(ip, par, q, u):
    """(excitation [-], its derivative by the reflex coordinate)."""
    if ip[0] < 2:
        return limited(u[0, 0])[0], 0.0
    e, inside = limited(u[0, 0] + par[MUSCLE.reflex_gain] * q[ip[1] + 2])
    return e, inside * par[MUSCLE.reflex_gain]


@compiled
def thelen_muscle(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """ip as described at PATH_INTEGERS, par as in MuscleNumbers."""
    m = ip[1]
    length = add_path_gradient(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, 1.0, r)
    act, _ = muscle_activation(ip, q, u)
    sigma, s_l, s_m = tendon_state(par, length, q[m])
    pull, by_m, by_rate, by_a = fibre_pull(par, q[m], v[m], act)
    if level > 0:
        add_path_hessian(ip, PATH_INTEGERS, par, PATH_NUMBERS, q, sigma, Jq)
        for i in range(m):
            for j in range(m):
                Jq[i, j] += s_l * r[i] * r[j]
            Jq[i, m] = s_m * r[i]
            Jq[m, i] = -s_l * r[i]
        Jq[m, m] = by_m - s_m
        Jv[m, m] = by_rate
        if ip[0] > 0:
            Jq[m, m + 1] = by_a
    for i in range(m):
        r[i] *= sigma
    r[m] = pull - sigma
    if ip[0] > 0:
        excitation, by_reflex = muscle_excitation(ip, par, q, u)
        rate, rate_a, rate_u = activation_rate(
            act, excitation, par[MUSCLE.activation_time], par[MUSCLE.deactivation_time]
        )
        r[m + 1] = v[m + 1] - rate
        if level > 0:
            Jq[m + 1, m + 1] = -rate_a
            Jv[m + 1, m + 1] = 1.0
            if ip[0] > 1:
                Jq[m + 1, m + 2] = -rate_u * by_reflex


@compiled
def thelen_muscle_by_input(ip, par, q, v, a, u, Ju):
    """The activation's row by the excitation; without activation dynamics the fibre's row by the activation."""
    m = ip[1]
    act, by_input = muscle_activation(ip, q, u)
    if ip[0] == 0:
        Ju[m, 0, 0] = fibre_pull(par, q[m], v[m], act)[3] * by_input
        return
    wanted = u[0, 0] + par[MUSCLE.reflex_gain] * q[m + 2] if ip[0] > 1 else u[0, 0]
    excitation, inside = limited(wanted)
    tau_act, tau_deact = par[MUSCLE.activation_time], par[MUSCLE.deactivation_time]
    Ju[m + 1, 0, 0] = -activation_rate(act, excitation, tau_act, tau_deact)[2] * inside


class ThelenMuscle(Force):
    """One muscle. It owns "fibre_length" and, with activation dynamics, "activation"."""

    kind: ClassVar[str] = "thelen_muscle"
    kernel: ClassVar = thelen_muscle
    input_kernel: ClassVar = thelen_muscle_by_input
    path: tuple[PathPoint, ...] = Field(min_length=2, description="attachment and via points from origin to insertion")
    excitation: str = Field(
        description="name of the input: excitation [-], or the activation itself; limited to 0.01..1"
    )
    max_isometric_force: float = Field(gt=0.0, description="F0 [N]")
    optimal_fibre_length: float = Field(gt=0.0, description="L0 [m]")
    tendon_slack_length: float = Field(gt=0.0, description="Ls [m]")
    pennation_angle: float = Field(
        default=0.0, ge=0.0, lt=math.pi / 2, description="alpha0 at optimal fibre length [rad]"
    )
    max_contraction_velocity: float = Field(
        default=10.0, gt=0.0, description="in optimal fibre lengths per second [1/s]"
    )
    activation_time_constant: float = Field(default=0.015, gt=0.0, description="tau_act, rising activation [s]")
    deactivation_time_constant: float = Field(default=0.050, gt=0.0, description="tau_deact, falling activation [s]")
    curves: ThelenCurves = Field(default=ThelenCurves(), description="shapes of the force curves")
    activation_dynamics: bool = Field(default=True, description="False: the input is the activation, without delay")
    reflex: str | None = Field(
        default=None,
        description="coordinate x of another element ('feedback.error') that adds reflex_gain x to the excitation",
    )
    reflex_gain: float = Field(default=0.0, description="excitation per unit of the reflex coordinate [-]")
    start_activation: float = Field(
        default=MINIMUM,
        ge=MINIMUM,
        le=1.0,
        description="activation at the start [-]; without dynamics the input counts",
    )
    start_fibre_length: float | None = Field(
        default=None,
        gt=0.0,
        description="fibre length at the start [m]; default: static equilibrium at start_activation",
    )

    @model_validator(mode="after")
    def _pennation_possible(self):
        if math.cos(self.pennation_angle) < LEAST_COSINE:
            raise ValueError(
                f"pennation_angle = {self.pennation_angle} rad; it must be below {math.acos(LEAST_COSINE):.4f} rad"
            )
        return self

    @model_validator(mode="after")
    def _reflex_possible(self):
        if self.reflex is None and self.reflex_gain != 0.0:
            raise ValueError(f"reflex_gain = {self.reflex_gain} without a reflex; name the coordinate it multiplies")
        if self.reflex is not None and not self.activation_dynamics:
            raise ValueError(f"reflex '{self.reflex}' acts on the excitation; it needs activation_dynamics: true")
        return self

    @model_validator(mode="after")
    def _start_possible(self):
        start = self.start_fibre_length
        if start is not None and not self.smallest_fibre_length <= start <= self.longest_start:
            raise ValueError(
                f"start_fibre_length = {start}: Expected a number from {self.smallest_fibre_length:.4g} m, the "
                f"smallest length, to {self.longest_start:.4g} m, where the passive force is {MOST_PASSIVE:g} F0"
            )
        return self

    def coordinates(self) -> tuple[Coordinate, ...]:
        """First-order states; the fibre length is a guess that `start_states` replaces."""
        L0, fastest = self.optimal_fibre_length, self.optimal_fibre_length * self.max_contraction_velocity
        least = self.smallest_fibre_length
        fibre = Coordinate(
            "fibre_length", self.start_fibre_length or L0, scale=L0, rate_scale=fastest, differential_rate=False,
            least=least,
        )  # fmt: skip
        if not self.activation_dynamics:
            return (fibre,)
        quickest = 1.0 / min(self.activation_time_constant, self.deactivation_time_constant)
        return (fibre, Coordinate("activation", self.start_activation, rate_scale=quickest, differential_rate=False))

    @property
    def smallest_fibre_length(self) -> float:
        """q_min [m]: no fibre shortens below it."""
        return float(smallest_fibre(np.array(self.numbers())))

    @property
    def longest_start(self) -> float:
        """Fibre length [m] at which the passive force is MOST_PASSIVE times F0."""
        k = self.curves.passive_shape
        # log(1 + M (exp(k) - 1)), which does not overflow.
        exponent = k + math.log(MOST_PASSIVE + (1.0 - MOST_PASSIVE) * math.exp(-k))
        return self.optimal_fibre_length * (1.0 + self.curves.passive_strain * exponent / k)

    def limits(self) -> tuple[Limit, ...]:
        """Excitation in 0..1; fibre between its stop and the strain at which the passive curve is F0 (Thelen)."""
        return (
            Limit(
                "coordinate", f"{self.name}.fibre_length", "m",
                low=float(stop_begins(np.array(self.numbers()))),
                high=self.optimal_fibre_length * (1.0 + self.curves.passive_strain),
                below=f"a stop held its fibre within {STOP_WIDTH:g} L0 of the smallest length, "
                f"{self.smallest_fibre_length:.4g} m",
                above="its fibre was longer than (1 + passive_strain) L0, where the passive force is F0",
            ),
            Limit(
                "input", self.excitation, "-", low=0.0, high=1.0,
                below=f"its excitation, input '{self.excitation}', was below 0 and counted as {MINIMUM:g}",
                above=f"its excitation, input '{self.excitation}', was above 1 and counted as 1",
            ),
        )  # fmt: skip

    def input_names(self) -> tuple[str, ...]:
        """The excitation."""
        return (self.excitation,)

    def place(self, system) -> Placement:
        """Bodies that the path crosses between, then the muscle's own coordinates."""
        table = path_table(system, self.path)
        names = tuple(f"{self.name}.{c.name}" for c in self.coordinates())
        names += () if self.reflex is None else (self.reflex,)
        return Placement(
            bodies=table.bodies,
            coordinates=names,
            inputs=(self.excitation,),
            integers=(int(self.activation_dynamics) + int(self.reflex is not None), table.size, *table.integers),
            numbers=self.numbers(table.numbers),
            pattern=self._pattern(table, table.size + len(names)),
        )

    def numbers(self, path: tuple[float, ...] = ()) -> tuple[float, ...]:
        """The kernel's table; without a path it ends before it."""
        L0, curves = self.optimal_fibre_length, self.curves
        toe_strain, tendon_slope = curves.toe()
        return numbers_at(
            MUSCLE,
            F0=self.max_isometric_force,
            L0=L0,
            Ls=self.tendon_slack_length,
            height=L0 * math.sin(self.pennation_angle),
            fastest=L0 * self.max_contraction_velocity,
            activation_time=self.activation_time_constant,
            deactivation_time=self.deactivation_time_constant,
            active_shape=curves.active_shape,
            passive_shape=curves.passive_shape,
            passive_strain=curves.passive_strain,
            toe_strain=toe_strain,
            tendon_slope=tendon_slope,
            velocity_shape=curves.velocity_shape,
            lengthening_force=curves.lengthening_force,
            reflex_gain=self.reflex_gain,
            path=path,
        )

    @staticmethod
    def _pattern(table: PathTable, n: int) -> Pattern:
        """The tension depends on the whole length, so the bodies' block is full; the rest is the muscle's own."""
        m = table.size
        by_q, by_v = path_pattern(table, n), np.zeros((n, n), bool)
        by_q[: m + 1, : m + 1] = True
        by_q[m, m : m + 2] = True
        own = range(m, min(n, m + 2))
        by_q[own, own] = by_v[own, own] = True
        by_q[m + 1 : m + 2, m + 2 :] = True
        return Pattern(by_q, by_v, np.zeros((n, n), bool))

    def tension(self, length_mt: float, fibre_length: float) -> float:
        """Tendon force sigma [N] at the given muscle-tendon and fibre lengths [m]."""
        return tendon_state(np.array(self.numbers()), length_mt, fibre_length)[0]

    def equilibrium(self, length_mt: float, activation: float) -> float:
        """Fibre length [m] at rest under tension: F0 (a fl + fp) cos(alpha) = sigma; never below the smallest one.

        Args:
            length_mt: muscle-tendon length [m].
            activation: a [-], at least 0.01.

        Raises:
            ModelError: the tendon slack length leaves no room for the fibre within `length_mt`.
        """
        found = fibre_at_rest(np.array(self.numbers()), length_mt, activation)
        if self.tension(length_mt, found) <= 0.0:
            raise ModelError(
                f"{self.kind} '{self.name}': its path is {length_mt:.6g} m long, the tendon slack length is "
                f"{self.tendon_slack_length:.6g} m; that leaves no room for a fibre under tension. "
                "Shorten the tendon slack length or move the path points apart; to start with a slack tendon, give "
                "start_fibre_length."
            )
        return float(found)

    def start_states(self, system, q: np.ndarray, u: np.ndarray) -> tuple[tuple[float, float], ...]:
        """Start of the owned coordinates: fibre in equilibrium at rest, activation with its rate.

        Args:
            system: the declared system.
            q: local coordinates of the placement at the assembled start, shape (n,); those of bodies and the reflex
                are read.
            u: (value, rate, second derivative) of the excitation at the start, shape (1, 3).

        Returns:
            Pairs (q_m [m], its rate [m/s]) and, where it is a coordinate, (a [-], adot [1/s]). The fibre's rate is
            that of rest; with a given start_fibre_length the fibre row itself fixes it.

        Raises:
            ModelError: the path leaves no room for the fibre (see equilibrium).
        """
        table = path_table(system, self.path)
        length = path_length(np.array(table.integers, np.int32), 0, np.array(table.numbers), 0, np.asarray(q, float))
        reflex = 0.0 if self.reflex is None else self.reflex_gain * float(q[table.size + 2])
        excitation = limited(float(u[0, 0]) + reflex)[0]
        a = self.start_activation if self.activation_dynamics else excitation
        fibre = (self.start_fibre_length or self.equilibrium(length, a), 0.0)
        if not self.activation_dynamics:
            return (fibre,)
        tau = self.activation_time_constant, self.deactivation_time_constant
        return (fibre, (a, activation_rate(a, excitation, *tau)[0]))
