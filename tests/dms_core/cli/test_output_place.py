"""Writing one file: whole or not at all, where it stands, with the rights that it had."""

import errno
import os
import socket
import stat
import threading

import pytest

from dms_core.errors import InputError
from dms_core.files.output_file import write_bytes, write_file, write_text
from dms_core.files.output_place import check_folder, check_writable
from tests.dms_core.cli.written import parts

root_only = pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root gives files away")


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
