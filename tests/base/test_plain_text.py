"""Messages: at most 500 characters, no control character, the file and a count of what is cut."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.base.errors import InputError
from clearway.base.plain_text import LONGEST_MESSAGE, make_printable, shorten, some_lines


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("plain, and ümlauts - 雪", "plain, and ümlauts - 雪"),
        ("\x1b[31mred\x07", r"\x1b[31mred\x07"),
        ("a\u202eb\u2028c", r"a\u202eb\u2028c"),
        ("half \ud800 of one", r"half \ud800 of one"),
        ("two\nlines\tand a tab", "two\nlines\tand a tab"),
    ],
)
def test_control_characters_are_told_not_sent(text, told):
    assert make_printable(text) == told


def test_all_problems_at_once_and_the_rest_counted():
    few = InputError("a.csv", ["line 1: bad", "line 2: bad"])
    assert str(few) == "a.csv: line 1: bad\na.csv: line 2: bad"
    many = InputError("a.csv", [f"line {n}: {'bad ' * 10}" for n in range(100)])
    lines = str(many).splitlines()
    assert len(lines) > 5
    assert lines[-1] == f"a.csv: and {100 - len(lines) + 1} more"
    assert len(str(many)) <= LONGEST_MESSAGE
    assert len(many.problems) == 100


@given(st.text(max_size=2000), st.lists(st.text(max_size=1500), min_size=1, max_size=30))
def test_any_error_is_short_and_plain(source, problems):
    told = str(InputError(source, problems))
    assert len(told) <= LONGEST_MESSAGE
    assert make_printable(told) == told


@given(st.text(max_size=3000), st.integers(40, 600))
def test_texts_are_cut_to_a_length(text, length):
    assert len(shorten(text, length)) <= length
    assert len(some_lines(text, length)) <= length
