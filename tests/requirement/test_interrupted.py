"""A Ctrl-C is never lost while a requirement is changed, as a sweep does for each of its points."""

from __future__ import annotations

import signal
from types import FrameType

import pytest

from designer.requirement import Requirement, read_requirement, set_key
from support import CONFIGS


def interrupt(_number: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


def set_keys(base: Requirement, microseconds: int) -> None:
    """Far longer than the time until the interrupt."""
    signal.setitimer(signal.ITIMER_REAL, microseconds * 1e-6)
    for _ in range(300):
        set_key(base, "baseline_mm", 61.0)


def test_no_interrupt_is_lost_while_keys_are_set() -> None:
    base = read_requirement(CONFIGS / "indoor_robot.toml")
    before = signal.signal(signal.SIGALRM, interrupt)
    try:
        for microseconds in range(200, 5000, 24):
            with pytest.raises(KeyboardInterrupt):
                set_keys(base, microseconds)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
