"""Ctrl-C in a terminal reaches worker processes too, while they load what they need as well."""

import multiprocessing
import os
import signal
from concurrent.futures import ProcessPoolExecutor

import pytest

from hil.study import side_by_side
from hil.study.workers import leave_ctrl_c_to_parent, submit
from tests.sweep.deadly import ctrl_c

pytestmark = pytest.mark.skipif(
    not hasattr(signal, "pthread_sigmask"), reason="no signal masks on this system"
)


def asked_of_a_worker(hand_out, initializer=None):
    """Return what Ctrl-C would do in a worker that is begun so."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, context, initializer) as pool:
        return hand_out(pool, ctrl_c, 0).result()


def test_ctrl_c_waits_until_a_worker_is_set_up():
    """It is held back from the start on, and ignored once that is done; this process is as before."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    assert asked_of_a_worker(submit) == (True, False)
    assert asked_of_a_worker(submit, leave_ctrl_c_to_parent) == (False, True)
    assert signal.pthread_sigmask(signal.SIG_BLOCK, ()) == before
    held = asked_of_a_worker(ProcessPoolExecutor.submit)  # negative control
    assert held == (False, False)


def test_ctrl_c_between_two_runs_begins_no_other(monkeypatch):
    """While none is at work it is noted; a run that is at work is stopped by it."""
    monkeypatch.setattr(side_by_side, "_interrupted", type(side_by_side._interrupted)())
    monkeypatch.setattr(side_by_side, "_idle", type(side_by_side._idle)())
    before = signal.signal(signal.SIGINT, side_by_side._on_ctrl_c)
    try:
        side_by_side._idle.set()
        os.kill(os.getpid(), signal.SIGINT)
        assert side_by_side._interrupted.is_set()
        with pytest.raises(KeyboardInterrupt):
            side_by_side._work(None)
        side_by_side._idle.clear()
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, before)
