"""Its presence puts this folder on the path, so that tests of different rooms share the helpers in it."""

import signal

import pytest


@pytest.fixture(autouse=True, scope="session")
def _interrupts_are_heard():
    """A shell starts what runs in its background deaf to Ctrl-C, and processes started from there are deaf too."""
    previous = signal.getsignal(signal.SIGINT)
    if previous is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, previous)
