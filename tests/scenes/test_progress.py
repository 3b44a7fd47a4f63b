"""Threads that run kernels: what a call gives, and what Ctrl-C leaves of it; and what workers
announce."""

import os
import signal
import threading
from collections import deque

import pytest

from rockcheck.scenes.progress import announce, announcing, interruptible
from rockcheck.validation.execute.pool import Call, Pool


def test_interruptible_calls_share_a_thread_and_a_forked_process_has_its_own():
    first = interruptible(threading.get_ident)
    assert first != threading.get_ident()
    with pytest.raises(ZeroDivisionError):
        interruptible(lambda: 1 // 0)
    assert interruptible(threading.get_ident) == first
    if hasattr(os, "fork"):
        child = os.fork()
        if child == 0:
            signal.alarm(60)
            os._exit(interruptible(lambda: 7))
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7


@pytest.mark.needs("POSIX")
def test_the_call_after_an_interrupted_one_works_while_that_one_goes_on():
    released = threading.Event()
    previous = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            interruptible(lambda: (os.kill(os.getpid(), signal.SIGINT), released.wait(60.0)))
        assert interruptible(lambda: 3) == 3
        assert not released.is_set()
    finally:
        released.set()
        signal.signal(signal.SIGINT, previous)


def test_a_worker_announces_on_the_runs_own_stderr(capfd):
    """Its output goes nowhere otherwise; and it says nothing where the run does not want to hear of
    it."""
    calls = [Call(announce, ("compiling",)), Call(print, ("noise",))]
    with announcing(lambda words: None), Pool(1) as pool:
        assert [ended.error for ended in pool.run(deque(calls))] == [None, None]
    assert capfd.readouterr() == ("", "rockcheck: compiling\n")
    with Pool(1) as pool:
        assert [ended.error for ended in pool.run(deque(calls))] == [None, None]
    assert capfd.readouterr() == ("", "")
