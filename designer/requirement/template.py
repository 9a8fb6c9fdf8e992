"""The commented requirement that ``designer init`` writes."""

from importlib import resources


def template() -> str:
    """A valid requirement in TOML, each key explained, for a person to change."""
    return resources.files("designer.requirement").joinpath("template.toml").read_text(encoding="utf-8")
