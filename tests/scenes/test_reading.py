"""Files that somebody sent: what is read of them, and what is refused."""

import gzip

import pytest

from rockcheck.scenes import reading


def test_texts_of_json_do_not_steer_a_terminal_and_numbers_stay(written):
    path = written("a.json", b'{"words": "\\u001b[2J red", "number": 3, "list": ["\\u202e", 0.5]}')
    assert reading.read_json(path) == {"words": "?[2J red", "number": 3, "list": ["?", 0.5]}


def test_a_table_has_at_most_a_thousand_columns(written, fault_of):
    row = ",".join("1" * 1000) + "\n"
    assert reading.read_table(written("a.csv", row), header=None).shape == (1, 1000)
    said = str(fault_of(reading.read_table, written("b.csv", row.replace("\n", ",1\n"))))
    assert "line 1: more than 1000 columns" in said


@pytest.mark.parametrize("row", ['"b\n', 'a,"b","c\n'])
def test_a_quotation_mark_is_closed_on_its_line(row, written, fault_of):
    said = str(fault_of(reading.read_table, written("a.csv", "x,y,z\n" + row)))
    assert "line 2: a quotation mark that is not closed" in said


def test_a_quotation_mark_in_a_remark_opens_nothing(written):
    assert len(reading.read_table(written("a.csv", 'x,y\n1,2 # 3" long\n'))) == 1


def test_the_first_lines_are_as_many_as_are_asked_for(written):
    path = written("a.csv.gz", gzip.compress(b"a\r\nb\nc\n"))
    assert reading.first_lines(path, 2)[0] == ["a", "b", ""]


def test_a_line_may_be_as_long_as_a_megabyte(written, fault_of):
    longest = "x" * (reading.MOST_LINE - 1) + "\n"
    assert len(reading.first_lines(written("a.csv", longest), 9)[0][0]) == reading.MOST_LINE - 1
    for read in (lambda path: reading.first_lines(path, 9), reading.read_table):
        assert "line 1: longer than " in str(fault_of(read, written("b.csv", "x" + longest)))


@pytest.mark.parametrize(
    ("content", "latin", "text"),
    [
        (b"M\xe9xico\r\n", True, "M\xe9xico\n"),
        (b"M\xe9xico\n", False, None),
        (b"M\xe9xico\x00\n", True, None),
        ("M\xe9xico\n".encode("utf-16"), True, "M\xe9xico\n"),
        ("M\xe9xico\n".encode("utf-16"), False, None),
        (b"\xef\xbb\xbfM\xc3\xa9xico\r", False, "M\xe9xico\n"),
    ],
)
def test_text_is_utf_8_or_where_it_may_be_latin_1(content, latin, text, written, fault_of):
    path = written("a.txt", content)
    if text is None:
        assert "not a text file" in str(fault_of(reading.read_text, path, latin=latin))
    else:
        assert reading.read_text(path, latin=latin) == text
