"""The ``designer`` command, also as ``python -m designer``."""

from __future__ import annotations

import sys

INTERRUPTED = 130


def main() -> None:
    """Entry point of the ``designer`` command; Ctrl-C ends it with one line while it is still being imported, too."""
    try:
        from designer.cli import main as run

        run()
    except KeyboardInterrupt:
        sys.stderr.write("designer: interrupted\n")
        sys.exit(INTERRUPTED)


if __name__ == "__main__":
    main()
