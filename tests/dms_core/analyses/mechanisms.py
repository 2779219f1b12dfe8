"""Small systems with closed forms, shared by the tests of the analyses."""

from __future__ import annotations

import math

from dms_core.model import (
    AngleDriver,
    Constant,
    Distance,
    Gravity,
    Input,
    JointAngle,
    JointSpringDamper,
    LineGuide,
    LumpedLoad,
    Point,
    PointMass,
    Revolute,
    RigidBody,
    SpringDamper,
    System,
)

G = 9.81


def rod(name: str, length: float, mass: float, origin=(0.0, 0.0, 0.0), angle: float = 0.0) -> RigidBody:
    """A uniform rod along its own x, from its origin; turned by an angle about z."""
    inertia = mass * length**2 / 12.0
    return RigidBody(
        name=name, mass=mass, inertia=(1e-3 * inertia, inertia, inertia), centre_of_mass=(0.5 * length, 0.0, 0.0),
        position=origin, orientation=(math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle)),
    )  # fmt: skip


def hinge(name: str, body_i: str, body_j: str, point_i, point_j) -> Revolute:
    return Revolute(name=name, body_i=body_i, body_j=body_j, point_i=point_i, point_j=point_j)


def von_mises_truss(half_span: float, height: float, stiffness: float, force: float) -> System:
    """Two springs that meet in a node which is pushed down along a track."""
    return System(
        "truss",
        bodies=[PointMass(name="node", mass=1.0, position=(0.0, height, 0.0))],
        constraints=[LineGuide(name="track", body_j="node", axis_i=(0.0, 1.0, 0.0))],
        forces=[
            SpringDamper(name="left", body_j="node", point_i=(-half_span, 0.0, 0.0), stiffness=stiffness),
            SpringDamper(name="right", body_j="node", point_i=(half_span, 0.0, 0.0), stiffness=stiffness),
            LumpedLoad(name="push", body="node", force=(0.0, -1.0, 0.0), input="P"),
        ],
        sensors=[Point(name="top", body="node")],
        inputs=[Input(name="P", signal=Constant(value=force))],
    )


def column(links: int, length: float, stiffness: float, force: float) -> System:
    """Links on each other with a torsion spring below each, pressed along their axis."""
    bodies, joints, springs, below = [], [], [], "ground"
    for k in range(links):
        name = f"link{k}"
        bodies.append(rod(name, length, 1.0, (0.0, k * length, 0.0), 0.5 * math.pi))
        joints.append(hinge(f"joint{k}", below, name, (length, 0.0, 0.0) if k else (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
        pointers = {} if k else {"pointer_i": (0.0, 1.0, 0.0), "pointer_j": (1.0, 0.0, 0.0)}
        springs.append(JointSpringDamper(name=f"spring{k}", joint=f"joint{k}", stiffness=stiffness, **pointers))
        below = name
    push = LumpedLoad(name="push", body=below, point=(length, 0.0, 0.0), force=(0.0, -1.0, 0.0), input="P")
    return System(
        "column", bodies=bodies, constraints=joints, forces=[*springs, push],
        inputs=[Input(name="P", signal=Constant(value=force))],
    )  # fmt: skip


def double_pendulum(length: float, angles=(0.0, 0.0), rates=None, forces=(), sensors=(), inputs=()) -> System:
    """Two equal uniform rods that hang at angles from the vertical."""
    first, second = (a - 0.5 * math.pi for a in angles)
    tip = (length * math.cos(first), length * math.sin(first), 0.0)
    return System(
        "double pendulum",
        bodies=[rod("upper", length, 1.0, angle=first), rod("lower", length, 1.0, tip, second)],
        constraints=[
            hinge("shoulder", "ground", "upper", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
            hinge("elbow", "upper", "lower", (length, 0.0, 0.0), (0.0, 0.0, 0.0)),
        ],
        forces=[Gravity(name="weight", acceleration=(0.0, -G, 0.0)), *forces],
        sensors=[JointAngle(name="bend", joint="elbow"), *sensors],
        inputs=inputs,
    )


def spring_mass_chain(n: int, mass: float, stiffness: float, damping: float = 0.0) -> System:
    """n masses between n + 1 springs and two walls, along x."""
    bodies = [PointMass(name=f"mass{k}", mass=mass, position=(k + 1.0, 0.0, 0.0)) for k in range(n)]
    names = ["ground", *(b.name for b in bodies), "ground"]
    springs = [
        SpringDamper(
            name=f"spring{k}", body_i=a if k else "ground", body_j=b if k < n else names[n],
            point_i=(0.0, 0.0, 0.0), point_j=(0.0, 0.0, 0.0), stiffness=stiffness, damping=damping,
        )
        for k, (a, b) in enumerate(zip(names[:-2], names[1:-1], strict=True))
    ]  # fmt: skip
    last = SpringDamper(name="last", body_j=names[n], point_i=(n + 1.0, 0.0, 0.0), stiffness=stiffness, damping=damping)
    tracks = [LineGuide(name=f"track{k}", body_j=b.name, axis_i=(1.0, 0.0, 0.0)) for k, b in enumerate(bodies)]
    return System("chain", bodies=bodies, constraints=tracks, forces=[*springs, last])


def hanging_chain(links: int, length: float, span: float, mass: float) -> System:
    """Equal rods between two points at one height; they start on a half circle or a polygon near it."""
    # Joints on an arc of the right length below the supports.
    half = _half_angle(links, length, span)
    radius = 0.5 * length / math.sin(half / links)
    points = [
        (
            0.5 * span + radius * math.sin(-half + 2.0 * half * k / links),
            -radius * math.cos(-half + 2.0 * half * k / links) + radius * math.cos(half),
            0.0,
        )
        for k in range(links + 1)
    ]
    bodies, joints, before = [], [], "ground"
    for k in range(links):
        a, b = points[k], points[k + 1]
        bodies.append(rod(f"link{k}", length, mass, a, math.atan2(b[1] - a[1], b[0] - a[0])))
        end = (length, 0.0, 0.0) if k else (0.0, 0.0, 0.0)
        joints.append(hinge(f"joint{k}", before, f"link{k}", end, (0.0, 0.0, 0.0)))
        before = f"link{k}"
    # A hinge would repeat rows of the plane loop; a rod of no length cannot be, so two rows of a guide close it.
    joints.append(LineGuide(name="end", body_i="ground", body_j=before, point_i=(span, 0.0, 0.0),
                            point_j=(length, 0.0, 0.0), axis_i=(0.0, 0.0, 1.0)))  # fmt: skip
    return System("hanging chain", bodies=bodies, constraints=joints,
                  forces=[Gravity(name="weight", acceleration=(0.0, -G, 0.0))])  # fmt: skip


def _half_angle(links: int, length: float, span: float) -> float:
    """Half the angle of an arc whose polygon of equal links spans the supports."""
    low, high = 1e-6, math.pi - 1e-6
    for _ in range(200):
        half = 0.5 * (low + high)
        if length * math.sin(half) / math.sin(half / links) > span:
            low = half
        else:
            high = half
    return 0.5 * (low + high)


def slider_crank(crank: float, rod_length: float, signal) -> System:
    """A crank about z that pushes a slider along x over a connecting rod."""
    return System(
        "slider-crank",
        bodies=[
            rod("crank", crank, 1.0),
            rod("rod", rod_length, 1.0, (crank, 0.0, 0.0)),
            PointMass(name="piston", mass=1.0, position=(crank + rod_length, 0.0, 0.0)),
        ],
        constraints=[
            hinge("bearing", "ground", "crank", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
            hinge("pin", "crank", "rod", (crank, 0.0, 0.0), (0.0, 0.0, 0.0)),
            LineGuide(name="track", body_j="piston", axis_i=(1.0, 0.0, 0.0)),
            LineGuide(name="wrist", body_i="rod", body_j="piston", point_i=(rod_length, 0.0, 0.0),
                      axis_i=(0.0, 0.0, 1.0)),
            AngleDriver(name="motor", joint="bearing", input="turn"),
        ],
        sensors=[Point(name="place", body="piston"), JointAngle(name="swing", joint="pin")],
        inputs=[Input(name="turn", signal=signal)],
    )  # fmt: skip


def four_bar(lengths, signal, driven: str = "main", crank_angle: float = 1.0, **more) -> System:
    """Crank, coupler, rocker and base; `driven` names the joint whose angle follows the signal."""
    a, b, c, d = lengths
    beta, theta = four_bar_angles(lengths, crank_angle)
    pin = (a * math.cos(crank_angle), a * math.sin(crank_angle), 0.0)
    bearing = "rocker_bearing" if driven == "rocker" else "main_bearing"
    return System(
        "four-bar",
        bodies=[
            rod("crank", a, 1.0, angle=crank_angle), rod("coupler", b, 1.0, pin, beta),
            rod("rocker", c, 1.0, (d, 0.0, 0.0), theta),
        ],
        constraints=[
            hinge("main_bearing", "ground", "crank", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
            hinge("crank_pin", "crank", "coupler", (a, 0.0, 0.0), (0.0, 0.0, 0.0)),
            hinge("rocker_pin", "coupler", "rocker", (b, 0.0, 0.0), (c, 0.0, 0.0)),
            hinge("rocker_bearing", "ground", "rocker", (d, 0.0, 0.0), (0.0, 0.0, 0.0)),
            *([] if signal is None else [AngleDriver(name="motor", joint=bearing, input="turn")]),
            *more.get("constraints", ()),
        ],
        forces=[Gravity(name="weight", acceleration=(0.0, -G, 0.0)), *more.get("forces", ())],
        sensors=[JointAngle(name="crank_angle", joint="main_bearing"),
                 JointAngle(name="rocker_angle", joint="rocker_bearing"), *more.get("sensors", ())],
        inputs=[*([] if signal is None else [Input(name="turn", signal=signal)]), *more.get("inputs", ())],
    )  # fmt: skip


def four_bar_angles(lengths, crank_angle: float) -> tuple[float, float]:
    """(coupler's, rocker's) angle from x, by the circles about pin and bearing; the coupler's side above."""
    a, b, c, d = lengths
    x, y = d - a * math.cos(crank_angle), -a * math.sin(crank_angle)
    diagonal = math.hypot(x, y)
    beta = math.atan2(y, x) + math.acos((b * b + diagonal**2 - c * c) / (2.0 * b * diagonal))
    pin = (a * math.cos(crank_angle) + b * math.cos(beta), a * math.sin(crank_angle) + b * math.sin(beta))
    return beta, math.atan2(pin[1], pin[0] - d)


def ball_and_rod(length: float) -> System:
    """A point mass on a massless rod, free to swing in two directions."""
    return System(
        "spherical pendulum",
        bodies=[PointMass(name="ball", mass=1.0, position=(0.3, -math.sqrt(length**2 - 0.09), 0.0))],
        constraints=[Distance(name="rod", body_j="ball", length=length)],
        forces=[Gravity(name="weight", acceleration=(0.0, -G, 0.0))],
    )
