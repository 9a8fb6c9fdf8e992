"""``python -m validation``: writes docs/validation.md; with a row's name prints that row."""

from __future__ import annotations

import sys
from pathlib import Path

from designer.files import write_atomically
from validation.page import difference, page
from validation.rows import ROWS

PAGE = Path(__file__).parents[1] / "docs" / "validation.md"


def main(names: list[str]) -> int:
    """Write the page, or print the rows named."""
    by_key = {row.key: row for row in ROWS}
    unknown = [name for name in names if name not in by_key]
    if unknown:
        print(f"unknown row {unknown[0]}; allowed: {', '.join(by_key)}", file=sys.stderr)
        return 2
    ours = {key: format(by_key[key].ours(), by_key[key].format) for key in names or by_key}
    for key, digits in ours.items():
        row = by_key[key]
        print(f"{key}: theirs {row.theirs.digits}, ours {digits}, difference {difference(row, digits)}")
    if not names:
        write_atomically(PAGE, page(ROWS, ours))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
