"""Whether a sweep is as good as a study of each of its points, and whether where it starts makes a difference.

    python -m benchmarks.sweep_against_study [SWEEP.toml ...] [--out DIR] [--levels 4] [--only NAMES] [--jobs 2]

Without a file: a drone-like sweep with a tight corner, and the shipped one, thinned, with constant noise. Each is
swept twice, from the first and from the last value of every axis, and every point is solved as ``designer study``
does. Prints the share of first objectives worse than a study's, and the winners that differ from its: in the first
objective by more than the tolerance, or tied. Exit code 1 unless at most 1 % of the first objectives are more than
0.1 % worse, none is more than 2 % worse, nothing feasible is lost, and all winners are the study's or tied.

Studies go to ``studies.csv`` point by point, sweeps to their stores; the same command resumes.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.sweep import thinned
from designer.requirement import Requirement, set_key
from designer.study.ranking import best_first, ranking_columns
from designer.study.selection import restrict
from designer.study.sweep.definition import SweepDefinition, read_sweep, requirement_at
from designer.study.sweep.plan import plan_points
from designer.study.sweep.run import run_sweep
from designer.study.sweep.tables import read_sweep_results
from designer.study.task import solve_configuration

SWEEPS = (
    Path("benchmarks/sweeps/drone_baseline_and_height.toml"),
    Path("configs/sweeps/lens_and_baseline.toml"),
)
NOISE_PX = 0.1
NOTICEABLY, MUCH = 1e-3, 2e-2
MOST_NOTICEABLY_WORSE = 0.01


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sweeps", type=Path, nargs="*", default=SWEEPS)
    parser.add_argument("--out", type=Path, default=Path("reports/sweep_against_study"))
    parser.add_argument("--levels", type=int, default=4)
    parser.add_argument("--only", action="append", default=[], help="configurations, by name or pattern; default: all")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--as-shipped", action="store_true", help="keep a predicted noise")
    arguments = parser.parse_args()
    passed = True
    for path in arguments.sweeps:
        definition, base = read_sweep(path)
        if not arguments.as_shipped and base.noise_px == "predicted":
            base = set_key(base, "noise_px", NOISE_PX)
        base = restrict(base, tuple(arguments.only))
        definition = thinned(definition, arguments.levels)
        passed &= compare(definition, base, arguments.out / path.stem, arguments.jobs)
    return 0 if passed else 1


def compare(definition: SweepDefinition, base: Requirement, out: Path, jobs: int) -> bool:
    """Sweep from both ends, study every point, and print what differs."""
    tables = {}
    for end, index in (("first", 0), ("last", -1)):
        axes = [axis.model_copy(update={"start": axis.levels[index]}) for axis in definition.axis]
        from_end = definition.model_copy(update={"axis": tuple(axes)})
        run_sweep(from_end, base, out / f"from_{end}", jobs=jobs)
        tables[end] = read_sweep_results(out / f"from_{end}")
    studies = study_points(definition, base, out / "studies.csv")
    points = studies["point"].nunique()
    print(f"{definition.name}: {points} points of {base.solve.configurations}", flush=True)
    passed = True
    for end, table in tables.items():
        print(f"from the {end} values:", flush=True)
        passed &= report(table, studies, base)
    both = [winners_of(tables[end], base) for end in tables]
    differ = [point for point in both[0] if not agree(both[0][point], both[1].get(point), base)]
    print(f"winners that differ with the start, not tied: {len(differ)} of {len(both[0])} {differ}")
    return passed and not differ


def study_points(definition: SweepDefinition, base: Requirement, path: Path) -> pd.DataFrame:
    """Status and both objectives of every point and configuration, each searched from nothing."""
    first, then = ranking_columns(base.objective)
    known = pd.read_csv(path) if path.exists() else pd.DataFrame({"point": []})
    points = plan_points(definition)
    # In random order, so that an unfinished comparison is a sample.
    for number in np.random.default_rng(0).permutation(len(points)):
        if (known["point"] == number).any():
            continue
        requirement = requirement_at(base, points[number].coordinates)
        rows = [solve_configuration(requirement, configuration).row for configuration in base.configurations]
        found = pd.DataFrame(
            [
                {
                    "point": int(number),
                    "configuration": row.configuration,
                    "status": row.status,
                    first: row.number(first),
                    then: row.number(then),
                }
                for row in rows
            ]
        )
        path.parent.mkdir(parents=True, exist_ok=True)
        found.to_csv(path, mode="a", header=not path.exists(), index=False)
    return pd.read_csv(path)


def report(table: pd.DataFrame, studies: pd.DataFrame, base: Requirement) -> bool:
    """What a sweep has lost against studies, in words."""
    first, _ = ranking_columns(base.objective)
    both = studies.merge(table, on=["point", "configuration"], suffixes=("_of_study", ""))
    feasible = both[both["status_of_study"] == "feasible"]
    lost = feasible[feasible["status"] != "feasible"]
    gained = both[(both["status"] == "feasible") & (both["status_of_study"] != "feasible")]
    found = feasible[feasible["status"] == "feasible"]
    worse = found[first] / found[f"{first}_of_study"] - 1.0
    noticeably, much = (worse > NOTICEABLY).mean(), (worse > MUCH).sum()
    print(
        f"  {len(found)} first objectives: {noticeably:.2%} more than {NOTICEABLY:.1%} worse than a study's, {much} "
        f"more than {MUCH:.0%}; worst {worse.max():+.2e}; {(worse < -NOTICEABLY).mean():.2%} more than "
        f"{NOTICEABLY:.1%} better, best {worse.min():+.2e}"
    )
    print(f"  feasible in the study alone: {list(names(lost))}; in the sweep alone: {len(gained)}")
    swept, studied = winners_of(table, base), winners_of(studies, base)
    other = [point for point in studied if not agree(studied[point], swept.get(point), base)]
    same = sum(studied[point][0] == swept.get(point, ("",))[0] for point in studied)
    print(f"  winners: {same} of {len(studied)} the study's, {len(studied) - same - len(other)} tied, others {other}")
    return bool(noticeably <= MOST_NOTICEABLY_WORSE and not much and lost.empty and not other)


def winners_of(table: pd.DataFrame, base: Requirement) -> dict[int, tuple[str, float]]:
    """The winner of each point, and its first objective."""
    first, then = ranking_columns(base.objective)
    found = {}
    for point, rows in table[table["status"] == "feasible"].groupby("point"):
        best = best_first(list(rows[first]), list(rows[then]), base.objective.tolerance)[0]
        found[int(str(point))] = str(rows["configuration"].iloc[best]), float(rows[first].iloc[best])
    return found


def agree(one: tuple[str, float], other: tuple[str, float] | None, base: Requirement) -> bool:
    """Whether two winners are the same or tied; one that is better than a study's is no loss either."""
    return other is not None and (one[0] == other[0] or other[1] <= one[1] * (1.0 + base.objective.tolerance))


def names(rows: pd.DataFrame) -> Iterator[str]:
    """Point and configuration of each row."""
    return (f"{point} {name}" for point, name in zip(rows["point"], rows["configuration"], strict=True))


if __name__ == "__main__":
    sys.exit(main())
