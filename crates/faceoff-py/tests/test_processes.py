"""Threads and processes: a forked process starts its own thread pool."""

import multiprocessing
import os
import sys
import threading
import time
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv

import faceoff
from faceoff.gym import AirHockeyEnv, AirHockeyVectorEnv


def step_five_times(envs: Any) -> np.ndarray:
    """The observations after five steps."""
    for _ in range(5):
        observations, *_ = envs.step(np.full(envs.action_space.shape, 0.5))
    return observations


def make_and_step(_index: int) -> np.ndarray:
    """The work of a process of a pool, which passes its index."""
    envs = AirHockeyVectorEnv(16, "hit", threads=2)
    envs.reset(seed=3)
    return step_five_times(envs)


def run_in_child(work: Any) -> Any:
    """The result of ``work`` in a forked process; an exception is returned as a value."""
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(duplex=False)

    def run() -> None:
        try:
            sender.send(work())
        except BaseException as error:
            sender.send(error)

    child = context.Process(target=run)
    child.start()
    # If the child hangs, the test must fail instead of hanging, too.
    answered = receiver.poll(120)
    if not answered:
        child.kill()
    child.join()
    assert answered, "the forked process hangs"
    return receiver.recv()


@pytest.mark.parametrize("method", ["fork", "forkserver", "spawn"])
def test_environments_work_with_each_start_method(method: str) -> None:
    expected = make_and_step(0)
    with multiprocessing.get_context(method).Pool(2) as pool:
        for result in pool.map_async(make_and_step, range(2)).get(timeout=300):
            np.testing.assert_array_equal(result, expected)


def test_environment_continues_in_a_forked_process() -> None:
    envs = AirHockeyVectorEnv(16, "hit", threads=2)
    envs.reset(seed=3)
    envs.step(np.zeros((16, 7)))
    child_result = run_in_child(lambda: step_five_times(envs))
    np.testing.assert_array_equal(child_result, step_five_times(envs))


def test_forked_process_can_close_an_inherited_environment() -> None:
    envs = AirHockeyVectorEnv(16, "hit", threads=2)
    envs.reset(seed=3)
    envs.step(np.zeros((16, 7)))

    def work() -> str:
        envs.close()
        return "closed"

    assert run_in_child(work) == "closed"
    step_five_times(envs)


def test_step_sent_by_the_parent_is_refused_in_the_child() -> None:
    envs = AirHockeyVectorEnv(16, "hit", threads=2)
    envs.reset(seed=3)
    envs.send(np.zeros((16, 7)))
    error = run_in_child(envs.recv)
    assert isinstance(error, faceoff.OrderError)
    assert "forked" in str(error)
    envs.recv()


def test_async_vector_env_runs_the_environment() -> None:
    # From Python 3.14 on, a worker has not imported `faceoff.gym` by default.
    make = lambda: gymnasium.make("faceoff.gym:faceoff/AirHockey-Defend-v0")  # noqa: E731
    envs: Any = AsyncVectorEnv([make] * 2)
    envs.reset(seed=0)
    observations = step_five_times(envs)
    envs.close()
    single = AirHockeyEnv("defend")
    single.reset(seed=1)
    np.testing.assert_array_equal(step_five_times(single), observations[1])


def test_python_threads_run_during_a_step() -> None:
    envs = AirHockeyVectorEnv(64, "hit", threads=1)
    envs.reset(seed=0)
    done, counted = threading.Event(), [0]

    def count() -> None:
        while not done.is_set():
            counted[0] += 1
            time.sleep(0)

    before = sys.getswitchinterval()
    # With this interval the interpreter's lock is only released explicitly.
    sys.setswitchinterval(1e3)
    counter = threading.Thread(target=count)
    try:
        counter.start()
        start = counted[0]
        for _ in range(1_000):
            envs.step(np.zeros((64, 7)))
            if counted[0] > start:
                break
        assert counted[0] > start
    finally:
        sys.setswitchinterval(before)
        done.set()
        counter.join()


def test_concurrent_calls_are_refused_or_serialised() -> None:
    envs = AirHockeyVectorEnv(64, "hit", threads=2)
    envs.reset(seed=0)
    errors: list[BaseException] = []

    def steps() -> None:
        for _ in range(50):
            try:
                envs.step(np.zeros((64, 7)))
            except BaseException as error:
                errors.append(error)

    threads = [threading.Thread(target=steps) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(isinstance(error, faceoff.OrderError) for error in errors)
    envs.step(np.zeros((64, 7)))


def test_results_do_not_depend_on_the_number_of_threads() -> None:
    results = []
    for threads in (1, 2, 5, os.cpu_count() or 1):
        envs = AirHockeyVectorEnv(37, "prepare", profile="evaluation", threads=threads)
        envs.reset(seed=3)
        results.append(step_five_times(envs))
    for other in results[1:]:
        np.testing.assert_array_equal(results[0], other)
