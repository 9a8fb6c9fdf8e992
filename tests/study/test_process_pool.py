"""Ctrl-C is held back or ignored for a moment only, whatever happens in it."""

from __future__ import annotations

import multiprocessing.forkserver
import os
import signal

import pytest

from designer.study.process_pool import build_pool, interrupts_held_back


def test_ctrl_c_works_again_after_a_server_that_did_not_start(monkeypatch):
    def fail() -> None:
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
        raise OSError("no more processes")

    before = signal.getsignal(signal.SIGINT)
    monkeypatch.setattr(multiprocessing.forkserver, "ensure_running", fail)
    with pytest.raises(OSError, match="no more processes"):
        build_pool(1, "designer.study.task")
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.parametrize("error", [None, OSError("no more processes")])
def test_an_interrupt_held_back_comes_in_the_end_even_if_that_is_an_error(error):
    reached = []

    def hand_out_work() -> None:
        with interrupts_held_back():
            os.kill(os.getpid(), signal.SIGINT)
            reached.append("the end")
            if error is not None:
                raise error

    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt) as interrupt:
        hand_out_work()
    assert reached == ["the end"]
    assert interrupt.value.__context__ is error
    assert signal.getsignal(signal.SIGINT) is before


def test_an_error_without_an_interrupt_is_itself():
    with pytest.raises(OSError, match="no more processes"), interrupts_held_back():
        raise OSError("no more processes")
