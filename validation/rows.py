"""Every row, in the order of the page."""

from validation import programs, published
from validation.row import Row

ROWS: tuple[Row, ...] = (*published.ROWS, *programs.ROWS)
