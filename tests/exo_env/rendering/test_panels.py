"""What all figures have in common: matplotlib's own settings, letters, legends, notes, and how they are written."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from dms_core.figures import letter
from dms_core.files.config_files import configs
from exo_env.rendering.panels import legend, log_scale, note, save

pytest.importorskip("matplotlib")

DRAW = """
import sys
from pathlib import Path
from dms_core.figures import drawn
from exo_env.rendering.panels import panels, save

@drawn
def draw(path):
    figure, axes = panels(1, 1, (2.0, 2.0))
    axes[0, 0].set_title("angle [deg]")
    return save(figure, path)

draw(Path(sys.argv[1]))
"""


def run(folder, name, **env):
    return subprocess.run(
        [sys.executable, "-c", DRAW, name], cwd=folder, env=os.environ | {"PYTHONPATH": str(configs().parent)} | env,
        capture_output=True, text=True, check=False,
    )  # fmt: skip


def test_settings_of_the_user_do_not_reach_a_figure(tmp_path):
    assert run(tmp_path, "plain.png").returncode == 0
    # TeX is hardly ever there, and would draw another picture if it were.
    (tmp_path / "matplotlibrc").write_text("text.usetex: True\naxes.facecolor: red\n")
    done = run(tmp_path, "other.png")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "other.png").read_bytes() == (tmp_path / "plain.png").read_bytes()


def test_an_unknown_backend_is_named(tmp_path):
    done = run(tmp_path, "plain.png", MPLBACKEND="nonsense")
    said = done.stderr.splitlines()[-1]
    assert done.returncode == 1 and "nonsense" in said and "MPLBACKEND" in said and said.startswith("dms_core.errors.")


def figure_of(columns):
    from exo_env.rendering.panels import panels

    figure, axes = panels(1, columns, (2.0 * columns, 2.0))
    for k, ax in enumerate(axes.flat):
        ax.plot([0, 1], [k, 1], label=f"line {k}")
    return figure, axes


def texts(ax):
    return [text.get_text() for text in ax.texts]


def test_several_panels_have_letters_and_one_has_none(tmp_path):
    figure, axes = figure_of(3)
    axes[0, 1].set_visible(False)
    save(figure, tmp_path / "a.png")
    assert [texts(ax) for ax in axes.flat] == [["a"], [], ["b"]] and letter(figure, axes[0, 2]) == "b"
    figure, axes = figure_of(1)
    save(figure, tmp_path / "b.png")
    assert texts(axes[0, 0]) == []


def test_no_title_reaches_a_letter_or_the_next_panel(tmp_path):
    figure, axes = figure_of(3)
    for ax in axes.flat:
        ax.set_title("power against the patient, in the mean [W]", fontsize=9)
    axes[0, 2].set_title("short")
    save(figure, tmp_path / "a.png")
    for ax in axes.flat:
        (beside,) = ax.texts
        title, box = ax.title.get_window_extent(), ax.get_window_extent()
        # Half a pixel: places of letters are rounded to whole ones.
        assert box.x0 - 0.5 <= title.x0 and title.x1 <= box.x1 + 0.5
        assert not title.overlaps(beside.get_window_extent())
    assert axes[0, 0].get_title().replace("\n", " ") == "power against the patient, in the mean [W]"
    assert axes[0, 2].get_title() == "short"


@pytest.mark.parametrize("values", [(4.0, 8.0), (1.7, 9.0), (2.0, 80.0), (0.3, 60.0), (0.01, 900.0)])
def test_labels_of_a_logarithmic_axis_are_plain_and_apart(values, tmp_path):
    figure, axes = figure_of(2)
    ax = axes[0, 0]
    ax.clear()
    ax.plot(values, [0, 1])
    log_scale(ax, "x")
    save(figure, tmp_path / "a.png")
    low, high = ax.get_xlim()
    ticks = [t for t in ax.xaxis.get_major_ticks() if low <= t.get_loc() <= high]
    boxes = sorted((t.label1.get_window_extent() for t in ticks), key=lambda box: box.x0)
    assert len(boxes) > 1 and all(one.x1 < other.x0 for one, other in zip(boxes, boxes[1:], strict=False))
    assert [float(t.label1.get_text()) for t in ticks] == pytest.approx([t.get_loc() for t in ticks])
    assert not any(t.label1.get_text() for t in ax.xaxis.get_minor_ticks())


def test_a_legend_names_the_lines_of_all_panels_once():
    figure, axes = figure_of(2)
    axes[0, 1].plot([0, 1], [1, 0], label="line 0")
    legend(figure, 2, ["line 1"])
    (found,) = figure.legends
    assert [text.get_text() for text in found.get_texts()] == ["line 1", "line 0"]


def test_a_note_is_wrapped_to_the_figure_and_begins_no_formula():
    figure, _ = figure_of(1)
    note(figure, ["what costs $5 and $6 " * 5])
    lines = figure.get_supxlabel().split("\n")
    assert len(lines) > 1 and "\\$5" in lines[0]
    figure, _ = figure_of(1)
    note(figure, [])
    assert figure.get_supxlabel() == ""


@pytest.mark.parametrize("name, begin", [("a.png", b"\x89PNG"), ("a.svg", b"<?xml"), ("a.pdf", b"%PDF")])
def test_pictures_are_written_as_their_names_end(name, begin, tmp_path):
    save(figure_of(2)[0], tmp_path / name)
    assert (tmp_path / name).read_bytes().startswith(begin)
