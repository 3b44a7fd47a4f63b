"""Models by name, what a worker makes of them, and the processes that play them."""

import math
import threading
import time
from concurrent.futures import Future
from types import SimpleNamespace

import pytest

from rockcheck import InputError, ModelFailure, MuJoCo, Rest, load_scene
from rockcheck.validation.execute import models, pool
from rockcheck.validation.execute.models import FAMILIES, Work

SCENE = load_scene("bookcase").replace(excitation=Rest(), duration=0.1)


@pytest.fixture
def own(faulty, tmp_path):
    """A model of a user's own, from the folder that it lies in."""
    return lambda name, **settings: Work(
        label="mine", family=f"faulty:{name}", settings=settings, search_path=(str(tmp_path),)
    )


def test_as_many_families_are_listed_as_there_are():
    assert len(list(FAMILIES)) == len(FAMILIES)
    assert {"ebm", "cm", "mujoco", "measured"} <= set(FAMILIES)


def test_an_engine_that_is_not_installed_says_how_it_is(monkeypatch):
    assert models.not_installed("mujoco") == ""
    monkeypatch.setattr(MuJoCo, "installed", classmethod(lambda cls: False))
    assert "mujoco" in models.not_installed("mujoco")
    assert models.not_installed("ebm") == ""


@pytest.mark.parametrize(("step", "code"), [("adaptive", "adaptive"), (1e-3, "")])
def test_adaptive_steps_are_compiled(step, code):
    assert models.compiles("mujoco", {"time_step": step}) == code


def test_a_scene_that_a_model_cannot_play_is_told_before():
    hops = SCENE.replace(initial_height=0.1)
    assert models.unplayable("ebm", {}, SCENE) == ""
    assert "height" in models.unplayable("ebm", {}, hops)
    assert models.unplayable("ebm-unilateral", {}, hops) == ""


def test_a_model_of_a_user_s_own_is_found_in_its_folders_alone(own):
    work = own("Still")
    with pytest.raises(InputError, match="one of your own"):
        models.build(work.family, {})
    assert models.build(work.family, {}, work.search_path).simulate(SCENE).outcome == "at rest"


def test_a_worker_tells_its_own_time(own):
    began = time.perf_counter()
    cost = models.play(own("Still"), SCENE).record["cost"]
    assert 0.0 <= cost["worker_seconds"] <= time.perf_counter() - began


def test_a_history_of_a_user_s_own_model_must_be_readable(own):
    assert models.history_of(own("Still"), SCENE).model == "mine"
    with pytest.raises(ModelFailure, match="cannot be read back"):
        models.history_of(own("NotFinite", end=["t", 0.0]), SCENE)


def test_a_value_that_is_not_finite_is_told_with_its_time(own):
    with pytest.raises(ModelFailure, match=r"theta is nan at t = 0\.1 s"):
        models.history_of(own("NotFinite"), SCENE)


def test_of_a_batch_the_traceback_of_an_exception_is_kept(own):
    still = models.play_batch(own("Still"), [SCENE] * 2)
    assert still.record["outcomes"] == ["at rest"] * 2
    assert still.traceback == ""
    failed = models.play_batch(own("Fails"), [SCENE])
    assert failed.record["peaks"] == [None]
    assert failed.traceback == ""
    assert "ZeroDivisionError" in models.play_batch(own("Bug"), [SCENE]).traceback


# Processes


def test_a_worker_has_one_thread_and_all_else_as_many_as_there_are_cores(monkeypatch):
    monkeypatch.delenv("NUMBA_NUM_THREADS", raising=False)
    monkeypatch.setattr(pool.os, "cpu_count", lambda: 7)
    assert pool.cores() == 7
    monkeypatch.setattr(pool.os, "cpu_count", lambda: None)
    assert pool.cores() == 1
    monkeypatch.setenv("NUMBA_NUM_THREADS", "1")
    monkeypatch.setattr(pool.os, "cpu_count", lambda: 7)
    assert pool.cores() == 1


def test_processes_may_be_started_from_any_thread():
    found = []

    def work():
        with pool.Pool(1) as workers:
            found.extend(ended.outcome for ended in workers.run([pool.Call(math.sqrt, (4.0,))]))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert found == [2.0]


def test_an_exception_ends_the_calls_that_play():
    def interrupted():
        with pool.Pool(2) as workers:
            ends = workers.run([pool.Call(math.sqrt, (4.0,)), pool.Call(time.sleep, (20.0,))])
            raise KeyboardInterrupt(next(ends).outcome)

    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt, match="2"):
        interrupted()
    assert time.monotonic() - began < 10.0


def test_on_a_cluster_what_compiles_goes_to_each_machine_and_all_else_to_one():
    given = []

    def submit(alone, function, arguments, *rest):
        given.append(arguments)
        future = Future()
        future.set_result(function(*arguments))
        return future

    cluster = pool.Cluster("tcp://somewhere:1")
    cluster._pool = SimpleNamespace(
        nthreads=lambda: {"a": 1, "b": 1, "c": 1},
        scheduler_info=lambda n_workers: {
            "workers": {"a": {"host": "one"}, "b": {"host": "one"}, "c": {"host": "two"}}
        },
        get_executor=lambda **where: SimpleNamespace(submit=submit),
    )
    calls = [pool.Call(math.sqrt, (4.0,), compiles="a loop"), pool.Call(math.sqrt, (9.0,))]
    assert [ended.outcome for ended in cluster.run(calls)] == [2.0, 3.0]
    assert given == [(4.0,), (4.0,), (9.0,)]


@pytest.mark.parametrize(("count", "allowed"), [(0, False), (1, True), (256, True), (257, False)])
def test_up_to_256_workers_are_started_here(count, allowed):
    if allowed:
        assert pool.local_workers(f"local:{count}") == count
        return
    with pytest.raises(InputError, match="1 to 256"):
        pool.local_workers(f"local:{count}")
