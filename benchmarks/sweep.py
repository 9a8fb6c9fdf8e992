"""Speed of a sweep: problems per second cold and warm, the ratio to a study of each point, and nothing lost.

    python -m benchmarks.sweep [SWEEP.toml] [--out DIR] [--jobs 2] [--sample 20] [--levels N] [--cluster]

Runs the sweep, then solves a sample of its points from nothing, as ``designer study`` does, and compares: seconds for
a point, configurations feasible in one and not in the other, and the first objective. Exit code 1 if the sweep has
lost a configuration that a study finds. ``--cluster`` instead times the same sweep on one and on two workers of a
local Dask cluster. ``--levels`` thins a grid out to so many values of each axis, to try the benchmark itself.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pandas as pd

from designer.files import InputError
from designer.requirement import Requirement
from designer.study.run import solve_study
from designer.study.study import Study
from designer.study.sweep.cluster import cluster_workers
from designer.study.sweep.definition import Axis, SweepDefinition, read_sweep, requirement_at
from designer.study.sweep.plan import Point, plan_points
from designer.study.sweep.run import SweepProgress, run_sweep
from designer.study.sweep.store import FILE_NAME, read_store
from designer.study.sweep.tables import read_sweep_results

DEFAULT = Path("configs/sweeps/lens_and_baseline.toml")
# A first objective this much above that of a study counts as worse.
NOTICEABLY = 1e-3


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sweep", type=Path, nargs="?", default=DEFAULT)
    parser.add_argument("--out", type=Path, default=Path("reports/benchmark_sweep"))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--sample", type=int, default=20)
    parser.add_argument("--levels", type=int)
    parser.add_argument("--cluster", action="store_true")
    arguments = parser.parse_args()
    try:
        definition, base = read_sweep(arguments.sweep)
        if arguments.levels is not None:
            definition = thinned(definition, arguments.levels)
        if arguments.cluster:
            compare_workers(definition, base, arguments.out)
            return 0
        return compare_with_studies(definition, base, arguments.out, arguments.jobs, arguments.sample)
    except InputError as error:
        print(error, file=sys.stderr)
        return 2


def thinned(definition: SweepDefinition, count: int) -> SweepDefinition:
    """The same grid with at most so many values of each axis, ends among them."""
    axes = []
    for axis in definition.axis:
        chosen = np.unique(np.linspace(0, len(axis.levels) - 1, count).round().astype(int))
        axes.append(Axis(key=axis.key, values=tuple(axis.levels[place] for place in chosen)))
    return definition.model_copy(update={"axis": tuple(axes)})


def compare_with_studies(definition: SweepDefinition, base: Requirement, out: Path, jobs: int, sample: int) -> int:
    points = plan_points(definition)
    refuse_old_results(out)
    started = time.perf_counter()
    run_sweep(definition, base, out, jobs=jobs, progress=show_progress())
    swept = time.perf_counter() - started
    table = read_sweep_results(out)
    print(f"{len(points)} requirements, {len(table)} problems in {swept:.1f} s on {jobs} processes")
    print(
        f"a point takes {swept / len(points):.2f} s, and {len(table) / swept:.0f} problems/s are solved, root included"
    )
    print_cost_of_points(out, points, len(base.configurations))
    possible = (table["status"] != "impossible").mean()
    print(f"not impossible by rule: {possible:.1%}; feasible: {(table['status'] == 'feasible').mean():.1%}")

    chosen = np.random.default_rng(1).choice(len(points), size=min(sample, len(points)), replace=False)
    cold, lost, gained, worse = 0.0, [], [], []
    for number in chosen:
        started = time.perf_counter()
        study = solve_study(requirement_at(base, points[number].coordinates), jobs=jobs)
        cold += time.perf_counter() - started
        found = compare_point(table[table["point"] == number].set_index("configuration"), study)
        lost += [(int(number), *each) for each in found[0]]
        gained += [(int(number), each) for each in found[1]]
        worse += found[2]
    if not len(chosen):
        return 0
    each = cold / len(chosen)
    print(f"{len(chosen)} studies in {cold:.1f} s: {len(base.configurations) / each:.1f} problems/s cold")
    print(f"a study of a point takes {each / (swept / len(points)):.1f} times as long as its share of the sweep")
    print(f"feasible in the sweep alone: {len(gained)} {gained}")
    if worse:
        shares = np.array(worse)
        print(
            f"first objective, sweep over study, {shares.size} designs: median {np.median(shares):+.2e}, worst "
            f"{shares.max():+.2e}, best {shares.min():+.2e}; worse by more than {NOTICEABLY:.1%}: "
            f"{(shares > NOTICEABLY).mean():.1%}"
        )
    print(f"feasible in a study and lost in the sweep: {len(lost)} {lost}")
    return 1 if lost else 0


def compare_point(rows: pd.DataFrame, study: Study) -> tuple[list[tuple[str, str]], list[str], list[float]]:
    """What the sweep lost (with its reason) and what it found beside a study, and first objectives over the study's."""
    lost, gained, worse = [], [], []
    for result in study.rows:
        name, first = result.configuration, result.number("first_stage_depth_error_rms")
        row = rows.loc[name]
        here, there = row["status"] == "feasible", result.status == "feasible"
        if there and not here:
            lost.append((name, str(row["reason"])))
        elif here and not there:
            gained.append(name)
        elif here and first is not None:
            worse.append(float(row["first_stage_depth_error_rms"] / first - 1.0))
    return lost, gained, worse


def print_cost_of_points(out: Path, points: tuple[Point, ...], problems: int) -> None:
    """Seconds of one process for the root, which starts from nothing, and for the others."""
    (root,) = (point.number for point in points if point.parent is None)
    with read_store(out) as connection:
        spent = dict(connection.execute("SELECT point, SUM(seconds) FROM tasks GROUP BY point"))
    warm = [seconds for number, seconds in spent.items() if number != root]
    print(f"root: {spent[root]:.1f} s of one process, {problems / spent[root]:.1f} problems/s cold")
    if warm:
        print(
            f"other points: median {np.median(warm):.2f} s, mean {np.mean(warm):.2f} s, longest {max(warm):.1f} s of "
            f"one process, {problems / np.mean(warm):.0f} problems/s warm"
        )


def compare_workers(definition: SweepDefinition, base: Requirement, out: Path) -> None:
    seconds, tables = {}, {}
    for workers in (1, 2):
        folder = out / f"{workers}_workers"
        refuse_old_results(folder)
        with cluster_workers(workers=workers) as cluster:
            # Workers import before the clock starts; the programs of the configurations are built under it.
            cluster.client.run(os.getpid)
            started = time.perf_counter()
            run_sweep(definition, base, folder, workers=nullcontext(cluster), progress=show_progress())
            seconds[workers] = time.perf_counter() - started
        tables[workers] = read_sweep_results(folder)
        points = tables[workers]["point"].nunique()
        print(f"{workers} workers: {seconds[workers]:.1f} s, {seconds[workers] / points:.2f} s a point")
    print(f"speed-up {seconds[1] / seconds[2]:.2f}; the same tables: {tables[1].equals(tables[2])}")


def refuse_old_results(folder: Path) -> None:
    """What is finished is not computed again, and would not be timed."""
    if (folder / FILE_NAME).exists():
        raise InputError(f"{folder}: holds a sweep already; remove it, or give another folder with --out")


def show_progress() -> Callable[[SweepProgress], None]:
    def show(state: SweepProgress) -> None:
        if sys.stderr.isatty():
            print(
                f"\r{state.done}/{state.total} tasks, {state.remaining_seconds:.0f} s left  ", end="", file=sys.stderr
            )

    return show


if __name__ == "__main__":
    sys.exit(main())
