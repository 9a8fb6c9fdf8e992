"""The page: a table of all rows, then for each its source, convergence and command."""

from __future__ import annotations

from validation.row import Row

HEAD = """# Validation

Numbers of others beside ours. `python -m validation` computes our column again and writes this page; it takes
seconds. It never writes theirs: published numbers were typed in, and those of programs pasted from what the modules of
`validation/others/` print, into `validation/theirs/`. `tests/test_validation.py` holds the page to both.

`python -m validation NAME` prints one row. All inputs stand in `validation/`.

| | what | theirs | ours | difference |
|---|---|---|---|---|
"""
CLOSE = """
*Difference* is ours minus theirs; of a bound, whether it is kept.

"""

ELSEWHERE = """## Held by tests

These compare the designer with others, or one part of it with another that shares nothing with it, but are no
single numbers.

| what | with what | test |
|---|---|---|
| the paper's equations (1) to (9), the gain law | proofs by SymPy | `tests/optics/test_equations.py` |
| depth error to first and second order | Monte Carlo through the tracer | `tests/verify/test_montecarlo.py` |
| distances in rendered images | the prediction and ground truth | `tests/imaging/endtoend/` |
| exported systems | optiland, through the full pupil | `tests/export/test_optiland.py` |
| exported scenes | whole images by POV-Ray | `tests/export/test_povray.py` |
| exported solids | Open CASCADE, trimesh | `tests/export/test_step.py`, `tests/export/test_stl.py` |
| 80 optima, and 20 pairs called infeasible | differential evolution | `benchmarks/optimality.py` |
"""


def page(rows: tuple[Row, ...], ours: dict[str, str]) -> str:
    """The whole page, from our digits by key."""
    lines = [
        f"| {number} | {row.quantity} | {_with_unit(row.theirs.digits, row.unit)} | {ours[row.key]} | "
        f"{difference(row, ours[row.key])} |"
        for number, row in enumerate(rows, 1)
    ]
    details = "\n".join(_details(i, row) for i, row in enumerate(rows, 1))
    return f"{HEAD}{chr(10).join(lines)}\n{CLOSE}{details}\n{ELSEWHERE}"


def difference(row: Row, ours: str) -> str:
    """What ours is off by, to the digits that both have."""
    if row.is_bound:
        ends = [float(end) for end in row.theirs.digits.split(" to ")]
        kept = ends[0] <= float(ours) <= ends[1] if len(ends) == 2 else float(ours) <= ends[0]
        return "kept" if kept else "not kept"
    off = float(ours) - float(row.theirs.digits)
    return f"{off:.1e}" if off else "0"


def _with_unit(digits: str, unit: str) -> str:
    return f"{digits} {unit}".strip()


def _details(number: int, row: Row) -> str:
    few = f" Fewer than six digits: {row.few_digits}." if row.few_digits else ""
    how = row.theirs.how
    found = f"`{how}`" if how.startswith("python ") else how
    return (
        f"**{number}. {row.quantity[0].upper()}{row.quantity[1:]}.** Source: {row.theirs.source}. Found by: {found}. "
        f"Ours: {row.convergence}.{few} Again: `python -m validation {row.key}`.\n"
    )
