"""Draws a scene: the arm from the side with its muscles, the device and the reference; the gym machine as an inset.

The subject looks to the right, and the viewer stands at the subject's right hand. The main view is tied to the upper
arm, which rests, and is as large as it, so that the picture holds still and small and tall persons fill it alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from exo_env.rendering.canvas import ALIGNMENTS, FINER, Box, Canvas, Colour
from exo_env.rendering.quantities import fixed
from exo_env.rendering.scales import Scales
from exo_env.rendering.scene import Scene
from exo_env.rendering.shapes import dashes, limb, rounded, spindle

PAPER, CARD, FRAME = (255, 255, 255), (249, 250, 251), (212, 216, 222)
INK, GREY = (33, 37, 43), (112, 119, 129)
TORSO = (236, 239, 242)
SKIN, SKIN_EDGE = (245, 228, 214), (205, 178, 158)
STEEL, STEEL_EDGE, STEEL_LIGHT = (112, 124, 140), (58, 66, 78), (236, 239, 243)
ROPE, IRON = (92, 98, 108), (66, 72, 82)
REFERENCE = (0, 140, 105)
ACTIVATION: tuple[Colour, ...] = ((36, 88, 200), (146, 66, 158), (220, 28, 40))
"""Colours of muscles, from activation 0 to the end of its scale: blue, purple, red."""
TENSION: tuple[Colour, ...] = ((196, 200, 206), (244, 180, 48), (190, 72, 0))
"""Colours of the device's ropes, from slack to the end of the scale and beyond: grey, yellow, brown."""
WINDOW = 2.8
"""Side of the main view over the length of the upper arm [-]."""
ELBOW_AT = (0.27, 0.47)
"""Place of the elbow in the main view, as shares of its side from the left and from the top."""
READINGS: Box = (304, 10, 166, 140)
INSET: Box = (352, 318, 118, 152)
SCALES: Box = (10, 416, 180, 54)
BAR = 72
"""Length of a colour bar, in lengths of the layout."""
TRUNK = (
    (0.10, 1.0), (0.11, 0.42), (0.22, 0.16), (0.40, -0.25), (0.42, -0.80), (0.26, -1.50), (0.26, -2.8),
    (-0.60, -2.8), (-0.58, -1.60), (-0.68, -0.80), (-0.62, -0.10), (-0.34, 0.26), (-0.26, 0.50), (-0.26, 1.0),
)  # fmt: skip
"""Corners of the rounded outline of trunk and neck, from the shoulder, over the length of the upper arm [-]."""


def gradient(colours: Sequence[Colour], share: float) -> Colour:
    """The colour at a share of a scale, 0 to 1."""
    x = min(max(float(share), 0.0), 1.0) * (len(colours) - 1)
    k = min(int(x), len(colours) - 2)
    red, green, blue = (round(a + (x - k) * (b - a)) for a, b in zip(colours[k], colours[k + 1], strict=True))
    return red, green, blue


def darker(colour: Colour) -> Colour:
    """A darker colour, for the edge of a shape."""
    red, green, blue = colour
    return 11 * red // 20, 11 * green // 20, 11 * blue // 20


def lighter(colour: Colour) -> Colour:
    """A lighter colour, for the part of a shape that the light falls on."""
    red, green, blue = colour
    return red + (255 - red) // 4, green + (255 - green) // 4, blue + (255 - blue) // 4


def root_share(value: float, end: float) -> float:
    """Place on a scale, 0 to 1: the square root, so that a tenth of its end is well seen."""
    return float(np.sqrt(min(max(value / end, 0.0), 1.0)))


class View(NamedTuple):
    """A map from metres to fine pixels."""

    scale: float
    """Scale of the picture [fine pixel/m]."""
    x: float
    """Place of the left edge of the canvas [m]."""
    y: float
    """Place of its upper edge [m]."""

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Points [m] in fine pixels, same shape."""
        return (np.asarray(points, dtype=float) - (self.x, self.y)) * (self.scale, -self.scale)


class Picture:
    """Draws scenes on a canvas, in colours up to the ends of the scales."""

    def __init__(self, canvas: Canvas, scales: Scales) -> None:
        self.canvas, self.scales = canvas, scales

    def draw(self, scene: Scene) -> None:
        """Draw a scene over the last one."""
        self.canvas.clear(PAPER)
        upper_arm = float(np.hypot(*(np.asarray(scene.shoulder) - scene.elbow)))
        side = WINDOW * upper_arm
        view = View(
            FINER * self.canvas.size / side,
            scene.elbow[0] - ELBOW_AT[0] * side,
            scene.elbow[1] + ELBOW_AT[1] * side,
        )
        self._torso(view, scene, upper_arm)
        ghost = self._ghost(view, scene, upper_arm)
        self.canvas.veil(ghost, REFERENCE, 0.16)
        self._arm(view, scene, upper_arm)
        for dash in dashes(ghost, 5.0 * self.canvas.unit):
            self.canvas.line(dash, REFERENCE, 1.5)
        for points, activation in scene.muscles:
            self._muscle(view(points), activation)
        self._device(view, scene)
        if scene.gym_rope is not None:
            self._handle(view, scene.gym_rope)
        for box in (READINGS, SCALES):
            self.canvas.box(box, CARD, border=FRAME, round_by=5)
        self._bars()
        if scene.gym_rope is not None:
            weight_at = self._machine(scene, scene.gym_rope)
        self.canvas.smooth()
        self._readings(scene)
        self._scale_words()
        if scene.gym_rope is not None and scene.weight_mass is not None:
            self.canvas.words(f"{scene.weight_mass:.3g} kg", weight_at, INK, "small", "centre")

    # The subject

    def _torso(self, view: View, scene: Scene, upper_arm: float) -> None:
        """Trunk and neck behind the arm, as far as the picture shows them."""
        corners = np.asarray(scene.shoulder) + upper_arm * np.array(TRUNK)
        self.canvas.polygon(rounded(view(corners)), TORSO)

    def _arm(self, view: View, scene: Scene, upper_arm: float) -> None:
        """Draw upper arm, forearm and hand."""
        r = view.scale * upper_arm
        shoulder, elbow, grip = view(scene.shoulder), view(scene.elbow), view(scene.grip)
        belly, wrist, knuckles = (elbow + share * (grip - elbow) for share in (0.24, 0.80, 0.94))
        parts = [
            limb(shoulder, elbow, 0.22 * r, 0.15 * r),
            limb(elbow, belly, 0.15 * r, 0.155 * r),
            limb(belly, wrist, 0.155 * r, 0.08 * r),
            limb(wrist, knuckles, 0.08 * r, 0.10 * r),
            limb(knuckles, grip, 0.115 * r, 0.125 * r),
        ]
        for outline in parts:
            self.canvas.polygon(outline, SKIN, SKIN_EDGE, 1.4)
        for outline in parts:
            self.canvas.polygon(outline, SKIN)

    def _ghost(self, view: View, scene: Scene, upper_arm: float) -> np.ndarray:
        """Outline of the forearm where the reference wants it, turned as if the elbow axis faced the viewer."""
        r = view.scale * upper_arm
        turn = scene.reference_angle - scene.elbow_angle
        c, s = np.cos(turn), np.sin(turn)
        grip = scene.elbow + np.array([[c, -s], [s, c]]) @ (np.asarray(scene.grip) - scene.elbow)
        return limb(view(scene.elbow), view(grip), 0.17 * r, 0.14 * r)

    def _muscle(self, points: np.ndarray, activation: float) -> None:
        """A spindle that swells with activation."""
        share = min(activation / self.scales.activation, 1.0)
        colour = gradient(ACTIVATION, share)
        belly = (8.0 + 5.0 * share) * self.canvas.unit
        self.canvas.polygon(spindle(points, belly, 0.35 * belly), colour, darker(colour), 0.7)
        self.canvas.polygon(spindle(points, 0.3 * belly, 0.0), lighter(colour))

    # Device and machine

    def _device(self, view: View, scene: Scene) -> None:
        """Links, horns of the ropes, ropes, hinge."""
        bars = [(view(link), 7.0) for link in scene.exo_links]
        hinge = bars[0][0][-1] if bars else view(scene.elbow)
        bars += [(np.array([hinge, view(points)[-1]]), 4.0) for points, _ in scene.ropes]
        for points, width in bars:
            self.canvas.line(points, STEEL_EDGE, width + 2.0)
        for points, width in bars:
            self.canvas.line(points, STEEL, width)
        for points, tension in scene.ropes:
            share = root_share(tension, self.scales.tension)
            colour, width = gradient(TENSION, share), 1.8 + 3.0 * share
            self.canvas.line(view(points), darker(colour), width + 1.2)
            self.canvas.line(view(points), colour, width)
            for end in (view(points)[0], view(points)[-1]):
                self._pin(end, 3.2)
        if bars:
            self._pin(hinge, 8.5)

    def _pin(self, centre: np.ndarray, radius: float) -> None:
        """A hinge seen along its axis."""
        self.canvas.disc(centre, radius, STEEL_EDGE)
        self.canvas.disc(centre, 0.80 * radius, STEEL_LIGHT)
        self.canvas.disc(centre, 0.32 * radius, STEEL_EDGE)

    def _handle(self, view: View, rope: np.ndarray) -> None:
        """The handle in the hand and the rope that leaves the picture."""
        grip, tied, pulley = view(rope[:3])
        self.canvas.line(np.array([tied, pulley]), ROPE, 2.0)
        self.canvas.line(np.array([grip, tied]), IRON, 4.0)
        self.canvas.disc(grip, 7.0, IRON)
        self._pin(tied, 4.0)

    def _machine(self, scene: Scene, rope: np.ndarray) -> tuple[float, float]:
        """The whole machine with the arm as two strokes; returns where the mass is written, in the layout."""
        x, y, width, height = INSET
        fixed = np.array([*scene.pulleys, scene.shoulder, scene.elbow])
        low, high = fixed.min(axis=0), fixed.max(axis=0)
        unit = self.canvas.unit
        scale = unit * min((width - 40) / (high[0] - low[0]), (height - 40) / (high[1] - low[1]))
        middle = 0.5 * (low + high)
        view = View(scale, middle[0] - unit * (x + 0.5 * width) / scale, middle[1] + unit * (y + 0.5 * height) / scale)
        self.canvas.box(INSET, CARD, border=FRAME, round_by=5)
        with self.canvas.inside((x + 1, y + 1, width - 2, height - 2)):
            self.canvas.line(view(np.array([scene.shoulder, scene.elbow, scene.grip])), SKIN_EDGE, 6.0)
            self.canvas.line(view(rope[:2]), IRON, 2.5)
            rail = view(rope[-2]) + np.array([(0.0, 0.0), (0.0, 100.0 * unit)])
            self.canvas.line(rail, FRAME, 4.0)
            self.canvas.line(view(rope[1:]), ROPE, 1.4)
            for pulley in scene.pulleys:
                self._pin(view(pulley), 5.0)
            end = rope[-1] if scene.weight is None else scene.weight
            centre = view(end) / unit
            self.canvas.box((centre[0] - 11, centre[1] - 8, 22, 16), IRON, round_by=2.5)
            # The rail would strike through the words.
            self.canvas.box((centre[0] - 24, centre[1] + 9, 48, 12), CARD)
        return float(centre[0]), float(centre[1]) + 11.0

    # Numbers

    def _bars(self) -> None:
        """Colours of activation and of tension, as two bars."""
        x, y, width, _ = SCALES
        for column, colours in ((x + 10, ACTIVATION), (x + width - 10 - BAR, TENSION)):
            for k in range(BAR // 2):
                self.canvas.box((column + 2 * k, y + 23, 2, 9), gradient(colours, (2 * k + 1) / BAR))

    def _scale_words(self) -> None:
        """Titles and ends of the bars; half of the scale of tensions is a quarter of its end."""
        x, y, width, _ = SCALES
        for column, title, ends in (
            (x + 10, "activation [-]", ("0", f"{0.5 * self.scales.activation:g}", f"{self.scales.activation:g}")),
            (x + width - 10 - BAR, "tension [N]", ("0", f"{0.25 * self.scales.tension:g}", f"{self.scales.tension:g}")),
        ):
            self.canvas.words(title, (column, y + 7), GREY, "small")
            for text, share, align in zip(ends, (0.0, 0.5, 1.0), ALIGNMENTS, strict=True):
                self.canvas.words(text, (column + share * BAR, y + 37), GREY, "small", align)

    def _readings(self, scene: Scene) -> None:
        """Patient, time, angle, reference and error, and who does how much."""
        x, y, width, _ = READINGS
        self.canvas.words(scene.label, (x + 10, y + 9), INK, "small", width=width - 20)
        rows = (
            ("time", f"{fixed(scene.time, 2)} s", INK),
            ("angle", f"{fixed(np.degrees(scene.elbow_angle), 1)}\u00b0", INK),
            (
                "plan (hidden)" if scene.plan_hidden else "reference",
                f"{fixed(np.degrees(scene.reference_angle), 1)}\u00b0",
                REFERENCE,
            ),
            ("error", f"{fixed(scene.error_deg, 1, sign=True)}\u00b0", INK),
            ("muscles", f"{fixed(scene.muscle_moment, 1)} Nm", INK),
            ("device", f"{fixed(scene.device_moment, 1)} Nm", INK),
            ("effort", fixed(scene.effort, 2), INK),
        )
        for k, (name, value, colour) in enumerate(rows):
            self.canvas.words(name, (x + 10, y + 28 + 15 * k), GREY)
            self.canvas.words(value, (x + width - 10, y + 28 + 15 * k), colour, align="right")
