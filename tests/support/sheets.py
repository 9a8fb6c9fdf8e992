"""What a drawing sheet says in words, and a mirror read from them."""

import re

NUMBER = r"([+−]?[\d.]+(?:e[+−]?\d+)?)"


def number_of(words: str) -> float:
    return float(words.replace("−", "-"))


def rebuilt(mirror_sheet: str, assembly: str, name: str) -> dict[str, object]:
    """A mirror as somebody reads it from words alone: its own sheet's and the assembly's."""
    faces = re.search(rf"V\d+ {name}, faces (up|down)", assembly).group(1)
    radius = re.search(rf"vertex radius R\s+(?:{NUMBER} mm|∞)", mirror_sheet).group(1)
    conic = re.search(rf"conic constant K\s+(?:{NUMBER};|none)", mirror_sheet).group(1)
    found = {
        "faces": faces,
        "vertex_mm": re.search(rf"vertex of {name}\s+{NUMBER}", assembly).group(1),
        "inner_radius_mm": re.search(rf"radius of the hole\s+{NUMBER}", mirror_sheet).group(1),
        "outer_radius_mm": re.search(rf"radius of the edge\s+{NUMBER}", mirror_sheet).group(1),
        "thickness_mm": re.search(rf"thickness\s+{NUMBER}\s", mirror_sheet + " ").group(1),
        "conic": conic or "0",
    }
    numbers = {key: value if key == "faces" else number_of(value) for key, value in found.items()}
    # Right on a mirror's sheet is up for a mirror that faces down.
    upwards = 1.0 if faces == "down" else -1.0
    return numbers | {"radius_mm": None if radius is None else upwards * number_of(radius)}


def printed_words(source: str) -> str:
    """Everything that a sheet prints, as one line: the string literals of its source, in order."""
    return " ".join(re.findall(r'"((?:[^"\\]|\\.)*)"', source))
