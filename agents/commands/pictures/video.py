"""`python -m agents video`: policies side by side on the same patient."""

from __future__ import annotations

import tempfile
import textwrap
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from tqdm import tqdm
from tyro.conf import arg

from dms_core.command_line import FAILED_RUN, FileOut
from dms_core.errors import DmsError, InputError, Stopped, extra
from dms_core.files.output_file import write_bytes
from dms_core.files.outputs import OutputFile, Outputs
from exo_env.patient.population import population
from exo_env.rendering.history import History
from exo_env.rendering.renderer import Renderer
from exo_env.rendering.scales import Scales
from exo_env.rendering.scene import Scene

from ...environment import ENVIRONMENT, environment_id
from ...evaluation.episodes.episode import world_of
from ...evaluation.episodes.playing import Playing
from ...policies.policy import Policy
from ..options import EnvironmentId, device_settings, different_policies, given_folders, repeated

BAND, FONT, MOST, SIZE = 60, 18, 4, 480
"""Height of the titles, size of their letters, policies that fit side by side, and width of each of them [pixel]."""
LETTERS = 76
"""Letters of a line below a title."""
FADED = 0.55
"""Share of white in what stands still after the end of an episode [-]."""
INK, WARNING, PAPER = (40, 40, 40), (190, 50, 20), (255, 255, 255)
GIF_STEP = 2
"""A GIF takes every second picture: it is large, and few viewers show 50 a second."""


def video(
    policy_names: Annotated[tuple[str, ...], arg(name="policy", metavar="A B")],
    out: FileOut,
    patient: str = "stroke_severe",
    seed: int = 0,
    repetitions: int | None = None,
    environment: EnvironmentId = ENVIRONMENT,
    exoskeleton: str | None = None,
    overwrite: bool = False,
) -> int:
    """Film policies side by side, with the same patient, load and repetition.

    Args:
        policy_names: one to four: names of the command `policies`, folders of trained ones, or module:Class.
        out: .mp4, or .gif; without ffmpeg an .mp4 becomes a .gif.
        patient: population to draw from.
        seed: of the episode.
        repetitions: of the movement; as the trained policies learned, 1 without one, where not given.
        environment: in which, by id; module:ID where another package registers it.
        exoskeleton: device by name or YAML file, or changes of the default one as JSON.
        overwrite: replace a file of this name.
    """
    if not 1 <= len(policy_names) <= MOST:
        raise InputError(f"--policy: expected one to {MOST} names, got {len(policy_names)}.")
    if out.suffix not in (".mp4", ".gif"):
        raise InputError(f"output '{out}': expected a name that ends in .mp4 or .gif.")
    environment_id(environment)
    used = different_policies(policy_names, environment)
    settings = device_settings(exoskeleton) | repeated(used, repetitions)
    out = _possible(out)
    inputs = [patient, exoskeleton, *given_folders(policy_names)]
    with Outputs("video", files=[OutputFile("--out", out)], inputs=inputs, overwrite=overwrite) as outputs:
        _film(out, [Stage(policy, patient, seed, environment, **settings) for policy in used])
    print(f"written: {outputs.where(out)}")
    return FAILED_RUN if outputs.failed else 0


def _film(out: Path, stages: list[Stage]) -> None:
    """Draw and write all pictures, with a bar.

    Raises:
        Stopped: by the user; nothing is written.
    """
    rate, total = stages[0].rate, stages[0].length
    drawn = 0
    with tqdm(total=total, unit="picture", leave=False, disable=None) as bar:

        def progress() -> None:
            nonlocal drawn
            drawn += 1
            bar.update()

        try:
            _write(out, _shown(pictures(stages), progress, GIF_STEP if out.suffix == ".gif" else 1), rate)
        except KeyboardInterrupt:
            raise Stopped(f"{drawn} of {total} pictures were drawn; nothing was written.") from None


class Stage:
    """One policy with its patient: the scenes of its episode.

    Args:
        policy: that assists.
        patient: population to draw from.
        seed: of the episode.
        environment: its id.
        settings: further ones of the environment.
    """

    def __init__(
        self, policy: Policy, patient: str, seed: int, environment: str = ENVIRONMENT, **settings: Any
    ) -> None:
        self.policy = policy
        self.env = world_of(policy, population(patient).model_dump(), environment, render_mode="rgb_array", **settings)
        self.playing = Playing(self.env, policy, seed)
        world: Any = self.env.unwrapped
        self.rate, self.length = round(1.0 / world.period), round(world.duration / world.period) + 1
        self.scenes: list[Scene] = [world.scene()]
        self.event = ""

    def run(self) -> None:
        """The whole episode; the environment is then closed."""
        world: Any = self.env.unwrapped
        self.scenes += [world.scene() for _ in self.playing.steps()]
        event = self.playing.event
        self.event = "" if event is None else f"ended at {self.scenes[-1].time:.2f} s: {event}"
        self.env.close()


def pictures(stages: list[Stage]) -> Iterator[np.ndarray]:
    """All stages side by side, until the last one is over, with the same colours and axes."""
    for stage in stages:
        stage.run()
    every = [stage.scenes for stage in stages]
    renderer = Renderer("rgb_array", stages[0].rate, SIZE, Scales.spanning([s for scenes in every for s in scenes]))
    histories = [History(SIZE, scenes, every) for scenes in every]
    for k in range(max(map(len, every))):
        yield np.concatenate([_panel(s, h, k, renderer) for s, h in zip(stages, histories, strict=True)], axis=1)


def _panel(stage: Stage, history: History, k: int, renderer: Renderer) -> np.ndarray:
    """A stage at a time: title, arm, and what happened so far; grey after an early end, with the reason."""
    count = len(stage.scenes)
    arm = renderer.draw(stage.scenes[min(k, count - 1)])
    assert arm is not None
    shown = np.concatenate([arm, history.draw(min(k + 1, count))])
    ended = bool(stage.event) and k >= count - 1
    return np.concatenate(
        [band(SIZE, stage.policy.title, stage.event if ended else ""), grey(shown) if ended else shown]
    )


def grey(picture: np.ndarray) -> np.ndarray:
    """A picture without colours and faded, uint8, same shape."""
    faded = FADED * 255.0 + (1.0 - FADED) * picture.mean(axis=-1, keepdims=True)
    return np.broadcast_to(faded, picture.shape).astype(np.uint8)


def band(width: int, title: str, event: str) -> np.ndarray:
    """A title, and below it in two lines what ended the episode."""
    import pygame

    pygame.font.init()
    surface = pygame.Surface((width, BAND))
    surface.fill(PAPER)
    lines = [(title, INK, FONT, 4)]
    said = textwrap.wrap(event, LETTERS, max_lines=2, placeholder=" ...")
    lines += [(text, WARNING, FONT - 5, 26 + 16 * k) for k, text in enumerate(said)]
    for text, colour, size, y in lines:
        line = _line(text, colour, size + 6, width - 8)
        surface.blit(line, ((width - line.get_width()) // 2, y))
    return pygame.surfarray.array3d(surface).swapaxes(0, 1)


def _line(text: str, colour: tuple[int, int, int], size: int, width: int) -> Any:
    """A line of text, in smaller letters where it would be wider than `width` [pixel]."""
    import pygame

    line = pygame.font.Font(None, size).render(text, True, colour)
    # Letters come in whole pixels: their width does not shrink in proportion.
    while line.get_width() > width and size > 6:
        size -= 1
        line = pygame.font.Font(None, size).render(text, True, colour)
    return line


def _shown(whole: Iterator[np.ndarray], progress: Callable[[], None], every: int) -> Iterator[np.ndarray]:
    """Every so many pictures; `progress` is called with each of them all."""
    for k, picture in enumerate(whole):
        progress()
        if k % every == 0:
            yield picture


def _possible(out: Path) -> Path:
    """The file that can be written here.

    Raises:
        DmsError: imageio is missing.
    """
    try:
        import imageio  # noqa: F401
    except ImportError:
        raise DmsError(f"videos need imageio. {extra('pictures')}") from None
    if out.suffix == ".mp4":
        try:
            import imageio_ffmpeg

            imageio_ffmpeg.get_ffmpeg_exe()
        except (ImportError, RuntimeError):
            print("without imageio-ffmpeg there is no .mp4; writing a .gif")
            return out.with_suffix(".gif")
    return out


def _write(out: Path, shown: Iterator[np.ndarray], rate: int) -> None:
    """Write the film whole or not at all.

    Raises:
        DmsError: there is no room for it while it is made.
    """
    import imageio.v2 as imageio

    if out.suffix == ".mp4":
        options: dict[str, Any] = {"fps": rate, "codec": "libx264", "macro_block_size": 2, "quality": 7}
    else:
        options = {"duration": 1000.0 * GIF_STEP / rate, "loop": 0}
    # The other program writes into a folder of its own, and what it leaves there goes with the folder.
    with tempfile.TemporaryDirectory(prefix="exo_env_") as folder:
        film = Path(folder) / f"film{out.suffix}"
        try:
            with imageio.get_writer(film, **options) as writer:
                opened: Any = writer
                for picture in shown:
                    opened.append_data(picture)
        except OSError as error:
            raise DmsError(f"the film cannot be made in '{folder}': {error.strerror or error}.") from None
        write_bytes(out, film.read_bytes())
