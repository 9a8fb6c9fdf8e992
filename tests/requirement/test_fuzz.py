"""Whatever the file holds, reading it gives a requirement or one line, never a traceback."""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from designer.files import InputError
from designer.requirement import Requirement, read_requirement, requirement_to_toml

SAMPLE = (Path(__file__).parent / "sample.toml").read_bytes()
TOKENS = SAMPLE.decode().replace("\n", " \n ").split(" ")
SPARE_TOKENS = ["nan", "-inf", "1e999", "=", "[", "]]", '"', "{", "0x7", "true", "1979-05-27T07:32:00Z", "\n", "#", "."]

fuzz = settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("fuzz") / "asked.toml"


def read_or_refuse(path: Path, content: bytes) -> Requirement | None:
    """The requirement; or None, after making sure that the refusal is one line that names the file."""
    path.write_bytes(content)
    refusal = None
    try:
        asked = read_requirement(path)
    except InputError as error:
        refusal = str(error)
    if refusal is not None:
        assert refusal.startswith(f"{path}: ")
        assert len(refusal.splitlines()) == 1
        errors = 1 + refusal.count("; ")
        assert len(refusal) < len(str(path)) + 400 * errors
        return None
    path.write_text(requirement_to_toml(asked), encoding="utf-8")
    assert read_requirement(path) == asked
    return asked


@fuzz
@given(st.binary(max_size=200))
def test_any_bytes(path: Path, content: bytes) -> None:
    read_or_refuse(path, content)


@fuzz
@given(st.data())
def test_changed_bytes(path: Path, data: st.DataObject) -> None:
    content = bytearray(SAMPLE)
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(content) - 1))
        length = data.draw(st.integers(0, 12))
        content[start : start + length] = data.draw(st.binary(max_size=6))
    read_or_refuse(path, bytes(content))


@fuzz
@given(st.data())
def test_changed_tokens(path: Path, data: st.DataObject) -> None:
    tokens = list(TOKENS)
    for _ in range(data.draw(st.integers(1, 3))):
        place = data.draw(st.integers(0, len(tokens) - 1))
        tokens[place] = data.draw(st.sampled_from(TOKENS + SPARE_TOKENS))
    read_or_refuse(path, " ".join(tokens).encode())


numbers = st.one_of(
    st.floats(),
    st.integers(),
    st.sampled_from([0, -1, 10**300, 10**400, 5e-324, 1.8e308, float("nan"), float("inf"), True]),
)
texts = st.text(st.characters(codec="utf-8"), max_size=8)
values = st.recursive(
    st.one_of(numbers, texts, st.dates(), st.booleans()),
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(texts, inner, max_size=3)),
    max_leaves=6,
)


def places(table: dict[str, Any]) -> Iterator[tuple[dict[str, Any], str]]:
    for key, value in table.items():
        yield table, key
        if isinstance(value, dict):
            yield from places(value)


@fuzz
@given(st.data())
def test_changed_structure(path: Path, data: st.DataObject) -> None:
    content = tomllib.loads(SAMPLE.decode())
    for _ in range(data.draw(st.integers(1, 3))):
        table, key = data.draw(st.sampled_from(list(places(content))))
        change = data.draw(st.sampled_from(["delete", "replace", "number", "range", "add", "wrap"]))
        if change == "delete":
            del table[key]
        elif change == "replace":
            table[key] = data.draw(values)
        elif change == "number":
            table[key] = data.draw(numbers)
        elif change == "range":
            table[key] = data.draw(st.lists(numbers, min_size=2, max_size=2))
        elif change == "add":
            table[data.draw(texts)] = data.draw(values)
        else:
            table[key] = [table[key]]
        if not content:
            break
    read_or_refuse(path, tomli_w.dumps(content).encode())
