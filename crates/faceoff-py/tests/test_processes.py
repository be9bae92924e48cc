"""Threads and processes: a pool of threads is not inherited."""

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


def step_some(envs: Any) -> np.ndarray:
    for _ in range(5):
        observations, *_ = envs.step(np.full(envs.action_space.shape, 0.5))
    return observations


def make_and_step(_: int) -> np.ndarray:
    envs = AirHockeyVectorEnv(16, "hit", threads=2)
    envs.reset(seed=3)
    return step_some(envs)


def in_child(work: Any) -> Any:
    """What ``work`` returns in a process forked from this one; what it raises is returned."""
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(duplex=False)

    def run() -> None:
        try:
            sender.send(work())
        except BaseException as error:
            sender.send(error)

    child = context.Process(target=run)
    child.start()
    # A child that hangs is a failure, whose test must not hang with it.
    answered = receiver.poll(120)
    if not answered:
        child.kill()
    child.join()
    assert answered, "the forked process hangs"
    return receiver.recv()


@pytest.mark.parametrize("method", ["fork", "forkserver", "spawn"])
def test_every_way_to_start_a_process(method: str) -> None:
    expected = make_and_step(0)
    with multiprocessing.get_context(method).Pool(2) as pool:
        for result in pool.map_async(make_and_step, range(2)).get(timeout=300):
            np.testing.assert_array_equal(result, expected)


def test_an_environment_goes_on_in_a_forked_process_with_threads_of_its_own() -> None:
    envs = AirHockeyVectorEnv(16, "hit", threads=2)
    envs.reset(seed=3)
    envs.step(np.zeros((16, 7)))
    theirs = in_child(lambda: step_some(envs))
    np.testing.assert_array_equal(theirs, step_some(envs))


def test_a_forked_process_may_drop_and_close_what_it_inherited() -> None:
    envs = AirHockeyVectorEnv(16, "hit", threads=2)
    envs.reset(seed=3)
    envs.step(np.zeros((16, 7)))

    def work() -> str:
        envs.close()
        return "closed"

    assert in_child(work) == "closed"
    step_some(envs)


def test_a_step_that_the_parent_sent_is_not_waited_for() -> None:
    envs = AirHockeyVectorEnv(16, "hit", threads=2)
    envs.reset(seed=3)
    envs.send(np.zeros((16, 7)))
    error = in_child(envs.recv)
    assert isinstance(error, faceoff.OrderError)
    assert "forked" in str(error)
    envs.recv()


def test_gymnasiums_own_processes_take_the_environment() -> None:
    make = lambda: gymnasium.make("faceoff/AirHockey-Defend-v0")  # noqa: E731
    envs: Any = AsyncVectorEnv([make] * 2)
    envs.reset(seed=0)
    observations = step_some(envs)
    envs.close()
    single = AirHockeyEnv("defend")
    single.reset(seed=1)
    np.testing.assert_array_equal(step_some(single), observations[1])


def test_other_threads_of_python_run_while_a_step_does() -> None:
    envs = AirHockeyVectorEnv(64, "hit", threads=1)
    envs.reset(seed=0)
    done, counted = threading.Event(), [0]

    def count() -> None:
        while not done.is_set():
            counted[0] += 1
            time.sleep(0)

    before = sys.getswitchinterval()
    # From now on nobody gets the interpreter who is not given it.
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


def test_two_calls_at_once_are_refused_or_follow_each_other() -> None:
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
    seen = []
    for threads in (1, 2, 5, os.cpu_count() or 1):
        envs = AirHockeyVectorEnv(37, "prepare", profile="evaluation", threads=threads)
        envs.reset(seed=3)
        seen.append(step_some(envs))
    for other in seen[1:]:
        np.testing.assert_array_equal(seen[0], other)
