"""Optional parts of the installation: what each extra of ``pyproject.toml`` is needed for, and how to ask for it."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from importlib.util import find_spec
from typing import ParamSpec, TypeVar

from designer.files import InputError

MODULES = {
    "imaging": ("cv2",),
    "report": ("cv2", "matplotlib", "typst"),
    "mesh": ("trimesh", "embreex"),
    "cluster": ("distributed",),
    "compiled": ("numba",),
    "certify": ("numba",),
    "dxf": ("ezdxf",),
    "drawing": ("typst",),
    "notebooks": ("plotly",),
    "parquet": ("pyarrow",),
    "step": ("OCP",),
}
"""The modules that each extra brings, by its name."""
PACKAGES = {"step": "cadquery-ocp-novtk"}
"""What is too large for an extra, 380 MB: a dependency group of ``pyproject.toml``, installed by its package's name."""

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


def is_installed(extra: str) -> bool:
    """Whether all that an extra brings can be imported."""
    return all(find_spec(module) is not None for module in MODULES[extra])


def require_extra(extra: str, purpose: str, otherwise: str = "") -> None:
    """Refuse what cannot be done without an extra.

    Parameters
    ----------
    purpose
        What needs it, as the beginning of a sentence.
    otherwise
        How to do without, as the end of one.

    Raises
    ------
    InputError
        The extra is not installed.
    """
    if not is_installed(extra):
        hint = f"; {otherwise}" if otherwise else ""
        package = PACKAGES.get(extra, f"'catadioptric-designer[{extra}]'")
        raise InputError(f"{purpose} needs more: pip install {package}{hint}")


def needs(extra: str) -> Callable[[Callable[Arguments, Result]], Callable[Arguments, Result]]:
    """Decorate a function, or a command, that cannot do anything without an extra."""

    def decorated(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
        @wraps(function)
        def checked(*arguments: Arguments.args, **named: Arguments.kwargs) -> Result:
            require_extra(extra, function.__name__.replace("_", " "))
            return function(*arguments, **named)

        return checked

    return decorated
