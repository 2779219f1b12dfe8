"""Beam element: the elastic force between two bodies that are sections of one beam (Simo and Reissner).

With stretch g and turn theta of the two sections (strains.py), L the length of the element, C = diag(EA, GA_y, GA_z)
and D = diag(GJ, EI_y, EI_z), both sections' x axes along the beam:

    U = L/2 (Gamma^T C Gamma + kappa^T D kappa),  Gamma = g / L - Gamma_0,  kappa = (theta - theta_0) / L
    N = C (Gamma + tau Gamma_t),  M = D (kappa + tau kappa_t),  Q = -g_q^T N - theta_q^T M

Rotations and positions may be as large as they like; one element may turn by less than half a turn between its ends.

The strains are those half-way, constant along the element. What a linear moment along it adds to the deflection is put
back into the shear stiffness (R. H. MacNeal (1978), Comput. Struct. 8:175-183, residual bending flexibility):

    1 / GA_y -> 1 / (k_y G A) + L^2 / (12 E I_z),  likewise z with I_y

so that there is no locking, and a straight beam loaded at its nodes is exact there as long as deflections are small.

The mass of the beam is that of its nodes, which are rigid bodies; beam_mass.py turns it into the consistent one.
"""

from __future__ import annotations

from typing import ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field

import dms_core.model.flexible.beams.strains as strain
from dms_core.compiled.jit import compiled
from dms_core.errors import ModelError
from dms_core.model.element import Force, Pattern, Placement, Vector
from dms_core.model.flexible.beams.beam_mass import add_beam_mass
from dms_core.model.flexible.beams.section import BeamSection
from dms_core.model.geometry.quaternions import PARAMETERS, conjugate, inner4, product, scaled4, sum4
from dms_core.model.geometry.rotations import AXES, add, dot, euler_parameters, sub, vec
from dms_core.model.places import numbers_at

ASKEW = 0.1
"""Sine of the largest angle between the line through the nodes and their mean x axis: strains of a beam are small, so
that more is a wrong orientation."""


class BeamNumbers(NamedTuple):
    """Places of the kernel's numbers."""

    stretching: int = 0
    """EA, GA_y, GA_z over the length [N/m]."""
    turning: int = 3
    """GJ, EI_y, EI_z over the length [N m]."""
    rest_stretch: int = 6
    """g at rest [m]."""
    rest_turn: int = 9
    """theta at rest [rad]."""
    damping_time: int = 12
    length: int = 13
    mass_share: int = 14
    """rho A L / 420 of a consistent mass [kg], 0 for a lumped one."""


BEAM = BeamNumbers()

STILL3, STILL4 = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)


@compiled
def near_sign(q):
    """-1 where the second section's Euler parameters must change sign to be near the first's, else 1."""
    return 1.0 if inner4(euler_parameters(q, 0), euler_parameters(q, 7)) >= 0.0 else -1.0


@compiled
def sections(x, sign):
    """(d, m, p, s) of the two bodies in x = q or v: difference of positions, sum of Euler parameters, and these."""
    p, s = euler_parameters(x, 0), scaled4(sign, euler_parameters(x, 7))
    return sub(vec(x, 7), vec(x, 0)), sum4(p, s), p, s


@compiled
def stretch_direction(n, sign):
    """(x, y, near, far): near x and near y are what local coordinate n of the first section changes of m and d.

    Coordinate n of the second section changes them by far x and far y.
    """
    if n < 3:
        return STILL4, AXES[n], -1.0, 1.0
    return PARAMETERS[n - 3], STILL3, 1.0, sign


@compiled
def turn_direction(n, sign):
    """(x, y, column, factor): factor x and factor y are what local coordinate `column` changes of p and s, n < 8."""
    if n < 4:
        return PARAMETERS[n], STILL4, 3 + n, 1.0
    return STILL4, PARAMETERS[n - 4], 6 + n, sign


@compiled
def relative_rate(p, s, x, y):
    """Derivative of conj(p) s along x of p and y of s."""
    return sum4(product(conjugate(x), s), product(conjugate(p), y))


@compiled
def elastic(stiffness, value, rest, tau, rate):
    """Three section loads: stiffness (value - rest + tau rate)."""
    return (
        stiffness[0] * (value[0] - rest[0] + tau * rate[0]),
        stiffness[1] * (value[1] - rest[1] + tau * rate[1]),
        stiffness[2] * (value[2] - rest[2] + tau * rate[2]),
    )


@compiled
def beam_forces(par, q, v):
    """(N, Q_y, Q_z) and (T, M_y, M_z), in the axes half-way."""
    sign = near_sign(q)
    d, m, p, s = sections(q, sign)
    dv, mv, pv, sv = sections(v, sign)
    c, tau = product(conjugate(p), s), par[BEAM.damping_time]
    factors, g = strain.turn_factors(c), strain.stretch(m, d)
    c_rate = relative_rate(p, s, pv, sv)
    return (
        elastic(vec(par, BEAM.stretching), g, vec(par, BEAM.rest_stretch), tau, strain.stretch_rate(m, d, g, mv, dv)),
        elastic(
            vec(par, BEAM.turning), strain.turn(c, factors), vec(par, BEAM.rest_turn), tau,
            strain.turn_rate(c, factors, c_rate),
        ),
    )  # fmt: skip


@compiled
def _put(J, column, factor, by_d, by_p, by_s):
    """One column of a local matrix: rows of both positions and both sets of Euler parameters."""
    for i in range(3):
        J[i, column] -= factor * by_d[i]
        J[7 + i, column] += factor * by_d[i]
    for i in range(4):
        J[3 + i, column] += factor * by_p[i]
        J[10 + i, column] += factor * by_s[i]


@compiled
def second_stretch(m, d, g, mv, dv, x, y):
    """Second derivative of the stretch, along (mv, dv) and (x, y)."""
    a = strain.stretch_pull_rate(m, d, g, mv, dv, AXES[0])
    b = strain.stretch_pull_rate(m, d, g, mv, dv, AXES[1])
    c = strain.stretch_pull_rate(m, d, g, mv, dv, AXES[2])
    return (
        dot(a[0], y) + inner4(a[1], x),
        dot(b[0], y) + inner4(b[1], x),
        dot(c[0], y) + inner4(c[1], x),
    )


@compiled
def second_turn(p, s, c, factors, pv, sv, c_rate, x, y):
    """Second derivative of the turn, along (pv, sv) and (x, y)."""
    cx = relative_rate(p, s, x, y)
    # c is bilinear in p and s.
    cvx = sum4(product(conjugate(x), sv), product(conjugate(pv), y))
    k = strain.turn_rate(c, factors, cvx)
    return (
        k[0] + inner4(strain.turn_pull_rate(c, factors, c_rate, AXES[0]), cx),
        k[1] + inner4(strain.turn_pull_rate(c, factors, c_rate, AXES[1]), cx),
        k[2] + inner4(strain.turn_pull_rate(c, factors, c_rate, AXES[2]), cx),
    )


@compiled
def _stretch_column(stiffness, m, d, g, N, dv, mv, tau, x, y):
    """Derivatives along (x of m, y of d) of g_q^T N by positions, and of its damping part by rates: (d, m) each."""
    by_x = strain.stretch_rate(m, d, g, x, y)
    k = second_stretch(m, d, g, mv, dv, x, y) if tau > 0.0 else STILL3
    a = strain.stretch_pull(m, d, g, elastic(stiffness, by_x, STILL3, tau, k))
    b = strain.stretch_pull_rate(m, d, g, x, y, N)
    rates = strain.stretch_pull(m, d, g, elastic(stiffness, STILL3, STILL3, tau, by_x))
    return add(a[0], b[0]), sum4(a[1], b[1]), rates[0], rates[1]


@compiled
def _turn_column(stiffness, p, s, c, factors, M, pv, sv, c_rate, tau, x, y):
    """Derivatives along (x of p, y of s) of theta_q^T M by Euler parameters, and of its damping part by rates."""
    cx = relative_rate(p, s, x, y)
    by_x = strain.turn_rate(c, factors, cx)
    k = second_turn(p, s, c, factors, pv, sv, c_rate, x, y) if tau > 0.0 else STILL3
    change = elastic(stiffness, by_x, STILL3, tau, k)
    T = strain.turn_pull(c, factors, M)
    T_rate = sum4(strain.turn_pull(c, factors, change), strain.turn_pull_rate(c, factors, cx, M))
    R = strain.turn_pull(c, factors, elastic(stiffness, STILL3, STILL3, tau, by_x))
    by_p = sum4(product(y, conjugate(T)), product(s, conjugate(T_rate)))
    by_s = sum4(product(x, T), product(p, T_rate))
    return by_p, by_s, product(s, conjugate(R)), product(p, R)


@compiled
def _stretch_derivatives(par, q, v, N, Jq, Jv):
    """Jq and Jv of g_q^T N."""
    sign, tau, stiffness = near_sign(q), par[BEAM.damping_time], vec(par, BEAM.stretching)
    d, m, p, s = sections(q, sign)
    dv, mv, pv, sv = sections(v, sign)
    g = strain.stretch(m, d)
    for n in range(7):
        x, y, near, far = stretch_direction(n, sign)
        by_d, by_m, d_rate, m_rate = _stretch_column(stiffness, m, d, g, N, dv, mv, tau, x, y)
        for column, factor in ((n, near), (7 + n, far)):
            _put(Jq, column, factor, by_d, by_m, scaled4(sign, by_m))
            if tau > 0.0:
                _put(Jv, column, factor, d_rate, m_rate, scaled4(sign, m_rate))


@compiled
def _turn_derivatives(par, q, v, M, Jq, Jv):
    """Jq and Jv of theta_q^T M."""
    sign, tau, stiffness = near_sign(q), par[BEAM.damping_time], vec(par, BEAM.turning)
    d, m, p, s = sections(q, sign)
    dv, mv, pv, sv = sections(v, sign)
    c = product(conjugate(p), s)
    factors, c_rate = strain.turn_factors(c), relative_rate(p, s, pv, sv)
    for n in range(8):
        x, y, column, factor = turn_direction(n, sign)
        by_p, by_s, p_rate, s_rate = _turn_column(stiffness, p, s, c, factors, M, pv, sv, c_rate, tau, x, y)
        _put(Jq, column, factor, STILL3, by_p, scaled4(sign, by_s))
        if tau > 0.0:
            _put(Jv, column, factor, STILL3, p_rate, scaled4(sign, s_rate))


@compiled
def beam_element(ip, par, q, v, a, u, level, r, Jq, Jv, Ja):
    """Rows g_q^T N + theta_q^T M; ip: none."""
    N, M = beam_forces(par, q, v)
    sign = near_sign(q)
    d, m, p, s = sections(q, sign)
    c = product(conjugate(p), s)
    by_d, by_m = strain.stretch_pull(m, d, strain.stretch(m, d), N)
    T = strain.turn_pull(c, strain.turn_factors(c), M)
    by_p, by_s = sum4(by_m, product(s, conjugate(T))), sum4(by_m, product(p, T))
    for i in range(3):
        r[i] -= by_d[i]
        r[7 + i] += by_d[i]
    for i in range(4):
        r[3 + i] += by_p[i]
        r[10 + i] += sign * by_s[i]
    if level > 0:
        _stretch_derivatives(par, q, v, N, Jq, Jv)
        _turn_derivatives(par, q, v, M, Jq, Jv)
    if par[BEAM.mass_share] > 0.0:
        add_beam_mass(par[BEAM.mass_share], par[BEAM.length], q, v, a, level, r, Jq, Jv, Ja)


class BeamElement(Force):
    """Elastic beam between the reference frames of two rigid bodies, whose x axes lie along it.

    It is at rest in the declared start pose of its bodies, unless `length`, `rest_strain` or `rest_curvature` say
    otherwise. A whole beam with its nodes is declared as one `beam`.
    """

    kind: ClassVar[str] = "beam_element"
    kernel: ClassVar = beam_element
    body_i: str = Field(description="first node, or 'ground'")
    body_j: str = Field(description="second node, in the direction of the x axis")
    section: BeamSection = Field(description="cross-section and material")
    length: float | None = Field(
        default=None,
        gt=0.0,
        description="length along the beam at rest [m]; default: distance of the nodes at the start",
    )
    rest_strain: Vector | None = Field(
        default=None,
        description="axial and two shear strains at rest, 0 for a beam as long as `length` [-]; default: at the start",
    )
    rest_curvature: Vector | None = Field(
        default=None, description="twist and two curvatures at rest [rad/m]; default: those at the start"
    )
    damping_time: float = Field(
        default=0.0, ge=0.0, description="tau [s]: section loads are stiffness times (strain + tau strain rate)"
    )
    mass: Literal["lumped", "consistent"] = Field(
        default="lumped",
        description="that of the nodes alone, or made that of the cubic between them; nodes have half of it each",
    )

    def mass_moments(self, system) -> dict[str, np.ndarray]:
        """That of a consistent mass, rho A L^2 / 12 ahead of the first node and behind the second."""
        if self.mass == "lumped":
            return {}
        length = float(np.linalg.norm(self._start(system)[0])) if self.length is None else self.length
        moment = np.array([[self.section.mass_per_length * length**2 / 12.0, 0.0, 0.0]])
        return {self.body_i: moment, self.body_j: -moment}

    def place(self, system) -> Placement:
        """Both bodies; stiffnesses over the length, and the state of rest."""
        g, theta = self._start(system)
        length = float(np.linalg.norm(g)) if self.length is None else self.length
        rest = g if self.rest_strain is None else length * (np.array(self.rest_strain) + AXES[0])
        turn = theta if self.rest_curvature is None else length * np.array(self.rest_curvature)
        stretching, turning = self.section.stiffnesses(length)
        consistent, damped = self.mass == "consistent", self.damping_time > 0.0
        mass_share = self.section.mass_per_length * length / 420.0 if consistent else 0.0
        numbers = numbers_at(
            BEAM, stretching=stretching / length, turning=turning / length, rest_stretch=rest, rest_turn=turn,
            damping_time=self.damping_time, length=length, mass_share=mass_share,
        )  # fmt: skip
        full, none = np.ones((14, 14), bool), np.zeros((14, 14), bool)
        turned = np.tile(np.arange(7) >= 3, 2)
        apart = turned[:, None] | turned | np.tile(np.eye(7, dtype=bool), (2, 2))
        by_rates = full if damped else np.tile(turned, (14, 1)) if consistent else none
        return Placement(
            bodies=(self.body_i, self.body_j),
            numbers=numbers,
            pattern=Pattern(full, by_rates, apart if consistent else none),
        )

    def _start(self, system) -> tuple[np.ndarray, np.ndarray]:
        """Stretch [m] and turn [rad] at the declared start.

        Raises:
            ModelError: a body has no frame, the nodes coincide, or their x axes do not lie along the beam.
        """
        who = f"beam_element '{self.name}'"
        q = np.zeros(14)
        for o, name in ((0, self.body_i), (7, self.body_j)):
            body = system.body(name)
            if body is not None and (not body.rigid or np.any(getattr(body, "centre_of_mass", STILL3))):
                raise ModelError(
                    f"{who}: Expected rigid bodies with the centre of mass at their origin as nodes, got the "
                    f"{body.kind} '{name}'."
                )
            q[o : o + 3] = system.start_pose(name)[0]
            q[o + 3 : o + 7] = (1.0, 0.0, 0.0, 0.0) if body is None else body.orientation
        sign = near_sign(q)
        d, m, p, s = sections(q, sign)
        c = product(conjugate(p), s)
        g, theta = np.array(strain.stretch(m, d)), np.array(strain.turn(c, strain.turn_factors(c)))
        distance = float(np.linalg.norm(g))
        if self.body_i == self.body_j:
            raise ModelError(f"{who}: Expected two different bodies, got '{self.body_i}' twice.")
        if distance < 1e-9:
            raise ModelError(f"{who}: '{self.body_i}' and '{self.body_j}' start at the same place.")
        if np.hypot(g[1], g[2]) > ASKEW * distance or g[0] < 0.0:
            off = float(np.degrees(np.arctan2(np.hypot(g[1], g[2]), g[0])))
            raise ModelError(
                f"{who}: Expected the x axes of its nodes along the beam, from '{self.body_i}' to '{self.body_j}'; at "
                f"the start they lie {off:.3g} degrees off it."
            )
        return g, theta
