"""Speed of a sweep: problems per second cold and warm, the ratio to a study of each point, and nothing lost.

    python -m benchmarks.sweep [SWEEP.toml] [--out DIR] [--jobs 2] [--sample 20] [--cluster]

Runs the sweep, then solves a sample of its points from nothing as ``designer study`` does and compares: seconds for a
point, configurations feasible in one and not in the other, and the first objective. ``--cluster`` instead times the
same sweep on one and on two workers of a local Dask cluster.
"""

from __future__ import annotations

import argparse
import os
import time
from contextlib import nullcontext
from pathlib import Path

import numpy as np

from designer.study.run import solve_study
from designer.study.sweep.cluster import cluster_workers
from designer.study.sweep.definition import read_sweep, requirement_at
from designer.study.sweep.export import read_sweep_results
from designer.study.sweep.plan import plan_points
from designer.study.sweep.run import run_sweep

DEFAULT = Path("configs/sweeps/lens_and_baseline.toml")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sweep", type=Path, nargs="?", default=DEFAULT)
    parser.add_argument("--out", type=Path, default=Path("reports/benchmark_sweep"))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--sample", type=int, default=20)
    parser.add_argument("--cluster", action="store_true")
    arguments = parser.parse_args()
    if arguments.cluster:
        compare_workers(arguments.sweep, arguments.out)
    else:
        compare_with_studies(arguments.sweep, arguments.out, arguments.jobs, arguments.sample)


def compare_with_studies(path: Path, out: Path, jobs: int, sample: int) -> None:
    definition, base = read_sweep(path)
    points = plan_points(definition)
    started = time.perf_counter()
    run_sweep(definition, base, out, jobs=jobs, progress=lambda state: print(state, end="\r"))
    swept = time.perf_counter() - started
    table = read_sweep_results(out)
    possible = (table["status"] != "impossible").mean()
    print(
        f"\n{len(points)} requirements in {swept:.0f} s on {jobs} processes: {len(table) / swept:.0f} problems/s warm"
    )
    print(f"not impossible by rule: {possible:.1%}; feasible: {(table['status'] == 'feasible').mean():.1%}")

    chosen = np.random.default_rng(1).choice(len(points), size=min(sample, len(points)), replace=False)
    cold, lost, gained, worse = 0.0, [], [], []
    for number in chosen:
        requirement = requirement_at(base, points[number].coordinates)
        started = time.perf_counter()
        study = solve_study(requirement, jobs=jobs)
        cold += time.perf_counter() - started
        rows = table[table["point"] == number].set_index("configuration")
        for result in study.results:
            row = rows.loc[result.configuration.name]
            here, there = row["status"] == "feasible", result.status == "feasible"
            if there and not here:
                lost.append((int(number), result.configuration.name, row["reason"]))
            elif here and not there:
                gained.append((int(number), result.configuration.name))
            elif here and there and result.first is not None:
                studied = result.first.goals["depth_error"]
                worse.append(row["first_stage_depth_error_rms"] / studied - 1.0)
    problems = len(chosen) * len(base.configurations)
    print(f"{len(chosen)} studies in {cold:.0f} s (fronts included): {problems / cold:.1f} problems/s cold")
    print(f"ratio for each point: {(cold / len(chosen)) / (swept / len(points)):.1f}")
    print(f"feasible in a study and lost in the sweep: {len(lost)} {lost}")
    print(f"feasible in the sweep alone: {len(gained)} {gained}")
    if worse:
        shares = np.array(worse)
        print(
            f"first objective, sweep over study: median {np.median(shares):+.2e}, worst {shares.max():+.2e}, "
            f"best {shares.min():+.2e}; more than 0.1 % worse: {(shares > 1e-3).mean():.1%}"
        )


def compare_workers(path: Path, out: Path) -> None:
    definition, base = read_sweep(path)
    seconds = {}
    for workers in (1, 2):
        with cluster_workers(workers=workers) as cluster:
            # What a worker builds once is not what is timed.
            cluster.client.run(os.getpid)
            started = time.perf_counter()
            run_sweep(definition, base, out / f"{workers}", workers=nullcontext(cluster))
            seconds[workers] = time.perf_counter() - started
        print(f"{workers} workers: {seconds[workers]:.1f} s")
    print(f"speed-up {seconds[1] / seconds[2]:.2f}")


if __name__ == "__main__":
    main()
