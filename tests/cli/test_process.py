"""The command as a process: a quick start, and a clean end when it is interrupted or terminated."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

COMMAND = Path(sys.executable).with_name("designer")
HEAVY = ("numpy", "scipy", "casadi", "pydantic", "pandas", "matplotlib", "typst", "rich", "sympy")

# The study is replaced by one that says that it works and then waits.
WAITING = """
import sys, time, types
from designer import cli
run = types.ModuleType("designer.study.run")
def run_study(*arguments, **options):
    print("working", flush=True)
    time.sleep(60)
run.run_study = run_study
sys.modules["designer.study.run"] = run
sys.argv = ["designer", "study", "my.toml", "--quiet"]
cli.main()
"""


def test_starting_imports_nothing_heavy() -> None:
    check = f"import sys, designer.cli; print(*(set({HEAVY!r}) & sys.modules.keys()))"
    result = subprocess.run([sys.executable, "-c", check], capture_output=True, text=True, check=True)
    assert result.stdout.split() == []


def test_the_installed_command_refuses_in_one_line(tmp_path: Path) -> None:
    result = subprocess.run(
        [COMMAND, "study", "absent.toml"], capture_output=True, text=True, cwd=tmp_path, check=False
    )
    assert result.returncode == 2
    assert result.stdout == ""
    assert result.stderr == "designer: absent.toml: cannot be read: No such file or directory\n"


def test_python_dash_m_is_the_command_too() -> None:
    by_module = subprocess.run([sys.executable, "-m", "designer", "--version"], capture_output=True, check=True)
    assert by_module.stdout == subprocess.run([COMMAND, "--version"], capture_output=True, check=True).stdout


@pytest.mark.parametrize(
    ("number", "code", "line"),
    [(signal.SIGINT, 130, "designer: interrupted\n"), (signal.SIGTERM, 143, "designer: terminated\n")],
)
def test_an_interrupted_study_ends_with_one_line(number: signal.Signals, code: int, line: str, tmp_path: Path) -> None:
    subprocess.run([COMMAND, "init", "my.toml"], cwd=tmp_path, check=True, capture_output=True)
    process = subprocess.Popen(
        [sys.executable, "-c", WAITING], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "working\n"
    started = time.monotonic()
    process.send_signal(number)
    _, errors = process.communicate(timeout=20)
    assert (process.returncode, errors) == (code, line)
    assert time.monotonic() - started < 5
