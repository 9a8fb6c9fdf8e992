"""The command line. Everything heavy is imported inside the commands, so that ``designer --help`` is instant."""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType
from typing import Any, NoReturn

import click

from designer.cli.calibrate import calibrate
from designer.cli.certify import certify
from designer.cli.check import check
from designer.cli.compare import compare
from designer.cli.designs import evaluate, trace
from designer.cli.export import export
from designer.cli.listing import configurations
from designer.cli.order import order
from designer.cli.render import render
from designer.cli.requirement import init
from designer.cli.stereo import stereo
from designer.cli.study import report, study
from designer.cli.sweep import sweep
from designer.cli.target import target
from designer.cli.tolerance import tolerance
from designer.cli.view import view
from designer.files import UNUSABLE, InputError, in_words

INPUT_ERROR, FAILURE, INTERRUPTED, TERMINATED = 2, 1, 130, 143


class Terminated(KeyboardInterrupt):
    """The process was asked to end (SIGTERM); cleaned up after like Ctrl-C."""


class OneLineErrors(click.Group):
    """A group whose commands end with one line on stderr, never with a traceback, when what was asked is at fault."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; 2 for input or a place that cannot be used, 1 for a full disk or memory, 130 for Ctrl-C."""
        try:
            return super().invoke(ctx)
        except InputError as error:
            _end(str(error), INPUT_ERROR)
        except Terminated:
            _end("terminated", TERMINATED)
        except KeyboardInterrupt:
            _end("interrupted", INTERRUPTED)
        except BrokenPipeError:
            raise
        except OSError as error:
            if error.errno in UNUSABLE and error.filename is not None:
                _end(f"{error.filename}: cannot be used: {in_words(error)}", INPUT_ERROR)
            _end(str(error), FAILURE)
        except MemoryError:
            _end("out of memory", FAILURE)


@click.group(cls=OneLineErrors, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="catadioptric-designer", prog_name="designer")
def cli() -> None:
    """Design single-camera catadioptric stereo systems: 44 configurations, optimised, traced, ranked."""


for command in (
    study,
    configurations,
    trace,
    evaluate,
    init,
    report,
    view,
    render,
    stereo,
    check,
    export,
    order,
    sweep,
    compare,
    certify,
    tolerance,
    target,
    calibrate,
):
    cli.add_command(command)


def main() -> None:
    """Entry point of the ``designer`` command."""
    owner = os.getpid()

    def terminate(number: int, frame: FrameType | None) -> None:
        if os.getpid() == owner:
            raise Terminated
        # A forked worker inherits this handler, but has nothing of ours to clean up.
        signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)

    signal.signal(signal.SIGTERM, terminate)
    try:
        cli(prog_name="designer")
    except Terminated:
        _end("terminated", TERMINATED)
    except KeyboardInterrupt:
        _end("interrupted", INTERRUPTED)


def _end(message: str, code: int) -> NoReturn:
    click.echo(f"designer: {' '.join(message.split())}", err=True)
    sys.exit(code)
