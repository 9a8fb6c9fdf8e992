"""New DXF documents in mm, and their text: the same for the same content."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def dxf_document() -> Iterator[Any]:
    """A document (R2010) to draw into; :func:`text_of` belongs inside, too."""
    import ezdxf

    # The time of writing and random identifiers would make every file of the same design another one.
    before = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        drawing = ezdxf.new("R2010", setup=["linetypes"], units=ezdxf.units.MM)
        drawing.header["$MEASUREMENT"] = 1
        yield drawing
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before


def text_of(drawing: Any) -> str:
    """The document as a file holds it."""
    stream = io.StringIO()
    drawing.write(stream)
    return stream.getvalue()
