"""Folders of outputs: renewed by the command that wrote them, and nothing of others is lost."""

import json
import os

import pytest

from dms_core.errors import InputError, Stopped
from dms_core.files.output_file import write_text
from dms_core.files.output_place import PREFIX
from dms_core.files.outputs import MANIFEST, Outputs, partial
from tests.dms_core.cli.written import outputs, parts


class TestFolder:
    def test_a_foreign_folder_needs_the_flag(self, tmp_path):
        (tmp_path / "notes.md").write_text("precious")
        (tmp_path / "other.md").write_text("other")
        with pytest.raises(InputError, match=r"is not empty and was not written by `test`; .* --overwrite"):
            outputs(folder=tmp_path)
        with outputs(folder=tmp_path, overwrite=True):
            write_text(tmp_path / "other.md", "new")
        assert (tmp_path / "notes.md").read_text() == "precious" and (tmp_path / "other.md").read_text() == "new"

    def test_its_own_folder_is_renewed_and_nothing_stale_is_left(self, tmp_path):
        with outputs(folder=tmp_path / "out"):
            write_text(tmp_path / "out" / "table.md", "1")
            write_text(tmp_path / "out" / "figure.png", "1")
        (tmp_path / "out" / "notes.md").write_text("precious")
        with outputs(folder=tmp_path / "out"):
            write_text(tmp_path / "out" / "table.md", "2")
        assert {p.name for p in (tmp_path / "out").iterdir()} == {"table.md", "notes.md", MANIFEST}
        assert (tmp_path / "out" / "table.md").read_text() == "2"

    def test_another_command_does_not_renew_it(self, tmp_path):
        with outputs(folder=tmp_path):
            write_text(tmp_path / "table.md", "1")
        with pytest.raises(InputError, match="not written by `other`"):
            Outputs("other", folder=tmp_path)

    def test_what_was_changed_since_is_not_lost(self, tmp_path):
        with outputs(folder=tmp_path):
            write_text(tmp_path / "report.md", "1")
        (tmp_path / "report.md").write_text("1, and what I think of it")
        with pytest.raises(InputError, match="was changed since `test` wrote it"):
            outputs(folder=tmp_path)

    def test_a_file_of_others_in_its_own_folder_is_not_replaced(self, tmp_path, elsewhere, capsys):
        out = tmp_path / "out"
        with outputs(folder=out):
            write_text(out / "a.csv", "1")
        (out / "b.csv").write_text("precious")
        with outputs(folder=out) as done:
            write_text(out / "b.csv", "2")
        assert done.failed and (out / "b.csv").read_text() == "precious"
        assert (done.where(out) / "b.csv").read_text() == "2" and "was not written by `test`" in capsys.readouterr().err

    def test_it_is_no_input(self, tmp_path):
        with outputs(folder=tmp_path):
            write_text(tmp_path / "policy.json", "precious")
        for inputs in ([str(tmp_path / "policy.json")], [tmp_path]):
            with pytest.raises(InputError, match="is the input"):
                outputs(folder=tmp_path, inputs=inputs, overwrite=True)

    def test_an_input_beside_the_outputs_is_never_one(self, tmp_path, elsewhere):
        (tmp_path / "me.yaml").write_text("precious")
        (tmp_path / "table.csv").symlink_to("me.yaml")
        with outputs(folder=tmp_path, inputs=[str(tmp_path / "me.yaml")], overwrite=True) as done:
            write_text(tmp_path / "other.csv", "1")
            write_text(tmp_path / "table.csv", "2")
        assert done.failed and (tmp_path / "me.yaml").read_text() == "precious"
        assert (tmp_path / "other.csv").read_text() == "1" and (done.where(tmp_path) / "table.csv").read_text() == "2"

    @pytest.mark.parametrize(
        "content", ["", "[" * 100_000, "[]", "null", '{"command": "test"}', '{"command": "test", "files": 3}']
    )
    def test_a_damaged_list_is_none(self, tmp_path, content):
        (tmp_path / MANIFEST).write_text(content)
        (tmp_path / "table.md").write_text("precious")
        with pytest.raises(InputError, match="was not written by"):
            outputs(folder=tmp_path)

    @pytest.mark.parametrize("overwrite", [False, True])
    def test_a_pipe_as_list_is_none_and_hangs_nothing(self, tmp_path, overwrite):
        os.mkfifo(tmp_path / MANIFEST)
        if not overwrite:
            with pytest.raises(InputError, match="was not written by `test`; .* --overwrite"):
                outputs(folder=tmp_path)
            return
        with outputs(folder=tmp_path, overwrite=True) as done:
            write_text(tmp_path / "table.md", "1")
        assert not done.failed and list(json.loads((tmp_path / MANIFEST).read_text())["files"]) == ["table.md"]

    def test_a_huge_list_is_none_and_is_not_read(self, tmp_path):
        (tmp_path / "table.md").write_text("precious")
        with (tmp_path / MANIFEST).open("wb") as file:
            file.truncate(1 << 40)  # of holes
        with pytest.raises(InputError, match="was not written by `test`; .* --overwrite"):
            outputs(folder=tmp_path)

    def test_a_list_that_is_a_link_is_not_followed(self, tmp_path):
        out, other = tmp_path / "out", tmp_path / "other"
        out.mkdir()
        other.write_text("precious")
        (out / MANIFEST).symlink_to(other)
        with outputs(folder=out, overwrite=True):
            write_text(out / "table.md", "1")
        assert other.read_text() == "precious" and not (out / MANIFEST).is_symlink()

    @pytest.mark.parametrize("overwrite", [False, True])
    def test_a_pipe_in_place_of_a_file_hangs_nothing(self, tmp_path, elsewhere, overwrite):
        with outputs(folder=tmp_path / "out"):
            write_text(tmp_path / "out" / "table.md", "1")
        (tmp_path / "out" / "table.md").unlink()
        os.mkfifo(tmp_path / "out" / "table.md")
        if not overwrite:
            with pytest.raises(InputError, match="was changed since"):
                outputs(folder=tmp_path / "out")
            return
        with outputs(folder=tmp_path / "out", overwrite=True) as done:
            write_text(tmp_path / "out" / "table.md", "2")
        assert (done.where(tmp_path / "out") / "table.md").read_text() == "2"

    def test_what_was_changed_during_the_run_is_neither_replaced_nor_removed(self, tmp_path, elsewhere, capsys):
        out = tmp_path / "out"
        for change in ("table.md", "stale.md"):
            with outputs(folder=out, overwrite=True):
                write_text(out / "table.md", "1")
                write_text(out / "stale.md", "1")
            with outputs(folder=out) as done:
                (out / change).write_text("precious")
                write_text(out / "table.md", "2")
            assert (out / change).read_text() == "precious"
        assert "was changed since `test` wrote it" in capsys.readouterr().err
        # What was changed and not written is no longer its own, and the folder is renewed again.
        assert not done.failed
        with outputs(folder=out):
            write_text(out / "table.md", "3")

    def test_parts_of_results_are_never_removed_and_hinder_nothing(self, tmp_path):
        with pytest.raises(Stopped), outputs(folder=tmp_path):
            write_text(partial(tmp_path / "table.json"), "half")
            raise Stopped("half is written.")
        for k in "12":
            with outputs(folder=tmp_path):
                write_text(tmp_path / "table.json", k)
        assert (tmp_path / "table.partial.json").read_text() == "half"
        with pytest.raises(Stopped), outputs(folder=tmp_path):
            write_text(partial(tmp_path / "table.json"), "half again")
            raise Stopped("half is written.")
        with outputs(folder=tmp_path):
            write_text(tmp_path / "table.json", "3")
        assert (tmp_path / "table.partial.json").read_text() == "half"
        assert (tmp_path / "table.partial2.json").read_text() == "half again"

    def test_a_result_that_is_named_like_a_part_is_renewed(self, tmp_path):
        for k in "12":
            with outputs(folder=tmp_path) as done:
                write_text(tmp_path / "x.partial.csv", k)
            assert not done.failed and (tmp_path / "x.partial.csv").read_text() == k

    def test_what_a_killed_command_left_hinders_nothing_and_is_removed(self, tmp_path):
        (tmp_path / f"{PREFIX}half.part").write_text("half")
        with pytest.raises(Stopped), outputs(folder=tmp_path):
            raise KeyboardInterrupt
        assert len(parts(tmp_path)) == 1
        with outputs(folder=tmp_path):
            write_text(tmp_path / "table.md", "1")
        assert parts(tmp_path) == []

    @pytest.mark.parametrize("overwrite", [False, True])
    def test_a_hard_link_in_its_own_folder_is_refused_before_the_work(self, tmp_path, overwrite):
        with outputs(folder=tmp_path / "out"):
            write_text(tmp_path / "out" / "table.md", "1")
        os.link(tmp_path / "out" / "table.md", tmp_path / "kept.md")
        with pytest.raises(InputError, match="hard links"):
            outputs(folder=tmp_path / "out", overwrite=overwrite)

    def test_the_list_names_no_file_outside(self, tmp_path):
        out, outside = tmp_path / "out", tmp_path / "precious"
        outside.write_text("precious")
        out.mkdir()
        (out / "a").write_text("a")
        hashes = {"../precious": "", str(outside): ""}
        (out / MANIFEST).write_text(json.dumps({"command": "test", "files": hashes}))
        with outputs(folder=out):
            write_text(out / "new", "1")
        assert outside.read_text() == "precious"
