"""The competition's evaluator with a policy in this process."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import numpy as np
import numpy.typing as npt

from faceoff import _native
from faceoff._arguments import (
    ACTION_MODES,
    PROFILES,
    TASKS,
    ActionMode,
    any_seed,
    integer,
    interpolation_code,
    numbers,
    one_of,
    perturbations_json,
    season_seed,
)
from faceoff.errors import ArgumentError, ArgumentTypeError

#: From an observation, (20,) or (23,) float64 as the protocol has it, to an action.
Policy = Callable[[npt.NDArray[np.float64]], Any]

#: As the server's.
MAX_EPISODES = 100_000


def evaluate(
    policy: Policy | Mapping[str, Policy],
    *,
    tasks: str | Sequence[str] = TASKS,
    episodes: int = 100,
    profile: str = "evaluation",
    seed: int | str = 0,
    mismatch_seed: int | str | None = None,
    interpolation: int | None = 1,
    action_mode: ActionMode = "delta",
    clip_actions: bool = False,
    perturbations: Mapping[str, Any] | None = None,
    workers: int = 1,
) -> dict[str, Any]:
    """Plays and scores episodes as ``faceoff eval`` does, without a process for the agent.

    Args:
        policy: from an observation, (20,) or (23,) float64 (docs/protocol.md), to an action; or one for each task. If
            it has a method ``reset(task, episode)``, that is called before each episode.
        tasks: what is played.
        episodes: of each task; those that ``faceoff eval --episodes N --seed S`` plays.
        profile: what perturbs the world.
        seed: a number, or 64 hexadecimal digits.
        mismatch_seed: of the arm's deviation from its model; derived from the seed if left out.
        interpolation, action_mode, clip_actions: as of the environments; ``raw`` actions are what an agent sends. The
            action may have any shape, such as (2, 7), with the right count of numbers.
        perturbations: magnitudes other than the ruleset's.
        workers: processes, started anew (spawn), so that the policy must be one that can be pickled. Results do not
            depend on it.

    Returns:
        What ``faceoff eval`` writes to ``results.json``, with None for computation times, which only an agent has; and
        ``episodes``, a list with the outcome of each. A step after which the world diverged is the agent's fault, and
        ends its episode, as on the server.

    Raises:
        ArgumentError, ArgumentTypeError: for an argument, or for an action that the server would not take.
    """
    names = [tasks] if isinstance(tasks, str) else list(tasks)
    played = [task for task in TASKS if task in [one_of("tasks", name, TASKS) for name in names]]
    if not played:
        raise ArgumentError("tasks: expected hit, defend or prepare, got none")
    policies = _policies(policy, played)
    count = integer("episodes", episodes, 1, MAX_EPISODES)
    setup = _Setup(
        profile=one_of("profile", profile, PROFILES),
        seed=any_seed("seed", seed),
        mismatch_seed=season_seed(mismatch_seed),
        perturbations=_json(perturbations),
        interpolation=interpolation_code(interpolation),
        action_mode=one_of("action_mode", action_mode, ACTION_MODES),
        clip_actions=bool(clip_actions),
    )
    processes = integer("workers", workers, 1, 256)
    evaluation = setup.evaluation()
    jobs = [(task, range(first, count, processes)) for task in played for first in range(processes)]
    outcomes: list[str] = []
    if processes == 1:
        for task, numbers_ in jobs:
            outcomes += _play(evaluation, setup, policies[task], task, numbers_)
    else:
        with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
            shards = [
                pool.submit(_play_elsewhere, setup, policies[task], task, numbers_)
                for task, numbers_ in jobs
                if len(numbers_) > 0
            ]
            for shard in shards:
                outcomes += shard.result()
    result: dict[str, Any] = json.loads(evaluation.score(outcomes))
    for scored in result["tasks"].values():
        scored["computation_time_s"] = None
    told = [json.loads(outcome) for outcome in outcomes]
    for outcome in told:
        outcome["computation_time"] = None
    order = {task: index for index, task in enumerate(TASKS)}
    result["episodes"] = sorted(told, key=lambda one: (order[one["task"]], one["episode"]))
    return result


class _Setup:
    """Checked arguments; other processes get them, too."""

    def __init__(
        self,
        *,
        profile: str,
        seed: str,
        mismatch_seed: str | None,
        perturbations: str,
        interpolation: int | None,
        action_mode: str,
        clip_actions: bool,
    ) -> None:
        self.profile = profile
        self.seed = seed
        self.mismatch_seed = mismatch_seed
        self.perturbations = perturbations
        self.interpolation = interpolation
        self.action_mode = action_mode
        self.clip_actions = clip_actions
        self.action_len = math.prod(_native.action_shape(interpolation))

    def evaluation(self) -> _native.Evaluation:
        return _native.Evaluation(self.profile, self.seed, self.mismatch_seed, self.perturbations)


def _policies(policy: object, tasks: Iterable[str]) -> dict[str, Policy]:
    of_task = policy if isinstance(policy, Mapping) else dict.fromkeys(tasks, policy)
    missing = [task for task in tasks if task not in of_task]
    if missing:
        raise ArgumentError(f"policy: expected one for each task, got none for {missing[0]}")
    for task in tasks:
        if not callable(of_task[task]):
            raise ArgumentTypeError(
                f"policy: expected a function from an observation to an action, got {of_task[task]!r:.80}"
            )
    return dict(of_task)


def _json(perturbations: object) -> str:
    try:
        return json.dumps(perturbations_json(perturbations), allow_nan=False)
    except (TypeError, ValueError) as error:
        raise ArgumentError(f"perturbations: expected finite numbers in mappings, got {error}") from None


def _play_elsewhere(setup: _Setup, policy: Policy, task: str, episodes: range) -> list[str]:
    return _play(setup.evaluation(), setup, policy, task, episodes)


def _play(
    evaluation: _native.Evaluation, setup: _Setup, policy: Policy, task: str, episodes: range
) -> list[str]:
    outcomes = []
    reset = getattr(policy, "reset", None)
    for episode in episodes:
        course = evaluation.begin(
            task, episode, setup.interpolation, setup.action_mode, setup.clip_actions
        )
        if reset is not None:
            reset(task, episode)
        outcome = None
        while outcome is None:
            given = policy(course.observation())
            flat = np.asarray(given).reshape(-1) if np.size(given) == setup.action_len else given
            outcome = course.answer(numbers("action", flat, (setup.action_len,)))
        outcomes.append(outcome)
    return outcomes
