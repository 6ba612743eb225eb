"""Decimal text: every number read is the float64 nearest to it, as Python's own float() finds it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patchwright.models import CorruptFile
from patchwright.models.io._text import number_lines, read_numbers

HERE = Path("numbers.txt")


def parse(text: str, **options: str) -> np.ndarray:
    data = np.frombuffer(text.encode(), dtype=np.uint8)
    return read_numbers(HERE, data, **options)[0]


@given(st.lists(st.floats(allow_nan=False), min_size=1, max_size=30))
@settings(max_examples=300, deadline=None)
def test_shortest_decimals_come_back_bit_for_bit(values: list[float]) -> None:
    expected = np.array(values)
    read = parse(" ".join(map(repr, values)))
    assert np.array_equal(read.view(np.int64), expected.view(np.int64))


@given(st.integers(0, 10**25), st.integers(-360, 330), st.sampled_from("eEdD"), st.sampled_from(["", "-", "+"]))
@settings(max_examples=1000, deadline=None)
def test_any_digits_and_any_exponent_round_as_python_does(digits: int, exponent: int, letter: str, sign: str) -> None:
    assert parse(f"{sign}{digits}{letter}{exponent}") == float(f"{sign}{digits}e{exponent}")


@given(st.integers(2**52, 2**53 - 1), st.integers(-60, 400), st.sampled_from([-1, 0, 1]))
@settings(max_examples=500, deadline=None)
def test_numbers_on_and_beside_a_tie_between_two_floats(m: int, power: int, beside: int) -> None:
    # the middle between m·2^p and (m + 1)·2^p, written out in full, and its last digit one more or one less
    twice = 2 * m + 1
    text = str(twice * 2**power) if power >= 0 else f"{twice * 5**-power}e{power}"
    mantissa, _, exponent = text.partition("e")
    word = f"{int(mantissa) + beside}" + (f"e{exponent}" if exponent else "")
    assert parse(word) == float(word)


@pytest.mark.parametrize(
    ("word", "value"),
    [
        ("4.9e-324", 5e-324),
        ("2.4703282292062327e-324", 0.0),
        ("2.4703282292062328e-324", 5e-324),
        ("2.2250738585072011e-308", 2.2250738585072011e-308),
        ("1.7976931348623157e308", 1.7976931348623157e308),
        ("1.7976931348623159e308", np.inf),
        ("9007199254740993", 9007199254740992.0),
        ("0." + "0" * 400 + "1", 0.0),
        ("1" + "0" * 400 + "e-400", 1.0),
        (".5", 0.5),
        ("5.", 5.0),
        ("+1.D+02", 100.0),
        ("-inf", -np.inf),
    ],
)
def test_the_edges_of_the_range(word: str, value: float) -> None:
    assert parse(word) == value


def test_minus_zero_nan_commas_comments_and_repeats() -> None:
    assert np.signbit(parse("-0.0"))[0]
    assert np.isnan(parse("NaN -nan(ind)")).all()
    assert parse("1, 2,3").tolist() == [1.0, 2.0, 3.0]
    assert parse("# 7 8\n1 2 # 3\n4", comment="#").tolist() == [1.0, 2.0, 4.0]
    assert parse("2*0.5 1000*3").tolist() == [0.5] * 2 + [3.0] * 1000


@pytest.mark.parametrize("word", ["1.2.3", "1e", "--1", "0x10", "1_000", "abc", ".", "1e+", "nul\0", "3*"])
def test_a_word_that_is_no_number_is_told_with_its_line(word: str) -> None:
    with pytest.raises(CorruptFile, match="line 3 "):
        parse(f"1.0\n2.0\n{word}\n4.0")


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=3, max_size=30))
@settings(deadline=None)
def test_written_lines_read_back_bit_for_bit(values: list[float]) -> None:
    table = np.array(values[: 3 * (len(values) // 3)]).reshape(-1, 3)
    read = parse(number_lines(table).decode())
    assert np.array_equal(read.view(np.int64), table.ravel().view(np.int64))
