"""How models and figures look."""

from dataclasses import replace

import pytest

from rockcheck.reports import style
from rockcheck.reports.style import SPARE, STYLE


def test_words_and_lines_have_sizes_for_a_journal_s_page():
    sizes = [value for key, value in STYLE.items() if key.endswith(("font.size", "titlesize"))]
    sizes += [STYLE["axes.labelsize"], STYLE["legend.fontsize"]]
    assert all(6.0 <= size <= 10.0 for size in sizes)
    widths = [value for key, value in STYLE.items() if key.endswith("width")]
    assert all(0.3 <= width <= 1.0 for width in widths)
    assert 3.0 <= STYLE["lines.markersize"] <= 6.0
    assert 2.0 <= STYLE["legend.handlelength"] <= 4.0
    assert STYLE["path.simplify_threshold"] <= 1.0


@pytest.mark.parametrize("look", style.every_look(), ids=lambda look: look.key)
def test_dashes_are_seen_whole_in_a_legend(look):
    """They are told in widths of the line."""
    handle = STYLE["legend.handlelength"] * STYLE["legend.fontsize"] / STYLE["lines.linewidth"]
    assert sum(look.dash) < handle
    assert all(1.0 <= part <= 8.0 for part in look.dash)


def test_no_two_looks_are_drawn_alike():
    drawn = [(look.light, look.dash) for look in style.every_look()]
    assert len(set(drawn)) == len(drawn)


def test_a_look_is_found_by_its_model_or_by_its_key():
    assert style.look_by_key("cm") == style.look_of("cm")
    assert style.look_by_key(SPARE[1].key) == SPARE[1]
    assert style.look_by_key("mine:Model") is None
    assert style.look_of("mine:Model") is None


def test_models_of_ones_own_get_the_spare_looks_in_order():
    looks = style.looks(["mine:A", "cm", "mine:B"])
    assert [look.key for look in looks.values()] == [SPARE[0].key, "cm", SPARE[1].key]
    assert looks["mine:B"].label == "mine:B"
    assert style.label_of("mine:B") == "mine:B"
    assert style.label_of("cm") == "CM"


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (1e-4, "10⁻⁴"),
        (0.01, "10⁻²"),
        (0.1, "0.1"),
        (1.0, "1"),
        (1e3, "1000"),
        (1e4, "10⁴"),
        (0.02, "0.02"),
    ],
)
def test_a_power_of_ten_is_plain_from_a_tenth_to_a_thousand(value, words):
    assert style.power_of_ten(value) == words


def test_a_figure_is_drawn_anew_where_a_model_looks_otherwise(monkeypatch):
    before = style.stamp_of("shown")
    looks = style.every_look()
    monkeypatch.setattr(style, "every_look", lambda: [replace(looks[0], light="#000"), *looks[1:]])
    style.drawn_by.cache_clear()
    after = style.stamp_of("shown")
    style.drawn_by.cache_clear()
    assert after.split()[0] == before.split()[0]
    assert after != before
