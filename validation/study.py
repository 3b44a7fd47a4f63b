"""The shape of every study, and the only runner: tasks, play, gather.

A study lists tasks, plays each of them anywhere, and gathers the records into a `Finding`. The
runner does the rest: it reads results back and keeps them, plays tasks side by side, on a cluster
or in this process, reports progress and an estimate, and turns an error in a task into a `Failure`.
A suite is no study: its tasks are played alike (`play_tasks`), and it makes a `Run` of them.
"""

import json
import math
import os
import time
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field, fields, replace
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel

from rockcheck.scenes import progress, writing
from rockcheck.validation.execute import pool, provenance
from rockcheck.validation.execute.store import RECORDS, Store, adapter_of, name_of
from rockcheck.validation.finding import Finding, Made

FAULTS = "faults"
#: Expected time (s) from which an estimate is announced before the work begins.
LONG = 10.0


@dataclass(frozen=True)
class Task:
    """One piece of a study's work: small, frozen, can be pickled. Equal tasks are one task.

    The fields of this class do not count for equality: `seconds`, the limit of its wall time;
    `expected`, its usual wall time (s); `compiles`, the code that it may have to compile (see
    `execute.pool.Call`); `where` it is played: in a worker; "here", since it has threads of its own
    (a cluster takes it all the same); or "timed", in this process with nothing beside it. What is
    `clocked`, or timed, has a time in its result that counts.
    """

    seconds: float = field(default=math.inf, kw_only=True, compare=False, repr=False)
    expected: float = field(default=0.0, kw_only=True, compare=False, repr=False)
    compiles: str = field(default="", kw_only=True, compare=False, repr=False)
    where: Literal["worker", "here", "timed"] = field(
        default="worker", kw_only=True, compare=False, repr=False
    )
    clocked: bool = field(default=False, kw_only=True, compare=False, repr=False)

    @property
    def label(self) -> str:
        """A few words for progress and failures."""
        return ", ".join(
            f"{v:g}" if isinstance(v, float) else str(v) for v in self.fields().values()
        )

    def fields(self) -> dict[str, Any]:
        """The fields that identify the task."""
        return {one.name: getattr(self, one.name) for one in fields(self) if one.compare}

    def depends(self) -> Any:
        """All that the result depends on, as JSON.

        By default the fields, the code that its module can call, that of all models included, all
        libraries, and, where a time counts, the machine.
        """
        return {
            "task": self.fields(),
            "code": provenance.code_digest(type(self).__module__),
            "versions": provenance.versions(),
            "machine": provenance.hardware() if self.clocked or self.where == "timed" else None,
        }

    @cached_property
    def key(self) -> str:
        """Hash of what it depends on."""
        said = type(self).__qualname__, self.depends()
        return provenance.digest(json.dumps(said, sort_keys=True, default=_plain))

    @cached_property
    def kept_as(self) -> str:
        """The name of its kept record."""
        return name_of(type(self).__qualname__, self.key)


def _plain(value: object) -> Any:
    # a scene's own words leave the samples of its record out
    return value.model_dump(mode="json") if isinstance(value, BaseModel) else str(value)


class TaskSource(ABC):
    """What is played: tasks, and how their records are found and kept in a store.

    `memory_mb` limits a worker. `done` maps each task that has ended to its record, or to its
    `Failure`.
    """

    name: str
    memory_mb: float | None = None
    #: Kinds of results that its folder keeps; see `execute.store`.
    kinds: tuple[str, ...] = (RECORDS,)

    @abstractmethod
    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Any]:
        """All tasks known so far, given those `done`; called again whenever all have ended."""

    @staticmethod
    def play(task: Any) -> Any:
        """The record of a task, in whatever process; by default the task plays itself."""
        return task.play()

    @abstractmethod
    def find(self, store: Store, task: Any) -> Any:
        """The kept record of a task, None if there is none that fits."""

    @abstractmethod
    def keep(self, store: Store, task: Any, record: Any) -> None:
        """Keep the record of a task."""

    def on_end(self, task: Any, outcome: Any) -> None:  # noqa: B027 (most do nothing)
        """Hear that a task has ended, or was read back, with its record or `Failure`."""


class Study(TaskSource):
    """A study: its tasks are played, and `gather` makes a finding of the records.

    `record` is the type of its results, a dataclass or a `Stored` model.
    """

    record: Any

    @abstractmethod
    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """The finding of the records; a task that there was no time for is missing in `done`."""

    def find(self, store: Store, task: Task) -> Any:
        """The kept record of a task; None if there is none, or its fields do not fit."""
        with suppress(KeyError, ValueError):
            found = store.get(RECORDS, task.kept_as) or {}
            return adapter_of(self.record).validate_python(found["record"])
        return None

    def keep(self, store: Store, task: Task, record: Any) -> None:
        """Keep the record of a task."""
        store.put(
            RECORDS,
            task.kept_as,
            {"record": adapter_of(self.record).dump_python(record, mode="json")},
        )


def run(
    study: Study,
    folder: Path,
    *,
    jobs: int | None = None,
    scheduler: str | None = None,
    force: bool = False,
    minutes: float | None = None,
    on_progress: progress.OnProgress = progress.unheard,
) -> Finding:
    """Play what is not up to date in `folder`, keep each record as it comes, and gather.

    `jobs` processes (default: one a core; 0: in this one), no more than there is work for, or the
    Dask cluster at `scheduler`. Tasks that have not begun after `minutes` are left out. Ctrl-C ends
    the tasks, and what was played is gathered; the exit code is then `INTERRUPTED`, unless the
    finding has another. Raises `InputError` where the folder cannot be used or no cluster answers.
    """
    began = time.monotonic()
    played = play_tasks(
        study,
        folder,
        jobs=jobs,
        scheduler=scheduler,
        force=force,
        minutes=minutes,
        on_progress=on_progress,
    )
    finding = study.gather(played.done)
    Store(folder, study.kinds).prune()
    failures = {
        task.label: outcome.reason
        for task, outcome in played.done.items()
        if isinstance(outcome, pool.Failure)
    }
    interrupted = progress.INTERRUPTED if played.interrupted else 0
    return replace(
        finding,
        failures={**failures, **finding.failures},
        verdict=finding.verdict if played.complete or finding.verdict != "pass" else "incomplete",
        exit_code=finding.exit_code or interrupted,
        complete=played.complete and finding.complete,
        made=Made(
            created=datetime.now(UTC).isoformat(timespec="seconds"),
            jobs=played.jobs,
            wall_seconds=time.monotonic() - began,
            versions=provenance.versions(),
            hardware=provenance.hardware(),
        ),
    )


@dataclass(frozen=True)
class PlayedTasks:
    """The tasks that have ended, in the order of their source, with their records or failures.

    `complete` is False where some were left out, or it was `interrupted`; `jobs` is the number of
    processes.
    """

    done: Mapping[Any, Any]
    complete: bool
    interrupted: bool
    jobs: int


def play_tasks(
    source: TaskSource,
    folder: Path,
    *,
    jobs: int | None = None,
    scheduler: str | None = None,
    force: bool = False,
    minutes: float | None = None,
    on_progress: progress.OnProgress = progress.unheard,
) -> PlayedTasks:
    """Play what is not up to date in `folder`, and keep each record as it comes; see `run`."""
    provenance.read_code_again()
    if scheduler is not None and not pool.local_workers(scheduler):
        with pool.connected(scheduler):  # raises where none answers
            pass
    jobs = os.cpu_count() or 1 if jobs is None else jobs
    until = time.monotonic() + 60.0 * minutes if minutes else math.inf
    going = _Run(source, folder, jobs, scheduler, force, on_progress)
    interrupted = False
    with going.stack, progress.within(pool.THREADS, jobs):
        try:
            going.play(until)
        except KeyboardInterrupt:
            interrupted = True
    complete = not interrupted and len(going.done) == len(going.known)
    if minutes and not (interrupted or complete):
        progress.announce(f"{source.name}: its {minutes:g} minutes are over")
    # In the order of the tasks: a finding must not depend on which ended first.
    done = {task: going.done[task] for task in going.known if task in going.done}
    return PlayedTasks(done, complete, interrupted, jobs)


class _Run:
    def __init__(
        self,
        source: TaskSource,
        folder: Path,
        jobs: int,
        scheduler: str | None,
        force: bool,
        heard: progress.OnProgress,
    ) -> None:
        self.source, self.folder, self.jobs, self.scheduler = source, folder, jobs, scheduler
        self.force, self.heard = force, heard
        self.store = Store(folder, source.kinds)
        self.known: dict[Task, None] = {}
        self.done: dict[Task, Any] = {}
        self.stack = ExitStack()
        self._workers: pool.Pool | None = None
        #: `Task.where` of the tasks that workers play.
        self.elsewhere = (
            ("worker", "here") if scheduler is not None else ("worker",) if jobs > 0 else ()
        )

    def _workers_for(self, tasks: int) -> pool.Pool:
        """The processes of this run: as many as asked for, if there are tasks, or cores, for them.

        Tasks of a later wave are played by those that are there.
        """
        if self._workers is None:
            jobs = min(self.jobs, max(tasks, os.cpu_count() or 1))
            memory = self.source.memory_mb
            self._workers = self.stack.enter_context(
                pool.Pool(jobs, memory)
                if self.scheduler is None
                else pool.Cluster(self.scheduler, memory)
            )
        return self._workers

    def play(self, until: float) -> None:
        """Waves of tasks, until the study has no more."""
        while waiting := self._next():
            self._estimate(waiting)
            calls: list[pool.Call] = []
            for task in waiting:
                if task.where in self.elsewhere:
                    calls.append(
                        pool.Call(
                            pool.guarded,
                            (self.source.play, task),
                            task.seconds,
                            task.compiles,
                            task,
                        )
                    )
                elif time.monotonic() < until:
                    self.heard(len(self.done), len(self.known), task.label)
                    self._end(task, pool.guarded(self.source.play, task))
            if calls:
                workers = self._workers_for(len(calls))
                ends = workers.run(calls, until=until, on_playing=self._hear_playing)
                for ended in ends:
                    self._end(ended.call.key, ended.outcome)
            if len(self.done) < len(self.known):  # the time is over
                return

    def _next(self) -> list[Task]:
        while new := [
            task for task in dict.fromkeys(self.source.tasks(self.done)) if task not in self.known
        ]:
            self.known.update(dict.fromkeys(new))
            for task in new:
                if not self.force and (record := self.source.find(self.store, task)) is not None:
                    self.done[task] = record
            self.heard(len(self.done), len(self.known), f"{len(self.done)} up to date")
            for task in new:
                if task in self.done:
                    self.source.on_end(task, self.done[task])
            if waiting := [task for task in new if task not in self.done]:
                return waiting
        return []

    def _hear_playing(self, calls: Sequence[pool.Call]) -> None:
        """Tell the progress what plays, so that what takes long, or hangs, is known by name."""
        if calls:
            labels = [call.key.label for call in calls]
            self.heard(len(self.done), len(self.known), " and ".join(labels))

    def _end(self, task: Task, result: Any) -> None:
        self.done[task] = result
        if traceback := getattr(result, "traceback", ""):  # a result may have one, too
            writing.write_whole(
                writing.made(self.folder, FAULTS) / f"{task.kept_as}.txt",
                traceback.encode(errors="backslashreplace"),
            )
        if not isinstance(result, pool.Failure):
            self.source.keep(self.store, task, result)
        self.source.on_end(task, result)
        self.heard(len(self.done), len(self.known), task.label)

    def _estimate(self, waiting: Sequence[Task]) -> None:
        seconds = sum(
            task.expected / (max(1, self.jobs) if task.where == "worker" else 1) for task in waiting
        )
        if seconds >= LONG:
            progress.announce(
                f"{self.source.name}: {len(waiting)} tasks, about "
                + (f"{seconds:.0f} s" if seconds < 100.0 else f"{seconds / 60.0:.0f} min")
            )
