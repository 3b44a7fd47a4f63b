"""`rockcheck stress`: many random runs of every model, and the smallest scenes that show what they break."""

from __future__ import annotations

import math
import os
import time
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from rockcheck.scenes import Scene
from rockcheck.scenes.errors import printable
from rockcheck.scenes.progress import OnProgress, unheard
from rockcheck.scenes.writing import made
from rockcheck.validation.execute.models import FAMILIES, not_installed
from rockcheck.validation.execute.pool import Call, Pool
from rockcheck.validation.execute.study import header
from rockcheck.validation.stress import stability
from rockcheck.validation.stress.invariants import INVARIANTS, CheckedRun
from rockcheck.validation.stress.players import PLAYERS
from rockcheck.validation.stress.results import Failure, RunTotals, Stress
from rockcheck.validation.stress.shrinking import shrink, write_scene
from rockcheck.validation.stress.tables import save

What = Literal["all", "runs", "maps"]
#: Runs in one task of a worker, and the time (s) that one of them may take on average: event-based runs, others.
CHUNK, APPROXIMATE_CHUNK = 250, 20
SECONDS_A_RUN, SECONDS_AN_APPROXIMATE_RUN = 0.2, 2.0
#: Time (s) that a task may take in addition.
PATIENCE = 20.0
#: Memory that a worker may take, MB.
MEMORY = 2048.0
#: Failures of a model and an invariant that are written as scenes; how long (s) all of them may be shrunk, in a whole run and in a
#: quick one, after the processes have started, and the part of that for one of them. A process whose trial hangs is ended so much later.
MOST_FILES = 20
SHRINKING, SHRINKING_QUICK, ONE_FAILURE = 120.0, 10.0, 0.25
STARTING, HANGING = 10.0, 5.0
#: How often (s) what was found is saved during the runs.
SAVING = 60.0


def _checked(label: str, scene: Scene, seed: int, number: int, only: str = "") -> CheckedRun:
    """What a run shows; a fault of the program itself is a failure like any other."""
    try:
        return PLAYERS[label].check(scene, seed, number, only)
    except Exception as error:  # the other runs go on, and this one is reported with its message
        return CheckedRun(figures={"ends": math.inf}, failure=printable(f"{type(error).__name__}: {error}", 300))


def play_some(label: str, seed: int, first: int, count: int) -> RunTotals:
    """Plays runs `first` to `first + count - 1` of a model under a seed."""
    player = PLAYERS[label]
    began = time.process_time()
    looked_at: Counter[str] = Counter()
    outcomes: Counter[str] = Counter()
    unjudged: Counter[str] = Counter()
    rules: Counter[str] = Counter()
    worst: dict[str, tuple[float, int]] = {}
    failures: list[Failure] = []
    events = gaining = horizons = 0
    largest_gain = 0.0
    for number in range(first, first + count):
        played = _checked(label, player.scene(seed, number), seed, number)
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
        rules.update(played.rules)
        unjudged.update(played.unjudged)
    return RunTotals(
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
        rules=rules,
        unjudged=unjudged,
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


def installed(label: str) -> bool:
    """Whether the model of that player can be played here."""
    return label not in FAMILIES or not not_installed(label)


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
    on_progress: OnProgress = unheard,
) -> Stress:
    """Plays `runs` scenes with each of the `models` (default: all that are installed, as many as `PLAYERS` says) in `jobs`
    processes (one a core).

    Then ("all", or "maps" alone) it maps where engines and the continuous model break. Interrupted (Ctrl-C), it gives what was
    finished till then; `complete` is then false. In `folder` it saves what was found on the way, and the scenes of failures, which
    it shrinks as long as `SHRINKING` says.
    """
    began, jobs = time.monotonic(), jobs or os.cpu_count() or 1
    labels = list(models or filter(installed, PLAYERS)) if what != "maps" else []
    work, maps = chunks(seed, runs, quick, labels), stability.tasks(quick) if what != "runs" else []
    batches = {label: RunTotals(model=label) for label in labels}
    places: dict[int, stability.Still | stability.Stable] = {}

    def found(complete: bool = False) -> Stress:
        return Stress(
            **header("stress", quick=quick, jobs=jobs, began=began),
            seed=seed,
            complete=complete,
            batches=batches,
            stability=stability.stability_of(place for _, place in sorted(places.items())) if places else None,
        )

    def keep() -> None:
        nonlocal batches
        if folder is not None and batches:
            batches = write_failures(batches, folder)
            save(found(), folder)

    try:
        total, done, saved = sum(chunk.count for chunk in work), 0, time.monotonic()
        for batch in _side_by_side(work, jobs):
            batches[batch.model] += batch
            done += batch.runs
            on_progress(done, total, batch.model)
            if folder is not None and time.monotonic() > saved + SAVING:
                save(found(), folder)
                saved = time.monotonic()
    except (KeyboardInterrupt, EOFError):  # Ctrl-C reaches workers, too: one that starts may go first, and its pipe ends
        keep()
        return found()
    keep()
    try:
        if folder is not None:
            _shrink(found().failures, folder, jobs, SHRINKING_QUICK if quick else SHRINKING, on_progress)
        for n, place in stability.play(maps, jobs):
            places[n] = place
            on_progress(len(places), len(maps), f"map of {place.line}")
    except KeyboardInterrupt:
        return found()
    return found(complete=True)


def _side_by_side(work: Sequence[Chunk], jobs: int) -> Iterator[RunTotals]:
    """Plays chunks in processes. A chunk whose process hangs or dies is halved until the run that did it stands alone."""
    if not work:
        return
    waiting = deque(map(_call, work))
    with Pool(jobs, MEMORY) as pool:
        for ended in pool.run(waiting):
            chunk = ended.call.key
            if ended.error is None:
                yield ended.result
            elif chunk.count > 1:
                waiting.extendleft(map(_call, chunk.halves))
            else:
                yield _lost(chunk, ended.fault)


def _call(chunk: Chunk) -> Call:
    return Call(play_some, (chunk.label, chunk.seed, chunk.first, chunk.count), chunk.seconds, chunk.label, chunk)


def _lost(chunk: Chunk, fault: str) -> RunTotals:
    failure = Failure(chunk.label, "ends", chunk.seed, chunk.first, math.inf, fault)
    return RunTotals(model=chunk.label, runs=1, failures=(failure,), outcomes=Counter({"failed": 1}))


def write_failures(batches: dict[str, RunTotals], folder: Path) -> dict[str, RunTotals]:
    """Writes the scenes of the first failures of each model and invariant, as they are, to `failures/`; the batches name them."""
    place = made(folder, "failures")
    for old in place.glob("*.toml"):
        old.unlink()
    kept = {}
    for label, batch in batches.items():
        written: Counter[str] = Counter()
        failures = []
        for failure in sorted(batch.failures, key=lambda one: one.number):
            written[failure.invariant] += 1
            if written[failure.invariant] <= MOST_FILES:
                name = f"{label.replace(' ', '-')}-{failure.invariant}-{failure.seed}-{failure.number}.toml"
                failure = replace(failure, file=f"failures/{name}")
                _write(failure, PLAYERS[label].scene(failure.seed, failure.number), folder, "as it was found: not shrunk in time")
            failures.append(failure)
        kept[label] = replace(batch, failures=tuple(failures))
    return kept


def _write(failure: Failure, scene: Scene, folder: Path, remark: str = "") -> None:
    file = folder / failure.file
    command = f"rockcheck simulate {file.name} {PLAYERS[failure.model].command(scene, failure.number)}"
    words = (f"{failure.invariant}: {INVARIANTS[failure.invariant].words}", printable(failure.words, 200), remark, command)
    write_scene(scene, file, "\n".join(line for line in words if line))


def _shrink(failures: Sequence[Failure], folder: Path, jobs: int, seconds: float, on_progress: OnProgress) -> None:
    """Shrinks the scenes in `failures/` where they stand, in processes, for so long: what is small is there whatever ends it."""
    turns: Counter[tuple[str, str]] = Counter()
    queue = []
    for failure in (one for one in failures if one.file):
        turns[failure.model, failure.invariant] += 1
        queue.append((not PLAYERS[failure.model].event_based, turns[failure.model, failure.invariant], failure))
    if not queue:
        return
    each = ONE_FAILURE * seconds
    ordered = sorted(queue, key=lambda entry: entry[:2])
    with Pool(jobs, MEMORY) as pool:
        calls = deque(Call(shrink_file, (failure, folder, each), each + HANGING) for *_, failure in ordered)
        for done, _ in enumerate(pool.run(calls, until=time.monotonic() + STARTING + seconds), 1):
            on_progress(done, len(ordered), "smallest scenes")


def shrink_file(failure: Failure, folder: Path, seconds: float) -> None:
    """Replaces the scene of a failing run by smaller and smaller ones that fail in the same way, until none is, or time is over."""
    name = failure.invariant
    least = (
        min(failure.figure, 100.0 * INVARIANTS[name].bound) if INVARIANTS[name].bound > 0.0 else failure.figure if name == "ends" else 0.0
    )
    fault = failure.words.partition(":")[0]

    def shows(scene: Scene) -> bool:
        played = _checked(failure.model, scene, failure.seed, failure.number, name)
        if name not in played.broken or not played.figures[name] >= least:
            return False
        return failure.figure < math.inf or played.failure.partition(":")[0] == fault  # of the program: the same one

    def keep(scene: Scene) -> None:
        _write(failure, scene, folder, "not the smallest: time was over before all that is simpler was tried")

    scene = PLAYERS[failure.model].scene(failure.seed, failure.number)
    if shows(scene):
        smallest, complete = shrink(scene, shows, seconds=seconds, smaller=keep)
        if complete:
            _write(failure, smallest, folder)
