"""The contract between an element and the system: what is declared, what is placed, what a kernel computes.

An element is two things in one file: a frozen declaration (its class: names, numbers, units) and a compiled
kernel (a function of small local arrays). The system gathers the local coordinates, runs the kernel,
and scatters what it wrote; the element never learns where its numbers go.

Local coordinates: seven per body named in `Placement.bodies` (position of the centre of mass, Euler parameters;
the ground and a point mass look like bodies whose missing coordinates are constant), then `Placement.coordinates`.
The local arrays are work space of the largest size any element needs, so that a kernel must know its own sizes (from
`ip`) and never ask for len(q). All outputs are zero before a kernel is called. `level` is 0
for values, 1 for values and derivatives.

Dynamic kernel (bodies, forces, ropes, muscles, controllers): rows of M vdot + phi_q^T lam - f = 0

    kernel(ip, par, q, v, a, u, level, r, Jq, Jv, Ja)
      r[i]  contribution to row i of  M vdot - f                  Jq, Jv, Ja  its derivatives by q, v, a = vdot

Constraint kernel: rows of phi(q, u) = 0

    kernel(ip, par, q, v, lam, u, level, phi, phi_t, G, W, H)
      phi[k]            the equations                              phi_t[k, 0:2]  their first and second partial time
      G[k, j]           phi_q                                                     derivatives (inputs enter additively)
      W[k, j]           (phi_q v)_q                                H[i, j]        (phi_q^T lam)_q

Sensor kernel: y = h(q, v, vdot, lam, u)

    kernel(ip, par, q, v, a, lam, u, level, y, Yq, Yv, Ya, Yl, Yu)

`ip` and `par` are the integers and numbers of `Placement`; `u[k]` is (value, rate, second derivative) of input k.
A sensor reads values of inputs only, and Yu[i, k] is the derivative of y[i] by the value of input k.

Derivatives by inputs and parameters are asked for by estimation, sensitivities and linearisation, never by a step. A
dynamic element may have two more compiled functions for them; outputs are zero before each call:

    input_kernel(ip, par, q, v, a, u, Ju)          Ju[i, k, j]  derivative of r[i] by u[k, j]
    parameter_kernel(ip, par, q, v, a, u, Jp)      Jp[i, p]     derivative of r[i] by par[p], for every p

They are called only for placements with inputs, and with numbers. Where an element has none, or a subclass has a
kernel of its own and inherits the other, the kernel is differentiated by central differences, and the result names the
element (input_derivatives.py, parameter_derivatives.py). Constraints need no such function: what a kernel writes into
phi_t for given rates of its inputs tells the derivative by them. Derivatives of constraints and sensors by parameters
are differences.

An element may also read sensors, and drive inputs that others read: `Placement.reads`, `driven_inputs`. A force, a
muscle, a motor or another controller need not know whether its input is a course in time or driven.

An element whose own coordinates depend on the assembled position (a fibre in equilibrium, a controller's error) may
have a method `start_states(system, q, u)` that gives one pair (value, rate) for each coordinate it owns, from the local
coordinates q and inputs u (k, 3) of its first placement at the start.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

import numpy as np
from numba import float64, int32, int64, types
from pydantic import Field, model_validator

from dms_core.errors import DmsError, ModelError
from dms_core.validation import Checked, check_sizes

_I = types.Array(int32, 1, "C")
_A = types.Array(float64, 1, "C")
_B = types.Array(float64, 2, "C")

DYNAMIC = types.void(_I, _A, _A, _A, _A, _B, int64, _A, _B, _B, _B)
CONSTRAINT = types.void(_I, _A, _A, _A, _A, _B, int64, _A, _B, _B, _B, _B)
SENSOR = types.void(_I, _A, _A, _A, _A, _A, _B, int64, _A, _B, _B, _B, _B, _B)
INPUT_DERIVATIVE = types.void(_I, _A, _A, _A, _A, _B, types.Array(float64, 3, "C"))
PARAMETER_DERIVATIVE = types.void(_I, _A, _A, _A, _A, _B, _B)

GROUND = "ground"

Vector = Annotated[tuple[float, float, float], Field(description="three numbers")]
Quaternion = tuple[float, float, float, float]


class Coordinate(NamedTuple):
    """One generalised coordinate that an element owns."""

    name: str
    start: float
    """Value of q at the start (a guess where assembly may move it)."""
    rate: float = 0.0
    """Value of v at the start."""
    scale: float = 1.0
    """Nominal size of q, in its unit: the absolute tolerance is this times rtol."""
    rate_scale: float = 1.0
    """Nominal size of v, in its unit per second."""
    differential_rate: bool = True
    """True when vdot appears in the element's row (a second-order coordinate); False when the row fixes v
    itself (a first-order state: fibre length, activation), which then is an algebraic variable."""
    least: float = -math.inf
    """Value below which no solution is: dense output, which is rougher than the steps, is not let below it."""


class Limit(NamedTuple):
    """A range outside which an element's equations say something else than what it stands for.

    The solution is computed there too, and the result of a run says when and how far the range was left.
    """

    of: Literal["coordinate", "multiplier", "input"]
    name: str
    """Full name of the coordinate, constraint row or input."""
    unit: str
    low: float = -math.inf
    high: float = math.inf
    below: str = ""
    """What is so below `low`: a clause whose subject is the element."""
    above: str = ""
    share: float = 0.0
    """Largest error that a run may have in the value, over its largest size (`flags.py`); 0 for an exact value."""


class Compositions(NamedTuple):
    """How a sensor is evaluated; a composed one needs no kernel."""

    none: int = 0
    """By its own kernel."""
    reaction: int = 1
    """Load of `Placement.constraint` on one of its bodies. Integers: offset of that body, of the body whose axes are
    used (-1: the ground); numbers: the point, from the centre of mass."""
    joint_moment: int = 2
    """Moment of `Placement.sources` on all bodies of the placement but the first. Numbers: centre and axis on the
    first body, see MOMENT."""
    force_load: int = 3
    """Load of `Placement.sources` on the first body of the placement. Integers: offset of the body whose axes are used
    (-1: the ground); numbers: the point, from the centre of mass."""


class MomentNumbers(NamedTuple):
    """Places of the numbers of a joint moment."""

    centre: int = 0
    """From the centre of mass [m]."""
    axis: int = 3


COMPOSITIONS, MOMENT = Compositions(), MomentNumbers()


class Pattern(NamedTuple):
    """Which local derivatives can be non-zero: boolean, shapes (n, n) each."""

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray


class ConstraintPattern(NamedTuple):
    """Which local derivatives can be non-zero: G (m, n), W (m, n), H (n, n), boolean."""

    G: np.ndarray
    W: np.ndarray
    H: np.ndarray


@dataclass(frozen=True)
class Placement:
    """Where one kernel call finds its data."""

    bodies: tuple[str, ...] = ()
    coordinates: tuple[str, ...] = ()
    inputs: tuple[str, ...] = ()
    integers: tuple[int, ...] = ()
    numbers: tuple[float, ...] = ()
    pattern: Any = None
    """Pattern or ConstraintPattern; None means everything may be non-zero."""
    constraint: str = ""
    """Sensors only: the constraint whose multipliers are handed in as lam."""
    sources: tuple[str, ...] = field(default=())
    """Composed sensors only: elements whose own kernels are evaluated first."""
    reads: str = ""
    """Dynamic elements only: a sensor component by its full name. This is then no call of the element's kernel, but the
    row v - y = 0 of its one coordinate, an own first-order one: its rate is the reading."""
    wired: bool = False
    """Set where an input that the call reads is driven by an element (dms_core.assembly.pattern.connections)."""

    @property
    def size(self) -> int:
        """Number of local coordinates n."""
        return 7 * len(self.bodies) + len(self.coordinates)


class Declaration(Checked):
    """A named, frozen, validated part of a system. Wrong values raise ModelError with name, key and value."""

    wrong: ClassVar[type[DmsError]] = ModelError
    kind: ClassVar[str] = ""
    name: str = Field(min_length=1, description="unique name")

    @model_validator(mode="after")
    def _sizes(self):
        check_sizes(self)
        return self

    def limits(self) -> tuple[Limit, ...]:
        """Ranges whose leaving the result of a run reports."""
        return ()


class DynamicElement(Declaration):
    """Anything that writes rows of M vdot + phi_q^T lam - f = 0."""

    kernel: ClassVar[Any] = None
    input_kernel: ClassVar[Any] = None
    """Derivatives of the rows by inputs; None where they are to be found by differences."""
    parameter_kernel: ClassVar[Any] = None
    """Derivatives of the rows by the numbers of the placement; None where they are to be found by differences."""

    def coordinates(self) -> tuple[Coordinate, ...]:
        """Coordinates this element owns, by local name; the system prefixes '<element>.'."""
        return ()

    reads_input_rates: ClassVar[bool] = False
    """Whether the kernel reads rates of inputs, so that none of them can be driven by an element."""

    def input_names(self) -> tuple[str, ...]:
        """Names of the system inputs that the element reads."""
        return ()

    def mass_moments(self, system) -> dict[str, np.ndarray]:
        """First moments of the element's mass about r of a body, by body, in its axes [kg m], shape (1 + k, 3).

        The first row is the moment at the start of the body's k further coordinates, 0; the others are its derivatives
        by these, [kg m] over their unit. Most elements have none.
        """
        return {}

    def driven_inputs(self) -> tuple[tuple[str, str], ...]:
        """(input, own coordinate) for each system input that the element drives: its value is the coordinate's rate."""
        return ()

    def place(self, system) -> Placement:
        """Bodies, coordinates, inputs and tables of the one kernel call."""
        raise NotImplementedError

    def placements(self, system) -> tuple[Placement, ...]:
        """One entry per kernel call; most elements have one."""
        return (self.place(system),)


class Body(DynamicElement):
    """A body owns coordinates and inertia."""

    rigid: ClassVar[bool] = True


class Force(DynamicElement):
    """A force, rope, muscle, controller or differential equation."""


class Constraint(Declaration):
    """Equations phi(q, u) = 0."""

    kernel: ClassVar[Any] = None
    own_points: ClassVar[tuple[int, ...]] = ()
    """Places in `Placement.numbers` of the constraint's own point on its first and its second body, from the centre of
    mass [m]: where a reaction is measured by default. Without them that is the centre of mass."""

    def rows(self) -> tuple[str, ...]:
        """Names of the equations, in the kernel's order."""
        raise NotImplementedError

    def aligned(self, numbers: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
        """Directions of the first body and those of the second that coincide with them, as rows, shapes (k, 3) each.

        A joint whose equations also hold with a body turned over declares them, so that assembly can refuse that.

        Args:
            numbers: those of the placement.
        """
        return np.zeros((0, 3)), np.zeros((0, 3))

    def welded(self) -> tuple[str, ...]:
        """Bodies that this constraint leaves no freedom relative to each other; none unless it is a weld."""
        return ()

    def governs(self) -> str:
        """What this constraint determines, in words, where no second one may: "the angle of 'elbow'"; '' for nothing.

        Two of the same words in one system contradict each other or say one thing twice, and are refused.
        """
        return ""

    def companions(self) -> tuple[DynamicElement, ...]:
        """Elements that come with this constraint; the system adds them, and no file lists them."""
        return ()

    def place(self, system) -> Placement:
        """Bodies, coordinates, inputs and tables of the kernel call."""
        raise NotImplementedError


class Parts(NamedTuple):
    """What a composition stands for."""

    bodies: tuple[Body, ...] = ()
    constraints: tuple[Constraint, ...] = ()
    forces: tuple[Force, ...] = ()


class Composition(Declaration):
    """A declaration that stands for several others, whose names begin with its own and a dot."""

    def parts(self) -> Parts:
        """The declarations it stands for; the same ones each time."""
        raise NotImplementedError


class Sensor(Declaration):
    """Measured quantities y = h(q, v, vdot, lam, u)."""

    kernel: ClassVar[Any] = None
    composition: ClassVar[int] = COMPOSITIONS.none

    def outputs(self) -> tuple[tuple[str, str], ...]:
        """(name, unit) of each component; names are suffixes of the sensor's own name, '' for a scalar."""
        raise NotImplementedError

    def place(self, system) -> Placement:
        """Bodies, coordinates, inputs and tables of the kernel call."""
        raise NotImplementedError
