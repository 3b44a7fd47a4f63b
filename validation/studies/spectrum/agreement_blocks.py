"""The agreement of other models with spectra, as text, tables and maps.

In: what `agreement.agree` gives. Out: blocks of a finding. Called by the study.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rockcheck.engines import registry
from rockcheck.validation.finding import Block, Column, Plot, Table, Text, text
from rockcheck.validation.paper import Panel
from rockcheck.validation.studies.spectrum.agreement import REFERENCES, Agreement

#: Libraries whose versions stand beside the shares.
LIBRARIES = sorted(facts.distribution for facts in registry.every() if facts.spectrum)
MODEL = Column("model", kind="model")


def agreement_blocks(
    agreement: Agreement, panels: Sequence[Panel], *, came_with_package: bool
) -> Iterator[Block]:
    """The agreement as text, tables and maps; `panels` are those of the maps."""
    yield Text(
        _text(agreement, came_with_package=came_with_package),
        "The same spectra by the other models",
        on="page",
    )
    yield _table_of_shares("agreement", agreement["shares"], [MODEL])
    yield _table_of_shares(
        "agreement-by-spectrum",
        agreement["shares"],
        [text("spectrum"), MODEL],
        title="Spectrum by spectrum",
        on="page",
        folded=True,
    )
    if agreement["maps"]:
        yield _maps(agreement, panels)


def _text(agreement: Agreement, *, came_with_package: bool) -> str:
    """What was compared, when, with which settings and versions."""
    date, versions = agreement["date"], agreement["versions"]
    origin = f"Computed on {date}"
    if came_with_package:
        origin = (
            f"Not computed in this run: it came with the package, from a run on {date} by"
            f" rockcheck {versions.get('rockcheck', '')}. --agreement 200 computes it anew"
        )
    settings = "; ".join(
        f"{model} {_settings_words(chosen)}" for model, chosen in agreement["settings"].items()
    )
    engines = ", ".join(f"{name} {versions[name]}" for name in LIBRARIES if name in versions)
    return f"{agreement['about']} {origin}. Settings: {settings}. {engines}."


def _settings_words(settings: Mapping[str, Any]) -> str:
    return ", ".join(f"{key} {value}" for key, value in settings.items()) or "as it comes"


def _maps(agreement: Agreement, panels: Sequence[Panel]) -> Plot:
    """The maps of all models, a row each."""
    equal = ", ".join(
        f"{drawn['model']} {drawn['equal']} of {drawn['nodes']}"
        for drawn in agreement["maps"]
        if drawn["model"] != "ebm-unilateral"
    )
    tiles = [
        {
            "title": panel.title.replace(", ", "\n") if row == 0 else "",
            "free": panel.wall is None,
            "outcomes": "".join(drawn["outcomes"][panel.name]),
            "place": [row, 1, column],
            "row": drawn["model"],
        }
        for row, drawn in enumerate(agreement["maps"])
        for column, panel in enumerate(panels)
    ]
    size, figure = len(agreement["map_frequencies"]), panels[0].figure
    return Plot(
        "models",
        f"Fig. {figure} by every model" if figure else "By every model",
        kind="spectra",
        note=f"{size} x {size} nodes a spectrum; equal to the unilateral event-based model's:"
        f" {equal}.",
        data={
            "frequencies": agreement["map_frequencies"],
            "amplitudes": agreement["map_amplitudes"],
            "record": panels[0].scene.excitation.kind == "record",
            "panels": tiles,
            "height": 0.4 + 0.92 * len(agreement["maps"]),
        },
    )


def _table_of_shares(name: str, shares: Sequence[Any], by: Sequence[Column], **more: Any) -> Table:
    """The shares of equal outcomes, summed up by some columns."""
    groups: dict[tuple[str, ...], list[Any]] = {}
    for share in shares:
        groups.setdefault(tuple(share[column.name] for column in by), []).append(share)
    columns = [
        Column(f"{side}_{pivot}", f"{side}, {pivot}", kind="percent")
        for pivot in REFERENCES.values()
        for side in ("near", "away")
    ]
    rows = [[*values, *_row_of_shares(group)] for values, group in groups.items()]
    return Table(name, [*by, *columns, Column("nodes"), Column("failed")], rows, **more)


def _row_of_shares(group: Sequence[Any]) -> list[Any]:
    """Equal outcomes against each reference, near and away; nodes; failed ones."""
    equal = [
        _equal_share(group, near, reference) for reference in REFERENCES for near in (True, False)
    ]
    nodes = sum(share["nodes"] for share in group)
    failed = sum(share["failed"] for share in group)
    return [*equal, nodes, failed]


def _equal_share(group: Sequence[Any], near: bool, reference: str) -> float | None:
    """The share of nodes whose outcome is the reference's; None where there are none."""
    compared = [share for share in group if share["near"] == near and reference in share["equal"]]
    nodes = sum(share["nodes"] for share in compared)
    equal = sum(share["equal"][reference] for share in compared)
    return equal / nodes if nodes else None
