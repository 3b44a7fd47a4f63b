"""Figures and tables of the paper's spectra, of ones that are made up."""

import numpy as np
import pytest

from rockcheck.ebm import Spectrum
from rockcheck.validation.paper import measures, paper_panels, tables
from rockcheck.validation.paper.findings import findings_of
from rockcheck.validation.paper.measures import AreaChange, WallGroup
from rockcheck.validation.paper.sentences import claims_of
from rockcheck.validation.paper.spectra import (
    FRICTIONS,
    PANELS,
    SCANNED_WALLS,
    Paper,
    WallPanel,
    near_one_impact,
)

#: With nodes at all halves of omega_p/p.
FREQUENCIES = np.linspace(0.5, 8.0, 16)
AMPLITUDES = np.linspace(1.0, 12.0, 16)


def spectra(edit=lambda panel, outcomes: None):
    """The 28 spectra, safe in their lower half, but for what `edit` changes."""
    made = []
    for panel in paper_panels():
        outcomes = np.zeros((16, 16), dtype=np.int8)
        outcomes[8:] = 1
        edit(panel, outcomes)
        made.append(
            Spectrum(
                outcomes=outcomes,
                frequency_ratios=FREQUENCIES,
                amplitude_ratios=AMPLITUDES,
                evaluations=256,
                undecided=np.zeros((0, 2), dtype=np.int64),
                scene=panel.scene,
                model=None,
            )
        )
    return made


def test_one_node_saved_and_one_overturned_are_an_exchange():
    def edit(panel, outcomes):
        if panel.name == "figure-8-gap-53-e-0":
            outcomes[8, 0], outcomes[7, 1] = 0, 1

    exchange, *_ = findings_of(Paper(spectra(edit)))
    assert exchange.values["both"] == "1"
    assert exchange.values["all"] == "24"


def test_safe_nodes_above_a_fall_are_told_with_their_frequencies():
    """Of one frequency all nodes above the lowest but one are safe: 14, and 1."""

    def edit(panel, outcomes):
        if panel.name == "figure-8-gap-53-e-0":
            outcomes[1, 5], outcomes[2:, 5] = 1, 0

    *_, stronger = findings_of(Paper(spectra(edit)))
    told = {figure.case: figure.value for figure in stronger.evidence}
    assert told["right wall, 53 mm, e = 0, μ = 0.3"].startswith("14 nodes, at 1 ")
    assert told["no wall, μ 0.3"].startswith("0 nodes, at 0 ")
    assert stronger.values["frequencies"] == "1"


def test_beside_no_safe_area_a_wall_has_no_ratio_but_one():
    assert AreaChange(WallGroup({}), PANELS[0], 0.2, 0.0).ratio == 1.0
    assert AreaChange(WallGroup({}), PANELS[0], 0.2, 0.4).ratio == 0.5


def test_one_impact_is_looked_at_in_the_paper_s_range_and_in_the_next():
    """From 2 to 3 and from 3 to 4, both ends included: three frequencies each of sixteen."""
    everywhere = dict.fromkeys(FRICTIONS, np.ones((16, 16), dtype=bool))
    found = measures.one_impact_nodes(Paper(spectra(), tongues=everywhere))
    assert [(one.low, one.high, one.nodes) for one in found] == [(2, 3, 48), (3, 4, 48)] * 2
    assert [one.is_example for one in found] == [True, False] * 2
    assert [one.made_safe for one in found] == [0.5] * 4


def test_nodes_near_one_impact_end_with_both_ranges():
    free, *_ = spectra(lambda panel, outcomes: outcomes.fill(1))
    _, j = near_one_impact(free)
    assert sorted(set(FREQUENCIES[j])) == [2.0, 2.5, 3.0, 3.5, 4.0]


def test_the_largest_change_is_that_of_one_side_and_one_friction():
    def edit(panel, outcomes):
        if panel.name.startswith("figure-9-gap-103"):
            outcomes[:4] = 1

    paper = Paper(spectra(edit))
    found = {
        (side, friction): measures.largest_change(paper, "gap", side, friction)
        for side in ("left", "right")
        for friction in FRICTIONS
    }
    assert found.pop(("right", 0.6)) == 0.25
    assert set(found.values()) == {0.0}


@pytest.mark.parametrize(("count", "named"), [(3, True), (4, False)])
def test_up_to_three_exceptions_are_named(count, named):
    """Of the smaller gap: beside so many walls of 3 mm fewer nodes are safe than at 53 mm."""
    odd = [panel.name for panel in paper_panels() if "gap-3-" in panel.name][:count]

    def edit(panel, outcomes):
        if panel.wall:
            outcomes[8 - round(30 * panel.wall.gap) :] = 1
        if panel.name in odd:
            outcomes[2:] = 1

    claims = {claim.about["name"]: claim for claim in claims_of(judged(edit))}
    smaller = claims["smaller gap"]
    assert sum(figure.holds is False for figure in smaller.evidence) == count
    assert ("Not so" in smaller.finding) == named


def judged(edit=lambda panel, outcomes: None):
    """The spectra with all that the sentences ask for."""
    nowhere = dict.fromkeys(FRICTIONS, np.zeros((16, 16), dtype=bool))
    least = dict.fromkeys((None, (0.103, 0.0), (0.103, 1.0)), 9.0)
    return Paper(spectra(edit), least, nowhere)


def test_what_is_scanned_are_the_walls_of_those_spectra():
    walls = {panel.name: panel.wall for panel in paper_panels()}
    assert {
        name: walls[name] and (walls[name].gap, walls[name].restitution) for name in SCANNED_WALLS
    } == SCANNED_WALLS


# Tables and figures


@pytest.fixture
def shown():
    """The plots of spectra of which a half is safe; beside the nearest right walls a quarter."""

    def edit(panel, outcomes):
        if panel.wall and (panel.wall.side, panel.wall.gap) == ("right", 0.003):
            outcomes[4:] = 1

    paper = judged(edit)
    blocks = tables.blocks(paper, list(claims_of(paper)))
    return {block.name: block for block in blocks if block.block == "plot"}


def test_safe_areas_are_percent_over_the_gap(shown):
    left, right = shown["safe-areas"].panels
    assert [len(panel.series) for panel in (left, right)] == [6, 6]
    assert {tuple(line.y) for line in left.series} == {(50.0, 50.0, 50.0)}
    walls = [line for line in right.series if "no wall" not in line.label]
    assert {tuple(line.y) for line in walls} == {(25.0, 50.0, 50.0)}
    assert {tuple(line.x) for line in right.series} == {(3.0, 53.0, 103.0)}


def test_the_maps_of_the_findings_stand_side_by_side(shown):
    rows, spans, columns = zip(*(p["place"] for p in shown["findings"].data["panels"]), strict=True)
    assert columns == (0, 1, 2)
    assert set(rows) == {0}
    assert set(spans) == {1}


def test_a_panel_s_figure_is_the_paper_s():
    assert WallPanel("right", 0.6, 53.0, 0.0).figure == 9
