"""Plain text tables for the terminal."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence


def format_table(header: Sequence[str], rows: Sequence[Sequence[str]], right: Sequence[str] = ()) -> str:
    """Columns as wide as their widest cell under a ruled header; those named in ``right`` are aligned to the right."""
    ruled = ["-" * max(len(cell) for cell in column) for column in zip(header, *rows, strict=True)]
    places = {place for place, name in enumerate(header) if name in right}
    return "\n".join(aligned([header, ruled, *rows], places))


def format_counts(counts: Mapping[str, int]) -> str:
    """How often each name occurs, a line for each, indented."""
    return "\n".join(f"{count:6d}  {name}" for name, count in counts.items())


def aligned(rows: Sequence[Sequence[str]], right: Collection[int] = ()) -> list[str]:
    """Lines of cells in columns as wide as their widest cell; the columns at the places ``right`` end flush."""
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    return ["  ".join(map(_padded, cells, widths, _flush(len(widths), right))).rstrip() for cells in rows]


def _flush(count: int, right: Collection[int]) -> list[bool]:
    return [place in right for place in range(count)]


def _padded(cell: str, width: int, is_right: bool) -> str:
    return cell.rjust(width) if is_right else cell.ljust(width)
