"""Does anything better exist? Differential evolution, given many times our time, looks for it.

Tried are every pair of shipped requirement and configuration that is feasible with a first objective above 1.02 of
the closed-form limit, pairs called infeasible, and some called impossible, whose rule the opponent does not know.
Each finished run is written at once; the same command goes on where it was stopped.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

import click
import numpy as np

from benchmarks.evolution import PENALTY_FLOOR, Best, evolve
from benchmarks.problems import RESULTS, SHIPPED, Ours, problems_of, shipped_requirement, solve_afresh

RATIO_WORTH_TRYING = 1.02
SHARE_THAT_COUNTS = 1e-3
# Saying "impossible" takes no time at all; the opponent gets a multiple of what a search would have taken.
LEAST_SECONDS = 0.5
STATUSES = ("feasible", "infeasible", "impossible")
COLUMNS = (
    "requirement",
    "configuration",
    "status",
    "ours",
    "limit_ratio",
    "our_seconds",
    "budget",
    "seed",
    "evolution",
    "violation",
    "percent_better",
    "seconds_given",
    "evaluations",
    "restarts",
    "variant",
    "design",
)
Row = dict[str, str]


@click.command()
@click.option("--budget", default=100.0, show_default=True, help="Processor time of each run, as a multiple of ours.")
@click.option("--seeds", default=3, show_default=True, help="Independent runs of each problem.")
@click.option("--infeasible", default=20, show_default=True, help="How many pairs called infeasible to try.")
@click.option("--impossible", default=10, show_default=True, help="How many pairs called impossible to try.")
@click.option("--kind", "statuses", multiple=True, type=click.Choice(STATUSES), help="Only pairs of this status.")
@click.option("--sample", type=int, help="Only so many pairs of each of the three kinds.")
@click.option("--jobs", default=1, show_default=True, help="Runs at a time; our own times are taken before, alone.")
@click.option("--only", "patterns", multiple=True, help="Only pairs REQUIREMENT/CONFIGURATION that contain this text.")
@click.option("--results", type=click.Path(path_type=Path), default=RESULTS / "optimality.csv", show_default=True)
def main(
    budget: float,
    seeds: int,
    infeasible: int,
    impossible: int,
    statuses: tuple[str, ...],
    sample: int | None,
    jobs: int,
    patterns: tuple[str, ...],
    results: Path,
) -> None:
    """Look for anything better than the designer's optima, and for anything feasible where it says there is none."""
    done = {(row["requirement"], row["configuration"], float(row["budget"]), int(row["seed"])) for row in read(results)}
    everything = [
        solve_afresh(requirement, configuration)
        for requirement in map(shipped_requirement, SHIPPED)
        for configuration in requirement.configurations
        if _is_wanted(f"{requirement.name}/{configuration.name}", patterns)
    ]
    chosen = [
        ours
        for ours in choose(everything, sample, infeasible, impossible)
        if not statuses or ours.result.status in statuses
    ]
    click.echo(f"{len(chosen)} pairs, {seeds} seeds each, {budget:g} times our processor time", err=True)
    wanted = [
        (ours, seed)
        for seed in range(1, seeds + 1)
        for ours in chosen
        if (ours.requirement.name, ours.configuration.name, budget, seed) not in done
    ]
    with ProcessPoolExecutor(jobs) as pool:
        for finished in as_completed([pool.submit(oppose, ours, budget, seed) for ours, seed in wanted]):
            row = finished.result()
            append(results, row)
            click.echo(describe(row), err=True)
    summary = summarise(read(results))
    results.with_suffix(".txt").write_text(summary, encoding="utf-8")
    click.echo(summary)


def choose(everything: list[Ours], sample: int | None, infeasible: int, impossible: int) -> list[Ours]:
    """The pairs to try: of each kind all, or as many as asked, spread evenly over requirements and configurations."""
    worth_trying = [ours for ours in everything if (ours.limit_ratio or 0.0) > RATIO_WORTH_TRYING]
    kinds = [
        (worth_trying, len(worth_trying)),
        ([ours for ours in everything if ours.result.status == "infeasible"], infeasible),
        ([ours for ours in everything if ours.result.status == "impossible"], impossible),
    ]
    chosen: list[Ours] = []
    for pairs, count in kinds:
        count = min(count, len(pairs), len(pairs) if sample is None else sample)
        chosen += [pairs[index] for index in np.unique(np.linspace(0, len(pairs) - 1, count).astype(int))]
    return chosen


def oppose(ours: Ours, budget: float, seed: int) -> Row:
    """Give one pair to differential evolution; its time is shared among the variants."""
    problems = list(problems_of(ours.requirement, ours.configuration))
    seconds = budget * (LEAST_SECONDS if ours.result.status == "impossible" else ours.seconds)
    goal = ours.requirement.objective.minimise
    runs = [evolve(problem, goal, seconds / len(problems), seed) for problem in problems]
    winner = min(range(len(runs)), key=lambda index: runs[index].merit)
    best, problem = runs[winner], problems[winner]
    values = {name: float(value) for name, value in problem.physical(best.scaled).items()}
    value = best.merit if best.is_feasible else None
    better = 100.0 * (1.0 - value / ours.value) if value is not None and ours.value is not None else None
    return {
        "requirement": ours.requirement.name,
        "configuration": ours.configuration.name,
        "status": ours.result.status,
        "ours": _number(ours.value, ".10g"),
        "limit_ratio": _number(ours.limit_ratio, ".5f"),
        "our_seconds": f"{ours.seconds:.3f}",
        "budget": f"{budget:g}",
        "seed": str(seed),
        "evolution": _number(value, ".10g"),
        "violation": _number(_violation(best), ".3g"),
        "percent_better": _number(better, ".6f"),
        "seconds_given": f"{seconds:.1f}",
        "evaluations": str(sum(run.evaluations for run in runs)),
        "restarts": str(sum(run.restarts for run in runs)),
        "variant": problem.variant.label,
        "design": json.dumps(values),
    }


def is_find(row: Row) -> bool:
    """Whether the opponent found what we should have found."""
    if row["status"] != "feasible":
        return bool(row["evolution"])
    return bool(row["percent_better"]) and float(row["percent_better"]) > 100.0 * SHARE_THAT_COUNTS


def describe(row: Row) -> str:
    """One run in one line."""
    pair = f"{row['requirement']}/{row['configuration']} seed {row['seed']}"
    if row["status"] != "feasible":
        found = f"found {row['evolution']}" if row["evolution"] else f"nothing (violation {row['violation']})"
        return f"{'FIND ' if is_find(row) else ''}{pair}: {row['status']}; evolution {found}"
    against = row["evolution"] or f"nothing (violation {row['violation']})"
    percent = f", {float(row['percent_better']):+.4f} % better" if row["percent_better"] else ""
    return f"{'FIND ' if is_find(row) else ''}{pair}: ours {row['ours']}, evolution {against}{percent}"


def summarise(rows: list[Row]) -> str:
    """What all runs so far say, as text."""
    lines = ["Differential evolution against the designer", ""]
    for status in STATUSES:
        of_status = [row for row in rows if row["status"] == status]
        pairs = {(row["requirement"], row["configuration"]) for row in of_status}
        finds = [row for row in of_status if is_find(row)]
        lines.append(f"{status}: {len(pairs)} pairs, {len(of_status)} runs, {len(finds)} finds")
        if status == "feasible" and of_status:
            percents = [float(row["percent_better"]) for row in of_status if row["percent_better"]]
            missed = len(of_status) - len(percents)
            if percents:
                lines.append(
                    f"  evolution is better by at most {max(percents):.4f} % (median {np.median(percents):.4f})"
                )
            lines.append(f"  evolution found nothing feasible in {missed} runs")
        lines += [f"  {describe(row)}" for row in finds]
    budgets = sorted({float(row["budget"]) for row in rows})
    lines += ["", f"processor time as a multiple of ours: {', '.join(f'{budget:g}' for budget in budgets)}"]
    lines.append(f"evaluations in all: {sum(int(row['evaluations']) for row in rows):,}")
    return "\n".join(lines) + "\n"


def read(path: Path) -> list[Row]:
    """The runs written so far."""
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def append(path: Path, row: Row) -> None:
    """Write one run at the end of the file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    is_new = not path.exists()
    with path.open("a", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, COLUMNS)
        if is_new:
            writer.writeheader()
        writer.writerow(row)


def _is_wanted(pair: str, patterns: Iterable[str]) -> bool:
    patterns = tuple(patterns)
    return not patterns or any(pattern in pair for pattern in patterns)


def _violation(best: Best) -> float | None:
    """Sum of the scaled violations of the best design; None if it keeps everything."""
    return None if best.is_feasible else best.merit - PENALTY_FLOOR


def _number(value: float | None, form: str) -> str:
    return "" if value is None else format(value, form)


if __name__ == "__main__":
    main()
