"""Speed and truth of yields: ``python -m benchmarks.tolerance``.

For sixteen designs of all families: how long 10,000 built sensors take with all merits, and how the yield that first
order predicts compares with the tracer's, at each grade and at the growth that half of its sensors exceed. Written to
``results/tolerance.txt``.
"""

from __future__ import annotations

import json
import os
import platform
import time
from pathlib import Path
from typing import get_args

import click
import numpy as np

from benchmarks.problems import RESULTS, ROOT
from designer.as_built.model import perturbable
from designer.as_built.tolerances import Grade, tolerance_values, tolerances_of_grade
from designer.as_built.yields import FIRST_ORDER_HOLDS, simulate
from designer.design import Design

DESIGNS = ROOT / "tests" / "data" / "sharp_designs.json"
TARGET_SECONDS = 15.0
GROWTH = 0.1


@click.command()
@click.option("--trials", default=10_000, show_default=True, help="Sensors of each design and grade.")
@click.option("--results", type=click.Path(path_type=Path), default=RESULTS / "tolerance.txt", show_default=True)
def main(trials: int, results: Path) -> None:
    """Measure, print, and write."""
    cores = len(os.sched_getaffinity(0))
    lines = [
        f"{platform.machine()}, {cores} cores, Python {platform.python_version()}, NumPy {np.__version__}",
        f"load at the start: {os.getloadavg()[0]:.2f}; {trials} sensors of each design and grade",
        "",
        "seconds, wall (processor); median of the calibrated depth error over the design's;",
        f"yield at a growth of {100.0 * GROWTH:g} %, and at the median growth: tracer (first order)",
    ]
    slowest, worst = 0.0, 0.0
    fails: list[str] = []
    for record in json.loads(DESIGNS.read_text(encoding="utf-8")):
        # The depth error alone is compared: first order knows no blur.
        design = Design.model_validate(record).model_copy(update={"sharpness": None})
        lines += ["", f"{record['requirement']}, {design.configuration}"]
        for grade in get_args(Grade):
            wall, processor = time.perf_counter(), time.process_time()
            model = perturbable(design)
            tolerances = tolerance_values(design, model.parameters, tolerances_of_grade(grade))
            found = simulate(model, tolerances, GROWTH, trials, 0)
            wall, processor = time.perf_counter() - wall, time.process_time() - processor
            growth = found.depth_error_after / model.noise - 1.0
            middle = float(np.median(growth))
            first_order = float(np.mean(found.depth_error_first_order <= (1.0 + middle) * model.noise))
            result = found.result
            slowest = max(slowest, processor)
            worst = max(worst, abs(result.value - result.first_order))
            if abs(0.5 - first_order) > FIRST_ORDER_HOLDS:
                fails.append(f"{record['requirement']}, {design.configuration}, {grade}")
            lines.append(
                f"    {grade:10} {wall:6.2f} ({processor:.2f})   {1.0 + middle:5.2f}   "
                f"{100.0 * result.value:5.1f} % ({100.0 * result.first_order:.1f} %)   "
                f"50.0 % ({100.0 * first_order:.1f} %)"
            )
            click.echo(lines[-1])
    lines += [
        "",
        f"{'pass' if slowest <= TARGET_SECONDS else 'FAIL'}  the slowest, processor time: "
        f"{slowest:.1f} s <= {TARGET_SECONDS:g} s",
        f"{'pass' if worst <= FIRST_ORDER_HOLDS else 'FAIL'}  yield at {100.0 * GROWTH:g} %, largest difference "
        f"of first order: {100.0 * worst:.2f} <= {100.0 * FIRST_ORDER_HOLDS:g} percentage points",
        "first order fails at the median growth, and says so: " + ("; ".join(fails) or "nowhere"),
    ]
    results.parent.mkdir(parents=True, exist_ok=True)
    results.write_text("\n".join(lines) + "\n", encoding="utf-8")
    click.echo("\n".join(lines))


if __name__ == "__main__":
    main()
