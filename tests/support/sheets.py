"""What a drawing sheet says in words."""

import re


def printed_words(source: str) -> str:
    """Everything that a sheet prints, as one line: the string literals of its source, in order."""
    return " ".join(re.findall(r'"((?:[^"\\]|\\.)*)"', source))
