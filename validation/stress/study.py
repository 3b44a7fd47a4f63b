"""`rockcheck stress`: many random runs of every model, what they break, and the smallest scenes that show it."""

from __future__ import annotations

import json
import math
import os
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Literal

from scenes.errors import printable
from validation import provenance
from validation.results import write_whole
from validation.stress.invariants import INVARIANTS
from validation.stress.players import PLAYERS
from validation.stress.shrinking import shrink, write_scene
from validation.stress.stability import AXIS_WORDS, Stability, run_stability
from validation.workers import ONE_THREAD, death, prepare

Progress = Callable[[int, int, str], None]
What = Literal["all", "runs", "maps"]
#: Runs that one task of a worker holds, and how long (s) one of them may take on the average: event-based runs, others.
CHUNK, APPROXIMATE_CHUNK = 250, 20
SECONDS_A_RUN, SECONDS_AN_APPROXIMATE_RUN = 0.2, 2.0
#: How long (s) a task may take in addition, and the first one of a model, which may have to compile.
PATIENCE, COMPILING = 20.0, 600.0
#: Memory that a worker may take, MB.
MEMORY = 2048.0
#: Failures of a model and an invariant of which the smallest scene is sought.
SHRUNK, SHRUNK_QUICK = 3, 1


@dataclass(frozen=True)
class Failure:
    """A run that breaks an invariant; `file` holds the smallest scene that shows it, where that was sought."""

    model: str
    invariant: str
    seed: int
    number: int
    figure: float
    words: str = ""
    file: str = ""


@dataclass(frozen=True, kw_only=True)
class Batch:
    """What some runs of one model showed, one after the other."""

    model: str
    runs: int = 0
    cpu_seconds: float = 0.0
    #: How many runs looked at an invariant; its worst figure, and in which run.
    looked_at: Counter[str] = field(default_factory=Counter)
    worst: dict[str, tuple[float, int]] = field(default_factory=dict)
    failures: tuple[Failure, ...] = ()
    outcomes: Counter[str] = field(default_factory=Counter)
    events: int = 0
    #: Runs in which an impact added energy as its law is known to, and the most that one added.
    gaining: int = 0
    largest_gain: float = 0.0
    #: Runs whose comparison had to be ended by the horizon of predictability.
    horizons: int = 0
    #: Runs that an exception of the model excuses from an invariant, by its name.
    exceptions: Counter[str] = field(default_factory=Counter)

    def __add__(self, other: Batch) -> Batch:
        worst = dict(self.worst)
        for name, found in other.worst.items():
            worst[name] = max(found, worst.get(name, found))
        return Batch(
            model=self.model,
            runs=self.runs + other.runs,
            cpu_seconds=self.cpu_seconds + other.cpu_seconds,
            looked_at=self.looked_at + other.looked_at,
            worst=worst,
            failures=self.failures + other.failures,
            outcomes=self.outcomes + other.outcomes,
            events=self.events + other.events,
            gaining=self.gaining + other.gaining,
            largest_gain=max(self.largest_gain, other.largest_gain),
            horizons=self.horizons + other.horizons,
            exceptions=self.exceptions + other.exceptions,
        )

    def failed(self, invariant: str) -> int:
        """How many runs break it."""
        return sum(failure.invariant == invariant for failure in self.failures)


@dataclass(frozen=True, kw_only=True)
class Stress:
    """What was found, when, with what, on what."""

    suite: str
    created: str
    seed: int
    quick: bool
    jobs: int
    wall_seconds: float
    complete: bool
    versions: dict[str, str]
    hardware: dict[str, str]
    batches: dict[str, Batch]
    stability: Stability | None = None

    @property
    def broken(self) -> list[Failure]:
        """The failures of event-based models, which fail the command."""
        return [failure for label, batch in self.batches.items() if PLAYERS[label].event_based for failure in batch.failures]

    @property
    def failures(self) -> list[Failure]:
        """All failures."""
        return [failure for batch in self.batches.values() for failure in batch.failures]


def play_some(label: str, seed: int, first: int, count: int) -> Batch:
    """Plays runs `first` to `first + count - 1` of a model under a seed."""
    player = PLAYERS[label]
    began = time.process_time()
    looked_at: Counter[str] = Counter()
    outcomes: Counter[str] = Counter()
    exceptions: Counter[str] = Counter()
    worst: dict[str, tuple[float, int]] = {}
    failures: list[Failure] = []
    events = gaining = horizons = 0
    largest_gain = 0.0
    for number in range(first, first + count):
        try:
            played = player.check(player.scene(seed, number), seed, number)
        except Exception as error:  # a fault of the program itself is a failure like any other
            failures.append(Failure(label, "ends", seed, number, math.inf, printable(f"{type(error).__name__}: {error}", 300)))
            continue
        for name, figure in played.figures.items():
            looked_at[name] += 1
            size = math.inf if math.isnan(figure) else figure
            worst[name] = max((size, number), worst.get(name, (size, number)))
        failures += [Failure(label, name, seed, number, played.figures[name], played.failure) for name in played.broken]
        outcomes[played.outcome or "failed"] += 1
        events += played.events
        gaining += played.gains > 0
        largest_gain = max(largest_gain, played.largest_gain)
        horizons += played.horizons
        if played.exception:
            exceptions[played.exception] += 1
    return Batch(
        model=label,
        runs=count,
        cpu_seconds=time.process_time() - began,
        looked_at=looked_at,
        worst=worst,
        failures=tuple(failures),
        outcomes=outcomes,
        events=events,
        gaining=gaining,
        largest_gain=largest_gain,
        horizons=horizons,
        exceptions=exceptions,
    )


@dataclass(frozen=True)
class Chunk:
    """Runs of one model for one worker."""

    label: str
    seed: int
    first: int
    count: int

    @property
    def seconds(self) -> float:
        """How long it may take: far more than it does, and little enough for a hang to be found soon."""
        return PATIENCE + self.count * (SECONDS_A_RUN if PLAYERS[self.label].event_based else SECONDS_AN_APPROXIMATE_RUN)

    @property
    def halves(self) -> list[Chunk]:
        """The same runs as two chunks."""
        half = self.count // 2
        return [Chunk(self.label, self.seed, self.first, half), Chunk(self.label, self.seed, self.first + half, self.count - half)]


def chunks(seed: int, runs: int | None, quick: bool, models: Sequence[str]) -> list[Chunk]:
    """The work, the slowest models first, so that all cores end together."""
    found = []
    for label in models:
        player = PLAYERS[label]
        count = runs or (player.quick if quick else player.runs)
        size = CHUNK if player.event_based else APPROXIMATE_CHUNK
        if quick:
            size = max(10, min(size, count // 4))
        found += [Chunk(label, seed, first, min(size, count - first)) for first in range(0, count, size)]
    return sorted(found, key=lambda chunk: PLAYERS[chunk.label].event_based)


def run_stress(
    what: What = "all",
    *,
    seed: int = 1,
    quick: bool = False,
    runs: int | None = None,
    jobs: int | None = None,
    models: Sequence[str] | None = None,
    folder: Path | None = None,
    progress: Progress = lambda done, of, text: None,
) -> Stress:
    """Plays `runs` scenes with each of the `models` (default: all, as many as `PLAYERS` says) in `jobs` processes (one a core).

    Then ("all", or "maps" alone) it maps where engines and the continuous model break. The smallest scenes of failures go to
    `failures/` in `folder`. Interrupted (Ctrl-C), it gives what was finished till then; `complete` is then false.
    """
    began, jobs = time.monotonic(), jobs or os.cpu_count() or 1
    labels = list(models or PLAYERS) if what != "maps" else []
    work = chunks(seed, runs, quick, labels)
    batches = {label: Batch(model=label) for label in labels}
    total, done, complete = sum(chunk.count for chunk in work), 0, True
    stability: Stability | None = None
    try:
        for batch in _side_by_side(work, jobs):
            batches[batch.model] += batch
            done += batch.runs
            progress(done, total, batch.model)
        if folder is not None:
            progress(done, max(total, 1), "smallest scenes")
            most = SHRUNK_QUICK if quick else SHRUNK
            batches = {label: replace(batch, failures=tuple(_shrunk(batch, folder, most))) for label, batch in batches.items()}
        stability = run_stability(quick=quick, jobs=jobs, progress=progress) if what != "runs" else None
    except KeyboardInterrupt:
        complete = False
    return Stress(
        suite=f"stress{', quick' if quick else ''}",
        created=datetime.now(UTC).isoformat(timespec="seconds"),
        seed=seed,
        quick=quick,
        jobs=jobs,
        wall_seconds=time.monotonic() - began,
        complete=complete,
        versions=provenance.versions(),
        hardware=provenance.hardware(),
        batches=batches,
        stability=stability,
    )


def _side_by_side(work: Sequence[Chunk], jobs: int) -> Iterator[Batch]:
    """Plays chunks in processes. A chunk whose process hangs or dies is halved until the run that did it stands alone."""
    from pebble import ProcessPool

    before = {key: os.environ.get(key) for key in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    waiting = list(reversed(work))
    running: dict[Future[Batch], Chunk] = {}
    started: set[str] = set()
    try:
        with ProcessPool(max_workers=jobs, context=get_context("spawn"), initializer=prepare, initargs=(MEMORY,)) as pool:
            try:
                while waiting or running:
                    while waiting and len(running) < jobs + 1:
                        chunk = waiting.pop()
                        seconds = chunk.seconds + (0.0 if chunk.label in started else COMPILING)
                        arguments = (chunk.label, chunk.seed, chunk.first, chunk.count)
                        running[pool.schedule(play_some, args=arguments, timeout=seconds)] = chunk
                    for future in wait(running, return_when=FIRST_COMPLETED).done:
                        chunk = running.pop(future)
                        fault = _fault(future)
                        if not fault:
                            started.add(chunk.label)
                            yield future.result()
                        elif chunk.count > 1:
                            waiting += chunk.halves
                        else:
                            yield _lost(chunk, fault)
            except BaseException:
                pool.stop()
                raise
    finally:
        for key, value in before.items():
            os.environ.pop(key, None) if value is None else os.environ.update({key: value})


def _fault(future: Future[Batch]) -> str:
    """Why a process gave nothing back; empty where it did."""
    from pebble import ProcessExpired

    error = future.exception()
    if error is None:
        return ""
    if isinstance(error, TimeoutError):
        return "hangs"
    if isinstance(error, ProcessExpired):
        return death(int(error.exitcode or 0))
    return printable(f"{type(error).__name__}: {error}", 300)


def _lost(chunk: Chunk, fault: str) -> Batch:
    failure = Failure(chunk.label, "ends", chunk.seed, chunk.first, math.inf, fault)
    return Batch(model=chunk.label, runs=1, failures=(failure,), outcomes=Counter({"failed": 1}))


def _shrunk(batch: Batch, folder: Path, most: int) -> Iterator[Failure]:
    """The failures, the first few of each invariant with the smallest scene that shows them."""
    sought: Counter[str] = Counter()
    for failure in batch.failures:
        sought[failure.invariant] += 1
        if sought[failure.invariant] > most or (failure.figure == math.inf and failure.invariant == "ends"):
            yield failure
            continue
        yield replace(failure, file=write_smallest(failure, folder))


def write_smallest(failure: Failure, folder: Path) -> str:
    """Shrinks a failing run and writes it to `failures/`; returns the file's name."""
    player = PLAYERS[failure.model]
    name, number, seed = failure.invariant, failure.number, failure.seed
    least = min(failure.figure, 100.0 * INVARIANTS[name].bound) if INVARIANTS[name].bound > 0.0 else 0.0

    def shows(scene: Any) -> bool:
        try:
            played = player.check(scene, seed, number, name)
        except Exception:  # a smaller scene that fails in another way does not show this one
            return False
        return name in played.broken and played.figures[name] >= least

    scene = shrink(player.scene(seed, number), shows)
    file = folder / "failures" / f"{failure.model.replace(' ', '-')}-{name}-{seed}-{number}.toml"
    file.parent.mkdir(exist_ok=True)
    remarks = f"{name}: {INVARIANTS[name].words}\n{printable(failure.words, 200)}".strip()
    write_scene(scene, file, f"{remarks}\nrockcheck simulate {file.name} {player.command(scene, number)}")
    return f"failures/{file.name}"


def summary_rows(found: Stress) -> list[dict[str, Any]]:
    """A row a model and invariant: runs that looked at it, failures, worst figure, its run, and the bound."""
    rows = []
    for label, batch in found.batches.items():
        for name, invariant in INVARIANTS.items():
            if batch.looked_at[name] or batch.failed(name):
                worst, number = batch.worst.get(name, (math.inf, -1))
                failures = batch.failed(name)
                row = {"model": label, "invariant": name, "runs": batch.looked_at[name], "failures": failures}
                rows.append(row | {"worst": worst, "in run": number, "bound": invariant.bound})
    return rows


def invariants_markdown(found: Stress) -> list[str]:
    """The random runs as tables: a row a model, a row an invariant."""
    lines = [
        "| model | runs | failures | events | runs with energy gained in an impact (most) | horizon needed | excepted |",
        "|---|---|---|---|---|---|---|",
    ]
    for label, batch in found.batches.items():
        broken = len({failure.number for failure in batch.failures})
        gains = f"{batch.gaining} ({100.0 * batch.largest_gain:.2g} %)" if batch.gaining else "0"
        excepted = ", ".join(f"{count} {name}" for name, count in batch.exceptions.items()) or "0"
        lines.append(f"| {label} | {batch.runs} | {broken} | {batch.events} | {gains} | {batch.horizons} | {excepted} |")
    lines += ["", "| invariant | bound | " + " | ".join(found.batches) + " |", "|---|---|" + "---|" * len(found.batches)]
    for name, invariant in INVARIANTS.items():
        cells = []
        for batch in found.batches.values():
            if not batch.looked_at[name] and not batch.failed(name):
                cells.append("")
                continue
            worst = batch.worst.get(name, (math.inf, -1))[0]
            failures = batch.failed(name)
            cells.append(f"{worst:.1e}" + (f", **{failures} fail**" if failures else ""))
        lines.append(f"| {invariant.words} | {invariant.bound:g} | " + " | ".join(cells) + " |")
    return lines


def markdown(found: Stress) -> str:
    """The tables of a run for a page of documentation."""
    lines = [f"Seed {found.seed}, {found.wall_seconds / 60.0:.1f} min with {found.jobs} processes; {', '.join(found.hardware.values())}."]
    if found.batches:
        lines += ["", *invariants_markdown(found)]
    if found.stability is not None:
        lines += ["", *stability_markdown(found.stability)]
    return "\n".join(lines) + "\n"


def stability_markdown(found: Stability) -> list[str]:
    """The maps as tables: largest stable step by axis, and what moves that should stand still."""
    lines = []
    labels = list(dict.fromkeys(one.line for one in found.stable))
    for axis, words in AXIS_WORDS.items():
        values = list(dict.fromkeys(one.value for one in found.stable if one.axis == axis))
        lines += [f"| {words} | " + " | ".join(f"{value:g}" for value in values) + " |", "|---|" + "---|" * len(values)]
        for label in labels:
            here = [found.step(label, axis, value) for value in values]
            lines.append(f"| {label} | " + " | ".join(f"{one.step:g} {one.fault}".strip() if one else "" for one in here) + " |")
        lines.append("")
    names = ("creep", "sinking", "rotation", "uplift", "jitter")
    lines += ["| case | model | simulated, s | step, s | " + " | ".join(names) + " |", "|---|---|" + "---|" * (2 + len(names))]
    for one in found.still:
        figures = [f"{getattr(one, name):.1e}" for name in names] if not one.fault else [one.fault, *[""] * (len(names) - 1)]
        lines.append(f"| {one.case} | {one.line} | {one.simulated:g} | {one.step:.2g} | " + " | ".join(figures) + " |")
    return lines


def save(found: Stress, folder: Path) -> None:
    """Writes invariants.csv, failures.csv, summary.md and run.json into a folder."""
    import pandas as pd

    write_whole(folder / "invariants.csv", pd.DataFrame(summary_rows(found)).to_csv(index=False, float_format="%.6g"))
    columns = list(Failure.__dataclass_fields__)
    failures = pd.DataFrame([asdict(failure) for failure in found.failures], columns=columns)
    write_whole(folder / "failures.csv", failures.to_csv(index=False, float_format="%.6g"))
    if found.stability is not None:
        for name, rows in (("stable-steps", found.stability.stable), ("stand-still", found.stability.still)):
            write_whole(folder / f"{name}.csv", pd.DataFrame(list(rows)).to_csv(index=False, float_format="%.6g"))
    write_whole(folder / "summary.md", markdown(found))
    write_whole(folder / "run.json", json.dumps(as_data(found), indent=1) + "\n")


def as_data(found: Stress) -> dict[str, Any]:
    """The whole run as plain data."""
    batches = {label: vars(batch) | {"failures": [asdict(failure) for failure in batch.failures]} for label, batch in found.batches.items()}
    return vars(found) | {"batches": batches, "stability": found.stability and asdict(found.stability)}
