"""A team of threads: all jobs are done, whatever their number, and a forked process makes threads of its own."""

import os
import threading

import pytest

from dms_core.compiled.threads import Threads


def test_the_caller_works_too_and_all_is_done():
    team, seen = Threads(3, 3), []
    both = threading.Barrier(3)

    def job():
        both.wait(10.0)
        seen.append(threading.current_thread() is threading.main_thread())

    team.run([job] * 3)
    assert sorted(seen) == [False, False, True]
    team.close()
    assert team.count == 1
    team.run([lambda: seen.append(None)])
    assert len(seen) == 4


def test_a_job_that_fails_is_told_when_all_have_ended():
    team, ended = Threads(2, 2), []

    def fails():
        raise ValueError("broken")

    with pytest.raises(ValueError, match="broken"):
        team.run([lambda: ended.append(True), fails])
    with pytest.raises(ValueError, match="broken"):
        team.run([fails, lambda: ended.append(True)])
    assert ended == [True, True]
    team.close()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.filterwarnings("ignore:This process .* is multi-threaded:DeprecationWarning")
def test_a_forked_process_makes_its_own():
    """The threads of its parent are not there; to wait for them would be for ever."""
    team, done = Threads(2, 2), []
    team.run([lambda: done.append(1)] * 2)
    child = os.fork()
    if child == 0:
        threading.Timer(20.0, os._exit, (1,)).start()
        team.run([lambda: done.append(1)] * 2)
        os._exit(0 if len(done) == 4 else 2)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    team.close()
