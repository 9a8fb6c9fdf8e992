"""Its presence puts this folder on the path, so that tests of different rooms share the helpers in it."""

import signal
from typing import Any

import pytest
from hypothesis import settings

# How long an example takes says nothing on a machine that does other work.
settings.register_profile("unhurried", deadline=None)
settings.load_profile("unhurried")

# Their tests share nothing that takes long, and together take so long that one process alone would be the last.
ONE_BY_ONE = (
    "imaging/endtoend/test_check.py",
    "optics/test_clearance.py",
    "optimise/test_search.py",
    "study/sweep/test_multipliers.py",
    "study/test_acceptance.py",
)


def unit_of(nodeid: str) -> str:
    """What one process runs as a whole: a file, whose fixtures are then computed once, or a single test."""
    name = nodeid.partition("::")[0]
    return nodeid if name.endswith(ONE_BY_ONE) else name


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Slow tests come first, those of whole files before all, so that short ones fill up the end and no core idles."""
    items.sort(key=lambda item: (item.get_closest_marker("slow") is None, unit_of(item.nodeid) == item.nodeid))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Units go to whichever process is free, in the order above; ``--dist`` still overrules it.

    Marks for ``--dist loadgroup`` would say the same, but pytest-xdist 3.8 loses them under pytest 9.
    """
    if config.getoption("dist") != "load":
        return None
    from xdist.scheduler import LoadScopeScheduling

    class UnitScheduling(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return unit_of(nodeid)

    config.option.loadscopereorder = False
    return UnitScheduling(config, log)


@pytest.fixture(autouse=True, scope="session")
def _interrupts_are_heard():
    """A shell starts what runs in its background deaf to Ctrl-C, and processes started from there are deaf too."""
    previous = signal.getsignal(signal.SIGINT)
    if previous is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, previous)
