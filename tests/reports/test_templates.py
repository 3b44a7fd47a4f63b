"""What templates call."""

from pathlib import Path

import pytest

from rockcheck.reports import templates
from rockcheck.validation.finding import Mark, Table, text


@pytest.mark.parametrize(
    ("rows", "kind"),
    [
        ([], "text"),
        ([["a" * 24], [None]], "text"),
        ([["a"], ["a" * 25]], "text long"),
        ([[Mark("a" * 25)]], "text long"),
    ],
)
def test_a_long_text_has_a_wide_column(rows, kind):
    assert templates.text_class(Table("t", [text("words")], rows), 0) == kind


def test_a_library_of_a_page_comes_with_its_licence(tmp_path):
    templates.write_assets(tmp_path)
    names = {path.name for path in (tmp_path / "pages" / "assets").iterdir()}
    assert "LICENSE" not in names
    vendors = [path.parent.name for path in (templates.DATA / "vendor").glob("*/LICENSE")]
    assert vendors
    assert {f"LICENSE.{vendor}.txt" for vendor in vendors} <= names
    assert "models.css" in names


@pytest.mark.parametrize(
    ("folder", "word"), [("runs/a b", "'runs/a b'"), ("/home/me/run", "run"), ("run", "run")]
)
def test_a_command_names_the_folder_as_it_was_given(folder, word):
    assert templates.folder_argument(Path(folder)) == word
