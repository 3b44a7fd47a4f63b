"""Which files a command knows for its own, and removes."""

import pytest

from rockcheck.reports import manifest


@pytest.fixture
def pages(tmp_path):
    """A folder with two pages and what is known of them."""
    (tmp_path / "pages").mkdir()
    paths = [tmp_path / "index.html", tmp_path / "pages" / "a.html"]
    for path in paths:
        path.write_text(path.name)
    manifest.write(tmp_path, paths, "these histories")
    return tmp_path


def test_what_was_written_is_known_again(pages):
    kept = manifest.read(pages)
    assert kept.made_of == "these histories"
    assert kept.files == {
        "index.html": manifest.hash_of("index.html"),
        "pages/a.html": manifest.hash_of(b"a.html"),
    }
    assert (pages / manifest.MANIFEST).read_text("utf-8").endswith("}\n")


def test_pages_are_whole_until_one_is_changed_or_goes_or_shows_other_things(pages):
    assert manifest.is_whole(pages, "these histories")
    assert not manifest.is_whole(pages, "others")
    (pages / "index.html").write_text("mine")
    assert not manifest.is_whole(pages, "these histories")
    (pages / "index.html").unlink()
    assert not manifest.is_whole(pages, "these histories")


def test_of_a_folder_without_pages_nothing_is_known(tmp_path):
    assert manifest.read(tmp_path) == manifest.Manifest()
    assert not manifest.is_whole(tmp_path, "")


def test_what_nobody_has_changed_is_found_with_its_content(pages):
    files = manifest.read(pages).files
    (pages / "index.html").write_text("mine")
    assert list(manifest.unchanged(pages, files)) == [("pages/a.html", b"a.html")]
    assert list(manifest.unchanged(pages, {"../outside": ""})) == []


def test_what_is_left_over_goes_and_what_is_changed_or_kept_stays(pages):
    files = manifest.read(pages).files
    manifest.remove_left_over(pages, files, kept=["index.html"])
    assert (pages / "index.html").exists()
    assert not (pages / "pages" / "a.html").exists()
    (pages / "index.html").write_text("mine")
    manifest.remove_left_over(pages, files)
    assert (pages / "index.html").exists()


def test_no_file_outside_a_folder_is_removed(pages, tmp_path_factory, fault_of):
    outside = tmp_path_factory.mktemp("outside")
    (outside / "a.html").write_text("a")
    (pages / "link").symlink_to(outside)
    fault_of(manifest.remove, pages, ["link/a.html"])
    assert (outside / "a.html").exists()
