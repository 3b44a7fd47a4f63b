"""Models that go wrong in every way that a worker must survive, and one that is exact. Copied
beside a test's suite."""

import os
import signal
import time
from typing import Any

import numpy as np

from rockcheck.scenes import Event, Frozen, History, ModelFailure, Scene, observation


class Still(Frozen):
    """A block that stands; `offset` shifts its theta (rad), `files` are its notes.

    STANDS_AT in the environment shifts it, too, as what a model's own files say would.
    """

    offset: float = 0.0
    files: tuple[Any, ...] = ()

    def simulate(self, scene: Scene) -> History:
        state = np.zeros((len(scene.output_times), 6))
        state[:, 1] = scene.block.half_height
        state[:, 2] = self.offset + float(os.environ.get("STANDS_AT", 0.0))
        return observation.observe(scene, "still", state, notes=self.files, settings={"": "a\tb"})


class NotFinite(Frozen):
    end: tuple[str, float] = ("theta", np.nan)  # a channel's last value

    def simulate(self, scene: Scene) -> History:
        history = Still().simulate(scene)
        history.channels[self.end[0]][-1] = self.end[1]
        return history


class Fails(Frozen):
    def simulate(self, scene: Scene) -> History:
        raise ModelFailure("more than 10 events")


class Bug(Frozen):
    def simulate(self, scene: Scene) -> History:
        raise ZeroDivisionError("a bug\nof two lines")


class Segfault(Frozen):
    def simulate(self, scene: Scene) -> History:
        os.kill(os.getpid(), signal.SIGSEGV)
        raise AssertionError


class Hang(Frozen):
    def simulate(self, scene: Scene) -> History:
        while True:
            time.sleep(1.0)


class Hog(Frozen):
    # Asks for 100 MB after 100 MB, at most 8 GB. It writes to none of it: a first write takes a
    # loaded machine seconds.
    def simulate(self, scene: Scene) -> History:
        taken = [np.zeros(100 * 2**17) for _ in range(80)]
        return Still(offset=float(taken[0][0])).simulate(scene)


class Nothing(Frozen):
    def simulate(self, scene: Scene) -> History:
        return None  # type: ignore[return-value]


class Falls(Frozen):
    def simulate(self, scene: Scene) -> History:
        t = scene.output_times
        state = np.zeros((len(t), 6))
        state[:, 1] = scene.block.half_height
        state[:, 2] = np.minimum(t, 2.0)
        return observation.observe(
            scene,
            "falls",
            state,
            events=(Event(t=np.pi / 2, kind="overturned left"),),
            notes=("made to fall",),
        )
