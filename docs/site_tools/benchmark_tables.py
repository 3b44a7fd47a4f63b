"""Reads the tables of docs/benchmark.md, so that other pages' figures can be held against them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

PAGE = Path(__file__).parents[1] / "benchmark.md"


def table(heading: str) -> list[list[str]]:
    """The cells of the first table below a heading, without its head."""
    _, _, below = PAGE.read_text(encoding="utf-8").partition(f"\n## {heading}")
    lines = [line for line in below.split("\n## ")[0].splitlines() if line.startswith("|")]
    return [[cell.strip(" *") for cell in line.strip("|").split("|")] for line in lines[2:]]


def errors_and_cost(line: str) -> tuple[Sequence[float], float]:
    """Of a "model setting": median RMS errors of rotation (alpha), a kind of scene each, and CPU ms
    a simulated second."""
    for model, setting, cost, *errors in table("Median RMS error of"):
        if f"{model} {setting}" == line:
            return [float(error) for error in errors], float(cost)
    raise KeyError(line)


def error_range(lines: Iterable[str]) -> str:
    """The least and the largest error of these lines, as "2e-5 to 4e-3"."""
    errors = [error for line in lines for error in errors_and_cost(line)[0]]
    return " to ".join(f"{error:.0e}".replace("e-0", "e-") for error in (min(errors), max(errors)))


def batch_costs() -> dict[str, dict[str, float]]:
    """CPU microseconds a run, by batch and by tolerance."""
    found: dict[str, dict[str, float]] = {}
    for batch, tolerance, cost, *_ in table("Compiled batches of the event-based model"):
        found.setdefault(batch, {})[tolerance] = float(cost)
    return found
