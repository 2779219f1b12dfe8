"""Outputs of commands: nothing of others is lost, and a full disk or Ctrl-C loses no result."""

import os
from pathlib import Path

import pytest

from dms_core.errors import DmsError, InputError, Stopped
from dms_core.files.output_file import write_file, write_text
from dms_core.files.output_place import PREFIX
from dms_core.files.outputs import partial
from tests.dms_core.cli.written import outputs, parts


class TestFiles:
    def test_an_output_is_no_input(self, tmp_path):
        source, hard, soft = tmp_path / "model.yaml", tmp_path / "hard", tmp_path / "soft"
        source.write_text("precious")
        os.link(source, hard)
        soft.symlink_to(source)
        for path in (source, hard, soft, tmp_path / "nowhere" / ".." / "model.yaml"):
            if path.exists():
                with pytest.raises(InputError, match="is the input"):
                    outputs(path, inputs=[str(source)], overwrite=True)
        assert source.read_text() == "precious"

    def test_an_output_is_no_file_of_an_input_folder(self, tmp_path):
        (tmp_path / "policy").mkdir()
        (tmp_path / "policy" / "policy.json").write_text("precious")
        with pytest.raises(InputError, match="is the input"):
            outputs(tmp_path / "policy" / "policy.json", inputs=[tmp_path / "policy"], overwrite=True)

    @pytest.mark.parametrize("link", [None, os.symlink, os.link])
    def test_two_outputs_are_two_files(self, tmp_path, link):
        first, second = tmp_path / "a", tmp_path / "b"
        if link is None:
            second = first
        else:
            first.write_text("mark")
            link(first, second)
        with pytest.raises(InputError, match="--0 and --1 are the same file"):
            outputs(first, second)

    def test_two_outputs_may_both_be_thrown_away(self):
        outputs(Path("/dev/null"), Path("/dev/null"))

    @pytest.mark.parametrize("content", ["precious", '{\n  "result": "SUCCESS",\n  "mine": 1}', "time_s, mine q.x"])
    def test_a_file_that_exists_needs_the_flag_whatever_it_holds(self, tmp_path, content):
        path = tmp_path / "file"
        path.write_text(content)
        with pytest.raises(InputError, match=r"--0 '.*file' exists; choose another name, or give --overwrite"):
            outputs(path)
        assert path.read_text() == content
        with outputs(path, overwrite=True):
            write_text(path, "new")
        # Nor is what the same command wrote a file to lose.
        with pytest.raises(InputError, match="--overwrite"):
            outputs(path)
        assert path.read_text() == "new"

    def test_a_file_that_came_meanwhile_is_not_replaced(self, tmp_path, elsewhere, capsys):
        path = tmp_path / "file"
        with outputs(path) as done:
            path.write_text("precious")
            write_text(path, "result")
        assert path.read_text() == "precious" and (done.where(path) / "file").read_text() == "result"
        assert "exists and was not written by `test`" in capsys.readouterr().err

    def test_a_file_that_comes_while_it_is_written_is_not_replaced(self, tmp_path, elsewhere):
        path = tmp_path / "file"

        def content(file):
            if not path.exists():
                path.write_text("precious")
            file.write(b"result")

        with outputs(path) as done:
            write_file(path, content)
        assert path.read_text() == "precious" and (done.where(path) / "file").read_text() == "result"
        assert parts(tmp_path) == []

    def test_a_command_may_write_its_file_twice(self, tmp_path):
        with outputs(tmp_path / "file") as done:
            write_text(tmp_path / "file", "1")
            write_text(tmp_path / "file", "2")
        assert not done.failed and (tmp_path / "file").read_text() == "2"

    @pytest.mark.parametrize("overwrite", [False, True])
    def test_no_other_name_of_a_file_is_cut_off(self, tmp_path, overwrite):
        path, other = tmp_path / "file", tmp_path / "other"
        other.write_text("precious")
        os.link(other, path)
        with pytest.raises(InputError, match=r"is a file of 2 names \(hard links\)"):
            outputs(path, overwrite=overwrite)
        with pytest.raises(InputError, match="hard links"):
            write_text(path, "new")
        assert path.read_text() == other.read_text() == "precious"

    def test_what_a_killed_command_left_is_removed_and_what_is_being_written_is_not(self, tmp_path):
        left, busy, mine = (tmp_path / f"{PREFIX}{k}.part" for k in "abc")
        left.write_text("half")
        busy.write_text("half")
        with outputs(tmp_path / "file"):
            os.utime(busy, (1.0, 1.0))
            mine.write_text("half")
            write_text(tmp_path / "file", "1")
        assert set(parts(tmp_path)) == {busy, mine}

    def test_an_empty_file_is_no_loss(self, tmp_path):
        (tmp_path / "file").write_text("")
        outputs(tmp_path / "file")

    def test_a_part_has_a_name_of_its_own(self, tmp_path):
        assert partial(tmp_path / "run.csv") == tmp_path / "run.partial.csv"
        (tmp_path / "run.partial.csv").write_text("an earlier one")
        assert partial(tmp_path / "run.csv") == tmp_path / "run.partial2.csv"

    def test_a_part_of_the_longest_name_can_be_written(self, tmp_path):
        out = tmp_path / ("ü" * 125 + "a.csv")
        with outputs(out) as done:
            write_text(part := partial(out), "half")
        assert not done.failed and part.read_text() == "half" and part.name.endswith("ü.partial.csv")


class TestFullDisk:
    def test_results_go_elsewhere_from_there_on(self, full, elsewhere, capsys):
        out = full / "out"
        with outputs(folder=out) as done:
            write_text(out / "small", "1")
            write_text(out / "large", "x" * 9000)
            write_text(out / "last", "2")
        assert done.failed and (out / "small").read_text() == "1" and parts(full) == []
        kept = done.where(out)
        assert kept.parent == elsewhere and {p.name for p in kept.iterdir()} == {"large", "last"}
        said = capsys.readouterr().err
        assert said.count("\n") == 1 and f"'{out / 'large'}' cannot be written (No space left on device)" in said
        assert "free some space" in said and str(kept) in said

    def test_the_earlier_file_is_untouched(self, full, elsewhere):
        path = full / "file"
        path.write_text("earlier")
        with outputs(path, overwrite=True):
            write_text(path, "x" * 9000)
        assert path.read_text() == "earlier"

    def test_two_files_of_one_name_are_both_kept(self, full, elsewhere):
        first, second = full / "a" / "x", full / "b" / "x"
        with outputs(first, second) as done:
            write_text(first, "1" * 9000)
            write_text(second, "2" * 9000)
        assert sorted(p.read_text()[0] for p in done.where(first).iterdir()) == ["1", "2"]

    def test_no_place_anywhere_is_one_sentence(self, full, monkeypatch):
        monkeypatch.setattr("tempfile.tempdir", str(full))
        with pytest.raises(DmsError, match="No space left on device"), outputs(full / "file"):
            write_text(full / "file", "x" * 9000)
        assert list(full.iterdir()) == []


class TestInterrupt:
    def test_it_says_what_is_written(self, tmp_path):
        with pytest.raises(Stopped, match="nothing was written"), outputs(tmp_path / "a"):
            raise KeyboardInterrupt
        with pytest.raises(Stopped, match=r"written before: '.*first'; the rest is missing"), outputs(folder=tmp_path):
            write_text(tmp_path / "first", "1")
            raise KeyboardInterrupt

    def test_what_an_earlier_run_wrote_stays(self, tmp_path):
        with outputs(folder=tmp_path):
            write_text(tmp_path / "a", "1")
            write_text(tmp_path / "b", "1")
        with pytest.raises(Stopped), outputs(folder=tmp_path):
            write_text(tmp_path / "b", "2")
            raise Stopped("one of two is written.")
        assert (tmp_path / "a").read_text() == "1"
        with outputs(folder=tmp_path):
            write_text(tmp_path / "a", "3")
