"""How fast: a whole study on two cores, our solver against SciPy's SLSQP, the start of the command, and memory.

Nothing here is a test: the numbers are written to ``results/speed.txt`` with the machine they were taken on.
"""

from __future__ import annotations

import os
import platform
import statistics
import subprocess
import sys
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np

from benchmarks.opponents import Attempt, Instance, ours, recording, slsqp
from benchmarks.problems import RESULTS, ROOT, shipped_requirement
from designer.optimise.search import search

COMMAND = Path(sys.executable).with_name("designer")
# Objectives nearer than this, as a ratio, count as equally good.
SAME = 1e-3
SAMPLING_SECONDS = 0.05

STUDY = """
import json, sys, time
from pathlib import Path
from designer.requirement import read_requirement
started = time.perf_counter()
from designer.study.run import solve_study
seen = []
study = solve_study(read_requirement(Path(sys.argv[1])), jobs=int(sys.argv[2]), progress=seen.append)
end = time.perf_counter()
print(json.dumps({"solved": seen[-1].elapsed_seconds, "with_fronts": end - started, "feasible": len(study.feasible)}))
"""


@click.command()
@click.option("--requirement", default="indoor_robot", show_default=True)
@click.option("--jobs", default=2, show_default=True)
@click.option("--every", default=1, show_default=True, help="Give SLSQP only every so manyth of the recorded problems.")
@click.option("--numpy-every", default=10, show_default=True, help="The same for finite differences in NumPy.")
@click.option("--results", type=click.Path(path_type=Path), default=RESULTS / "speed.txt", show_default=True)
def main(requirement: str, jobs: int, every: int, numpy_every: int, results: Path) -> None:
    """Measure everything, print it, and write it down."""
    lines = [f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}"]
    lines.append(f"load at the start: {os.getloadavg()[0]:.2f} (other work on the machine makes every number worse)")
    for part in (measure_help(), measure_study(requirement, jobs), measure_solvers(requirement, every, numpy_every)):
        lines += ["", *part]
        click.echo("\n".join(part) + "\n", err=True)
    results.parent.mkdir(parents=True, exist_ok=True)
    results.write_text("\n".join(lines) + "\n", encoding="utf-8")


def measure_help(runs: int = 15) -> list[str]:
    """Wall time of ``designer --help``."""
    seconds = []
    for _ in range(runs):
        started = time.perf_counter()
        subprocess.run([COMMAND, "--help"], check=True, stdout=subprocess.DEVNULL)
        seconds.append(time.perf_counter() - started)
    return [f"designer --help: median {statistics.median(seconds):.3f} s, best {min(seconds):.3f} s (target 0.3 s)"]


def measure_study(requirement: str, jobs: int) -> list[str]:
    """Wall time and peak memory of all 44, optimised and traced, without the PDF."""
    import json

    path = ROOT / "configs" / f"{requirement}.toml"
    process = subprocess.Popen(
        [sys.executable, "-c", STUDY, path, str(jobs)], stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    peak = Peak()
    watcher = threading.Thread(target=watch, args=(process, peak))
    watcher.start()
    output, _ = process.communicate()
    watcher.join()
    found = json.loads(output)
    return [
        f"{requirement}, {jobs} processes, {found['feasible']} of 44 feasible:",
        f"  all 44 optimised and traced   {found['solved']:.2f} s (target 6 s)",
        f"  with the fronts of the best   {found['with_fronts']:.2f} s, process start-up included",
        f"  peak memory of all processes  {peak.proportional / 1e6:.0f} MB proportional (PSS), target 600 MB",
        f"                                {peak.resident / 1e6:.0f} MB resident (RSS counts shared pages many times)",
    ]


@dataclass(slots=True)
class Peak:
    """Largest sums over the processes of a group, bytes."""

    proportional: float = 0.0
    resident: float = 0.0


def watch(process: subprocess.Popen[str], peak: Peak) -> None:
    """Sample the memory of a process group until its leader ends."""
    while process.poll() is None:
        proportional = resident = 0.0
        for member in members(process.pid):
            try:
                text = Path(f"/proc/{member}/smaps_rollup").read_text(encoding="ascii")
            except OSError:
                continue
            fields = dict(line.split(":", 1) for line in text.splitlines()[1:])
            proportional += 1024.0 * float(fields["Pss"].split()[0])
            resident += 1024.0 * float(fields["Rss"].split()[0])
        peak.proportional = max(peak.proportional, proportional)
        peak.resident = max(peak.resident, resident)
        time.sleep(SAMPLING_SECONDS)


def members(group: int) -> list[int]:
    """Processes of a process group."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdecimal():
            try:
                fields = (entry / "stat").read_text(encoding="utf-8").rpartition(")")[2].split()
            except OSError:
                continue
            if int(fields[2]) == group:
                found.append(int(entry.name))
    return found


def measure_solvers(requirement: str, every: int, numpy_every: int) -> list[str]:
    """Our solver and SLSQP on every program that the searches of all 44 solve, from the same starts."""
    asked = shipped_requirement(requirement)
    with recording() as instances:
        started = time.process_time()
        for configuration in asked.configurations:
            search(asked, configuration)
        whole = time.process_time() - started
    first = [ours(instance) for instance in instances]
    lines = [
        f"solvers, processor time, on the {len(instances)} programs that the searches of {requirement} solve:",
        f"  our searches as a whole, screening, expressions and checks included: {whole:.1f} s,",
        f"  of which in the solver {sum(attempt.seconds for attempt in first):.1f} s",
        "  (same starts, same variables scaled to 0..1, same constraints; building expressions counted on no side)",
    ]
    contests = (
        ("SLSQP, exact derivatives", "exact", every, "target 3"),
        ("SLSQP, finite differences of the compiled functions", "compiled", every, "target 50"),
        ("SLSQP, finite differences of the NumPy evaluation", "numpy", numpy_every, "target 50"),
    )
    for name, derivatives, step, target in contests:
        chosen = list(range(0, len(instances), step))
        theirs = [slsqp(instances[index], derivatives) for index in chosen]
        lines += compare(name, target, [instances[i] for i in chosen], [first[i] for i in chosen], theirs)
    return lines


def compare(name: str, target: str, instances: list[Instance], mine: list[Attempt], theirs: list[Attempt]) -> list[str]:
    """Ratio of times, and whose result is better how often."""
    ratio = sum(attempt.seconds for attempt in theirs) / sum(attempt.seconds for attempt in mine)
    paired = [other.seconds / own.seconds for own, other in zip(mine, theirs, strict=True) if own.seconds > 0.0]
    better = equal = worse = only_mine = only_theirs = neither = 0
    for own, other in zip(mine, theirs, strict=True):
        if own.is_feasible and other.is_feasible:
            margin = SAME * max(abs(own.objective), abs(other.objective), 1e-3)
            better += own.objective < other.objective - margin
            worse += own.objective > other.objective + margin
            equal += abs(own.objective - other.objective) <= margin
        else:
            only_mine += own.is_feasible
            only_theirs += other.is_feasible
            neither += not own.is_feasible and not other.is_feasible
    return [
        f"  {name} ({len(instances)} programs): {ratio:.1f} times our time ({target}); "
        f"median program {np.median(paired):.1f} times",
        f"    per program {1e3 * np.mean([one.seconds for one in theirs]):.1f} ms "
        f"against {1e3 * np.mean([one.seconds for one in mine]):.1f} ms",
        f"    ours better in {better}, equal in {equal}, worse in {worse}; "
        f"only ours feasible in {only_mine}, only theirs in {only_theirs}, neither in {neither}",
    ]


if __name__ == "__main__":
    main()
