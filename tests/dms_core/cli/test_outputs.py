"""Outputs of commands: nothing of others is lost, nothing half written is left, and a full disk loses no result."""

import errno
import json
import os
import socket
import stat
import threading
from pathlib import Path

import pytest

from dms_core import output_place
from dms_core.errors import DmsError, InputError, Stopped
from dms_core.output_file import write_bytes, write_file, write_text
from dms_core.output_place import PREFIX, check_folder, check_writable
from dms_core.outputs import MANIFEST, OutputFile, Outputs, partial

root_only = pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root gives files away")


def parts(folder):
    """Files that are not whole."""
    return [path for path in folder.rglob("*") if path.name.startswith(PREFIX)]


@pytest.fixture
def elsewhere(tmp_path, monkeypatch):
    """The folder for temporary files."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    return folder


@pytest.fixture
def full(tmp_path, monkeypatch):
    """A folder on which there is no room for more than 8000 bytes a file, as on a full disk."""
    folder = tmp_path / "full"
    folder.mkdir()
    known = os.fdopen

    def fdopen(handle, *arguments, **options):
        file = known(handle, *arguments, **options)
        if folder in Path(os.readlink(f"/proc/self/fd/{handle}")).parents:
            write = file.write

            class Full:
                def __getattr__(self, name):
                    return getattr(file, name)

                def __enter__(self):
                    return self

                def __exit__(self, *error):
                    file.close()

                def write(self, content):
                    if file.tell() + len(content) > 8000:
                        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                    return write(content)

            return Full()
        return file

    monkeypatch.setattr(output_place.os, "fdopen", fdopen)
    return folder


class TestWholeFile:
    def test_a_link_stays_and_what_it_names_is_replaced(self, tmp_path):
        target, link, second = tmp_path / "deep" / "target", tmp_path / "link", tmp_path / "second"
        target.parent.mkdir()
        target.write_text("old")
        link.symlink_to(target)
        second.symlink_to("link")
        write_text(second, "new")
        assert second.is_symlink() and link.is_symlink() and target.read_text() == "new"

    def test_a_link_to_nothing_yet_is_followed(self, tmp_path):
        (tmp_path / "link").symlink_to(tmp_path / "folder" / "target")
        write_text(tmp_path / "link", "new")
        assert (tmp_path / "link").is_symlink() and (tmp_path / "folder" / "target").read_text() == "new"

    @pytest.mark.parametrize("mode", [0o600, 0o640, 0o755])
    def test_permission_bits_are_kept(self, tmp_path, mode):
        path = tmp_path / "file"
        path.write_text("old")
        path.chmod(mode)
        write_text(path, "new")
        assert stat.S_IMODE(path.stat().st_mode) == mode and path.read_text() == "new"

    def test_a_new_file_has_the_bits_of_the_system(self, tmp_path):
        before = os.umask(0o027)
        try:
            write_text(tmp_path / "file", "new")
        finally:
            os.umask(before)
        assert stat.S_IMODE((tmp_path / "file").stat().st_mode) == 0o640

    def test_the_umask_is_never_touched(self, tmp_path, monkeypatch):
        # Another thread would make files that all may write.
        monkeypatch.setattr(os, "umask", lambda mask: pytest.fail("the umask was set"))
        check_writable(tmp_path / "file")
        write_text(tmp_path / "file", "new")

    def test_what_replaces_a_private_file_is_private_while_it_is_written(self, tmp_path):
        path, modes = tmp_path / "file", []
        path.write_text("old")
        path.chmod(0o600)

        def content(file):
            modes.append(stat.S_IMODE(os.fstat(file.fileno()).st_mode))

        write_file(path, content)
        assert modes == [0o600]

    @root_only
    def test_the_owner_is_kept(self, tmp_path):
        path = tmp_path / "file"
        path.write_text("old")
        os.chown(path, 12345, 23456)
        write_text(path, "new")
        assert (path.stat().st_uid, path.stat().st_gid) == (12345, 23456)

    def test_a_pipe_is_written_through(self, tmp_path):
        pipe, read = tmp_path / "pipe", []
        os.mkfifo(pipe)
        reader = threading.Thread(target=lambda: read.append(pipe.read_bytes()))
        reader.start()
        write_bytes(pipe, b"table")
        reader.join()
        assert read == [b"table"] and stat.S_ISFIFO(pipe.stat().st_mode)

    @root_only
    def test_a_device_is_written_through(self, tmp_path):
        null = tmp_path / "null"
        os.mknod(null, 0o666 | stat.S_IFCHR, os.makedev(1, 3))
        try:
            write_text(null, "gone")
        except PermissionError:
            pytest.skip("devices cannot be used here")
        assert stat.S_ISCHR(null.stat().st_mode)

    def test_the_null_device_stays_one(self):
        write_text("/dev/null", "gone")
        assert stat.S_ISCHR(os.stat("/dev/null").st_mode)

    def test_standard_output_is_written_where_it_stands(self, tmp_path, capfd):
        print("before")
        write_text("/dev/stdout", "table\n")
        print("after", flush=True)
        assert capfd.readouterr().out == "before\ntable\nafter\n"

    def test_a_socket_is_refused(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)  # A socket's path has to be short.
        with socket.socket(socket.AF_UNIX) as one:
            one.bind("socket")
            with pytest.raises(InputError, match="is a socket or a disk"):
                check_writable("socket")

    def test_a_read_only_file_is_refused(self, tmp_path):
        path = tmp_path / "file"
        path.write_text("kept")
        path.chmod(0o444)
        with pytest.raises(InputError, match=r"is read-only \(mode 444\)"):
            write_text(path, "new")
        assert path.read_text() == "kept"

    @pytest.mark.parametrize("count", [249, 255])
    def test_the_longest_names_work(self, tmp_path, count):
        path = tmp_path / ("x" * count)
        check_writable(path)
        write_text(path, "new")
        assert path.read_text() == "new"

    @pytest.mark.parametrize("place", ["{long}", "{long}/file", "new/{long}", "new/{long}/file"])
    def test_a_name_that_is_too_long_is_refused(self, tmp_path, place):
        with pytest.raises(InputError, match="choose a shorter name|choose one of at most 255") as caught:
            check_writable(tmp_path / place.format(long="ü" * 128))
        assert list(tmp_path.iterdir()) == [] and len(str(caught.value)) < 700

    @pytest.mark.parametrize("check", [check_writable, check_folder])
    def test_no_name_at_all(self, tmp_path, check):
        with pytest.raises(InputError, match="NUL"):
            check(f"{tmp_path}/a\0b")
        (tmp_path / "loop").symlink_to("loop")
        with pytest.raises(InputError, match="cannot be written"):
            check(tmp_path / "loop")
        (tmp_path / "file").write_text("")
        with pytest.raises(InputError, match="is a file, not a folder"):
            check(tmp_path / "file" / "new")

    def test_a_full_disk_is_an_error_and_leaves_nothing(self, full):
        path = full / "file"
        path.write_text("kept")
        with pytest.raises(OSError) as caught:
            write_text(path, "x" * 9000)
        assert caught.value.errno == errno.ENOSPC and caught.value.filename == str(path)
        assert path.read_text() == "kept" and parts(full) == []


def outputs(*files, **options):
    """Outputs of a command `test`, files by their options."""
    return Outputs("test", files=[OutputFile(f"--{k}", path) for k, path in enumerate(files)], **options)


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
