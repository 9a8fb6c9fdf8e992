import pytest

from designer.study.sweep.definition import read_sweep
from designer.study.sweep.run import run_sweep
from designer.study.sweep.tables import read_sweep_results
from support import CONFIGS
from support.shipped_problems import toml_with_constant_noise

QUICK = """
plan = "grid"
requirement = "base.toml"
[[axis]]
key = "baseline_mm"
values = [96, 98, 100]
[[axis]]
key = "envelope.height_mm"
values = [136, 138, 140]
"""


def write_quick_sweep(folder):
    """Write a sweep of nine points, two configurations each, which takes seconds; returns its path."""
    base = toml_with_constant_noise((CONFIGS / "indoor_robot.toml").read_text())
    # Quick to solve; with a bound on the blur this pair is feasible nowhere in the sweep.
    base += '\n[solve]\nstarts = 2\nconfigurations = ["folded-PaPa-Hy-*"]\n[sharpness]\nmax_blur_deg = inf\n'
    (folder / "base.toml").write_text(base)
    path = folder / "quick.toml"
    path.write_text(QUICK)
    return path


@pytest.fixture
def quick_sweep(tmp_path):
    return write_quick_sweep(tmp_path)


@pytest.fixture(scope="session")
def finished_folder(tmp_path_factory):
    """The folder of the quick sweep, solved in one go by two processes."""
    folder = tmp_path_factory.mktemp("undisturbed")
    definition, base = read_sweep(write_quick_sweep(folder))
    run_sweep(definition, base, folder / "out", jobs=2)
    return folder / "out"


@pytest.fixture(scope="session")
def undisturbed(finished_folder):
    return read_sweep_results(finished_folder)
