"""The competition's evaluator with a policy (a function from an observation to an action) in this process."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from faceoff import _native
from faceoff._arguments import (
    ACTION_MODES,
    PROFILES,
    TASKS,
    ActionMode,
    flag,
    integer,
    interpolation_code,
    mismatch_seed_text,
    numbers,
    one_of,
    perturbations_json,
    seed_text,
)
from faceoff._workers import pickle_value, run_in_workers
from faceoff.errors import ArgumentError, ArgumentTypeError

#: From an observation, (20,) or (23,) float64 as the protocol has it, to an action.
Policy = Callable[[npt.NDArray[np.float64]], Any]

#: The server has the same limit.
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
    """Runs and scores episodes as ``faceoff eval`` does, with the policy in this process.

    Args:
        policy: from an observation, (20,) or (23,) float64 (docs/protocol.md), to an action; or a mapping with
            one policy per task. A method ``reset(task, episode)``, if there is one, is called before each episode.
        tasks: one or more of ``hit``, ``defend`` and ``prepare``.
        episodes: number per task; the same episodes as those of ``faceoff eval --episodes N --seed S``.
        profile: name of a set of perturbations, such as ``ideal`` (none) or ``evaluation`` (as on the server).
        seed: a number, or 64 hexadecimal digits.
        mismatch_seed: seed of the arm's deviation from its model; derived from ``seed`` by default.
        interpolation, action_mode, clip_actions: as for the environments; ``raw`` actions are those that an agent
            sends. The action may have any shape with the right count of numbers, such as (2, 7).
        perturbations: magnitudes that replace those of the ruleset.
        workers: number of processes, each with a copy of the policy, which may be defined anywhere. Results depend on it
            only if the policy itself keeps a state from one episode to the next.

    Returns:
        The content of ``results.json`` as ``faceoff eval`` writes it, with None for computation times, which are not
        measured here; and ``episodes``, a list with the outcome of each. A step that makes the world diverge is an
        agent fault and ends the episode, as on the server.

    Raises:
        ArgumentError, ArgumentTypeError: for an invalid argument, or for an action that the server would refuse.
    """
    names = [tasks] if isinstance(tasks, str) else list(tasks)
    selected = [task for task in TASKS if task in [one_of("tasks", name, TASKS) for name in names]]
    if not selected:
        raise ArgumentError("tasks: expected hit, defend or prepare, got none")
    policies = _policies(policy, selected)
    count = integer("episodes", episodes, 1, MAX_EPISODES)
    setup = _Setup(
        profile=one_of("profile", profile, PROFILES),
        seed=seed_text("seed", seed),
        mismatch_seed=mismatch_seed_text(mismatch_seed),
        perturbations=json.dumps(perturbations_json(perturbations)),
        interpolation=interpolation_code(interpolation),
        action_mode=one_of("action_mode", action_mode, ACTION_MODES),
        clip_actions=flag("clip_actions", clip_actions),
    )
    processes = integer("workers", workers, 1, 256)
    evaluation = setup.evaluation()
    outcomes: list[str] = []
    if processes == 1:
        for task in selected:
            outcomes += _run_episodes(evaluation, setup, policies[task], task, range(count))
    else:
        # A policy of all tasks is sent once, so that it remains one object.
        value = pickle_value("policy", policies)
        parts = [[(task, range(first, count, processes)) for task in selected] for first in range(processes)]
        outcomes += run_in_workers(_run_in_process, [(value, (setup, part)) for part in parts if len(part[0][1]) > 0])
    result: dict[str, Any] = json.loads(evaluation.score(outcomes))
    for task_result in result["tasks"].values():
        task_result["computation_time_s"] = None
    parsed = [json.loads(outcome) for outcome in outcomes]
    for outcome in parsed:
        outcome["computation_time"] = None
    position = {task: index for index, task in enumerate(TASKS)}
    result["episodes"] = sorted(parsed, key=lambda outcome: (position[outcome["task"]], outcome["episode"]))
    return result


class _Setup:
    """Checked arguments, picklable for worker processes."""

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
    by_task = policy if isinstance(policy, Mapping) else dict.fromkeys(tasks, policy)
    missing = [task for task in tasks if task not in by_task]
    if missing:
        raise ArgumentError(f"policy: expected one for each task, got none for {missing[0]}")
    for task in tasks:
        if not callable(by_task[task]):
            raise ArgumentTypeError(
                f"policy: expected a function from an observation to an action, got {by_task[task]!r:.80}"
            )
    return dict(by_task)


def _run_in_process(policies: Mapping[str, Policy], setup: _Setup, part: Sequence[tuple[str, range]]) -> list[str]:
    """Runs the part of the evaluation that one worker process gets: tasks, each with numbers of episodes."""
    evaluation = setup.evaluation()
    return [
        outcome
        for task, episodes in part
        for outcome in _run_episodes(evaluation, setup, policies[task], task, episodes)
    ]


def _run_episodes(
    evaluation: _native.Evaluation, setup: _Setup, policy: Policy, task: str, episodes: range
) -> list[str]:
    """Runs episodes of a task; returns the outcome of each as JSON."""
    outcomes = []
    reset = getattr(policy, "reset", None)
    for episode in episodes:
        running = evaluation.begin(
            task, episode, setup.interpolation, setup.action_mode, setup.clip_actions
        )
        if reset is not None:
            reset(task, episode)
        outcome = None
        while outcome is None:
            action = policy(running.observation())
            flat = np.asarray(action).reshape(-1) if np.size(action) == setup.action_len else action
            outcome = running.answer(numbers("action", flat, (setup.action_len,)))
        outcomes.append(outcome)
    return outcomes
