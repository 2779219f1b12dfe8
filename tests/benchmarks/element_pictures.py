"""The picture of docs/accuracy-and-speed.md: elements beside their closed forms and published numbers, panels a to h.

python -m tests.benchmarks.element_pictures --out docs/elements.png

The systems are those of the tests, which check the same truth to the digits of the solver.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import expm

from dms_core import Model, SolverOptions, simulate
from dms_core.figures import drawn
from dms_core.simulation.dynamics import Simulation
from dms_core.simulation.events import advance_with_impacts
from exo_env.rendering.panels import COLOURS, legend, panels, save
from tests.dms_core.model.constraints.test_drum_rope import TestDrumRope
from tests.dms_core.model.constraints.wheels import turned
from tests.dms_core.model.contact import test_friction, test_restitution, test_sphere_cylinder
from tests.dms_core.model.electric import test_dc_motor
from tests.dms_core.model.flexible.beams import EI, cantilever, tip
from tests.dms_core.model.flexible.equilibrium import equilibrium
from tests.dms_core.model.flexible.test_beam_statics import LOADED, PRINCETON
from tests.dms_core.model.ropes import test_elastic_rope

G = 9.81
TRUTH = {"linestyle": "none", "marker": "o", "ms": 3.5, "mfc": "none", "color": COLOURS[6]}
"""Points of what is known otherwise."""
OURS, KNOWN = "simulated", "closed form or published"


def roll_up(ax: Any) -> None:
    """End moments of 0, 1/4 ... 1 times 2 pi EI / L, and arcs of circles."""
    model, s = cantilever(20, moment=(0.0, 0.0, 1.0), axes="body"), np.linspace(0.0, 1.0, 11)
    for turns in np.linspace(0.0, 1.0, 5):
        q = equilibrium(model, 0.125, load=2.0 * math.pi * EI * turns).q.reshape(-1, 7)
        ax.plot(q[:, 0], q[:, 1], color=COLOURS[0], label=OURS)
        angle = 2.0 * math.pi * max(turns, 1e-9)
        ax.plot(np.sin(angle * s) / angle, (1.0 - np.cos(angle * s)) / angle, **TRUTH, label=KNOWN)
    ax.set(aspect="equal", xlabel="x [m]", ylabel="y [m]", title="beam under an end moment")


def princeton(ax: Any) -> None:
    """Deflections of the tip over the angle of the load, which is given at seven angles."""
    angles, load = np.linspace(0.0, 90.0, 13), max(LOADED)
    found = np.array([
        tip(model, equilibrium(model, 0.2, load=load).q)[1:]
        for a in np.radians(angles)
        for model in [cantilever(16, PRINCETON, 0.508, force=(0.0, math.cos(a), math.sin(a)))]
    ])  # fmt: skip
    for k, axis in enumerate("yz"):
        ax.plot(angles, 1e3 * found[:, k], color=COLOURS[k], label=OURS)
        ax.annotate(axis, (angles[-3], 1e3 * found[-3, k]), xytext=(4, 4), textcoords="offset points")
        ax.plot(np.linspace(0.0, 90.0, 7), 1e3 * np.array(LOADED[load][k]), **TRUTH, label=KNOWN)
    ax.set(xlabel="angle of the load [deg]", ylabel="deflection of the tip [mm]", title="Princeton beam, 13.3 N")


def bouncing(ax: Any) -> None:
    """A ball that falls from 0.5 m with a restitution of 0.7, and the parabolas and tops of a rigid ground."""
    e, height = 0.7, 0.5
    model = Model(test_restitution.ball(0.0, height, G, restitution=e, impact_speed_input="speed", stiffness=1e9))
    world = Simulation(model, SolverOptions(rtol=1e-7))
    advance_with_impacts(world, 2.0, {"touch_sensor": "speed"})
    t = np.linspace(0.0, 2.0, 1001)
    ax.plot(t, world.trajectory().at(t).coordinate("ball.y"), color=COLOURS[0], label=OURS)
    k = np.arange(1, 6)
    fall = math.sqrt(2.0 * height / G)
    # The top behind touch-down k, half-way to the next one.
    ax.plot([0.0, *(fall * (1.0 + 2.0 * np.cumsum(e**k) - e**k))], [height, *(height * e ** (2 * k))],
            **TRUTH, label=KNOWN)  # fmt: skip
    ax.set(xlabel="time [s]", ylabel="height [m]", title="ball, restitution 0.7")


def sliding(ax: Any) -> None:
    """1.5 m/s on a plane with mu = 0.3: v t - mu g t^2 / 2 until it rests."""
    mu, v = test_friction.MU, 1.5
    run = simulate(test_friction.on_slope(0.0, v), 0.8, SolverOptions(rtol=1e-7)).check()
    t, end = np.linspace(0.0, 0.8, 201), v / (mu * G)
    ax.plot(t, run.at(t).coordinate("block.x"), color=COLOURS[0], label=OURS)
    at = np.linspace(0.0, 0.8, 13)
    moving = np.minimum(at, end)
    ax.plot(at, v * moving - 0.5 * mu * G * moving**2, **TRUTH, label=KNOWN)
    ax.set(xlabel="time [s]", ylabel="way [m]", title="block that slides to rest")


def atwood(ax: Any) -> None:
    """3 kg and 1 kg over a drum of 0.04 kg m^2 and 0.1 m: theta = a t^2 / (2 r)."""
    case = TestDrumRope()
    run = case.atwood()
    ax.plot(run.t, np.abs(turned(run, "drum")), color=COLOURS[0], label=OURS)
    a = (case.M1 - case.M2) * G / (case.M1 + case.M2 + case.J / case.R**2)
    t = np.linspace(0.0, 1.0, 13)
    ax.plot(t, 0.5 * a * t**2 / case.R, **TRUTH, label=KNOWN)
    ax.set(xlabel="time [s]", ylabel="turn of the drum [rad]", title="Atwood's machine, massive drum")


def motor(ax: Any) -> None:
    """Current and speed behind a step of the voltage, and the exponential of their linear equations."""
    m = test_dc_motor
    run = simulate(m.drive(rotor_inertia=m.J, viscous_friction=m.B), 3.0, SolverOptions(rtol=1e-7)).check()
    t, at, inertia = np.linspace(0.0, 3.0, 301), np.linspace(0.0, 3.0, 16), m.LOAD + m.J
    A = np.array([[-m.R / m.L, -m.K / m.L], [m.K / inertia, -m.B / inertia]])
    rest = np.linalg.solve(-A, [m.VOLTS / m.L, 0.0])
    exact = np.array([rest - expm(A * x) @ rest for x in at])
    for k, (curve, scale) in enumerate(zip(m.courses(run, t), (1.0, 0.1), strict=True)):
        ax.plot(t, scale * curve, color=COLOURS[k], label=OURS)
        ax.plot(at, scale * exact[:, k], **TRUTH, label=KNOWN)
        name, height = (("current [A]", 0.6), ("speed [10 rad/s]", 8.4))[k]
        ax.annotate(name, (2.95, height), ha="right", color=COLOURS[k])
    ax.set(xlabel="time [s]", ylabel="current, speed", title="motor that spins up")


def slack_rope(ax: Any) -> None:
    """2 kg that fall 5 cm into an elastic rope: a half wave while it is taut, nothing in flight."""
    r, fall = test_elastic_rope, 0.05
    run = simulate(r.hanging(r.FREE - fall), 0.6, SolverOptions(rtol=1e-8)).check()
    t, at = np.linspace(0.0, 0.6, 2001), np.linspace(0.0, 0.6, 61)
    ax.plot(t, run.sensors(t)["cell.tension"], color=COLOURS[0], label=OURS)
    touch, speed = math.sqrt(2.0 * fall / G), math.sqrt(2.0 * G * fall)
    taut = 2.0 * (math.pi - math.atan(speed / (r.OMEGA * r.STRETCH))) / r.OMEGA
    # Behind each flight of 2 touch the wave comes again.
    since = np.mod(at + touch, 2.0 * touch + taut) - 2.0 * touch
    wave = r.STRETCH * (1.0 - np.cos(r.OMEGA * since)) + speed / r.OMEGA * np.sin(r.OMEGA * since)
    ax.plot(at, np.where(since > 0.0, r.STIFFNESS * wave / r.FREE, 0.0), **TRUTH, label=KNOWN)
    ax.set(xlabel="time [s]", ylabel="tension [N]", title="elastic rope that goes slack")


def off_a_cylinder(ax: Any) -> None:
    """Load on the cylinder over the angle from its top: (1 + k) cos a - k cos a0, with k = 2 or 10 / 7."""
    c = test_sphere_cylinder
    for j, (way, k) in enumerate({"sliding": 2.0, "rolling": 10.0 / 7.0}.items()):
        friction, inertia, cosine = c.WAYS[way]
        run = simulate(c.on_top(friction, inertia), 0.75, SolverOptions(rtol=1e-7)).check()
        angle = np.arctan2(run.q[:, 0], run.q[:, 1])
        ax.plot(np.degrees(angle), run.sensors(run.t)["touch_sensor.normal"] / (c.MASS * G), color=COLOURS[j],
                label=OURS)  # fmt: skip
        last = math.acos(cosine * math.cos(c.START))
        at = np.linspace(c.START, last, 9)
        ax.plot(np.degrees(at), (1.0 + k) * np.cos(at) - k * math.cos(c.START), **TRUTH, label=KNOWN)
        place = {"sliding": (22.0, 0.45), "rolling": (47.0, 0.45)}[way]
        ax.annotate(way, place, color=COLOURS[j])
    ax.set(xlabel="angle from the top [deg]", ylabel="load over weight", title="sphere that leaves a cylinder",
           xlim=(0.0, 70.0))  # fmt: skip


PANELS: tuple[Callable[[Any], None], ...] = (
    roll_up, princeton, bouncing, sliding, atwood, motor, slack_rope, off_a_cylinder,
)  # fmt: skip


@drawn
def draw(path: Path) -> None:
    """All panels."""
    figure, axes = panels(2, 4, (13.0, 6.4))
    for ax, panel in zip(axes.flat, PANELS, strict=True):
        panel(ax)
        ax.title.set_fontsize(10)
    legend(figure, 2)
    save(figure, path)


def main() -> None:
    """Draw it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("docs/elements.png"), help="the picture")
    draw(parser.parse_args().out)


if __name__ == "__main__":
    main()
