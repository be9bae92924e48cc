"""Agents of 2023 play on the server: whole bundles by the program, and the adapter message by message."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from agents_2023 import HELLO, LONG_TIME_LIMITS, OBSERVATION, TEAM, answers_of, program
from program import PROGRAM, REPOSITORY

import faceoff
from faceoff.challenge_2023 import Adapter, adapt, install_substitute, make_bundle, play
from faceoff.challenge_2023._kinematics import forward_kinematics, inverse_kinematics, jacobian
from faceoff.challenge_2023._loading import load_builder
from faceoff.challenge_2023._stand_ins import RobotData, RobotModel
from faceoff.dataset import Game
from faceoff.dataset import open as open_recording
from faceoff.kinematics import constraints, forward, model

TASKS = ("hit", "defend", "prepare")

EPISODES = 5
"""Episodes of each task."""

GAIN = 4.0
"""The parameter in the team's agent_config.yml."""


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("converted") / "follower"
    make_bundle(TEAM, folder)
    return folder


@pytest.fixture
def restored_imports(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """After the test, undoes what loading a team's code has changed in this process."""
    path, folder, modules = list(sys.path), os.getcwd(), set(sys.modules)
    yield
    sys.path[:] = path
    os.chdir(folder)
    for name in set(sys.modules) - modules:
        if name.startswith("air_hockey_"):
            del sys.modules[name]


class NativeFollower:
    """What the team's agent computes, as a policy of `faceoff.evaluate`, without env_info and AgentBase."""

    def __init__(self, distance_m: float) -> None:
        self.x = model.BASE_X_M - model.TABLE_LENGTH_M / 2 + distance_m
        self.robot = (RobotModel(), RobotData())

    def reset(self, task: str, episode: int) -> None:
        self.q: Any = None

    def __call__(self, observation: np.ndarray) -> np.ndarray:
        if self.q is None:
            self.q = observation[6:13].copy()
        target = np.array([self.x, np.clip(observation[1], -0.4, 0.4), model.EE_DESIRED_HEIGHT_M])
        here = forward_kinematics(*self.robot, self.q)[0]
        velocity = GAIN * (target - here)
        velocity *= min(1.0, 0.5 / max(np.linalg.norm(velocity), 1e-9))
        rates = np.linalg.pinv(jacobian(*self.robot, self.q)[:3]) @ velocity
        start = self.q + rates * model.CONTROL_STEP_S
        success, q = inverse_kinematics(*self.robot, here + velocity * model.CONTROL_STEP_S, initial_q=start)
        if success and max(constraints(q, rates).worst().values()) < 0.0:
            self.q = q
        else:
            rates = np.zeros(7)
        return np.vstack([self.q, rates])


def test_converted_agent_has_the_outcomes_of_a_native_one(bundle: Path, tmp_path: Path) -> None:
    done = program("eval", bundle, "--episodes", EPISODES, "--seed", 7, "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    converted = json.loads((tmp_path / "results.json").read_text())["tasks"]
    policies = {task: NativeFollower(0.2 if task == "hit" else 0.15) for task in TASKS}
    native = faceoff.evaluate(
        policies, tasks=TASKS, episodes=EPISODES, seed=7, interpolation=3, action_mode="raw", profile="evaluation"
    )["tasks"]
    for task in TASKS:
        for key in ("episodes", "successes", "steps"):
            assert converted[task][key] == native[task][key], (task, key)
        for group in ("ee", "link", "joint_pos", "joint_vel"):
            assert converted[task]["violations"][group] == native[task]["violations"][group] == 0, (task, group)
    assert converted["defend"]["successes"] > 0


def test_converted_agent_plays_both_sides_of_a_game(bundle: Path, tmp_path: Path) -> None:
    done = program("play", bundle, bundle, "--steps", 200, "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    game = open_recording(tmp_path)
    assert isinstance(game, Game)
    guard_x = model.BASE_X_M - model.TABLE_LENGTH_M / 2 + 0.2
    for side in (1, 2):
        result = json.loads((tmp_path / "results.json").read_text())["sides"][side - 1]
        assert result["faults"] == 0 and result["violations"]["ee"] == 0
        # Both guard their own goal, so each took its robot for the one at x < 0.
        mallet = forward(game.rallies[0].to_numpy(side).observations[-1, 6:13])
        assert mallet[0] == pytest.approx(guard_x, abs=0.01)


def test_bundle_plays_in_the_sandbox_of_the_usual_runtime(bundle: Path, tmp_path: Path) -> None:
    target = os.environ.get("TARGET_DIR", str(REPOSITORY / "target"))
    runtimes = subprocess.run(
        [REPOSITORY / "tests" / "runtimes.sh", target], check=True, stdout=subprocess.PIPE, text=True
    )
    folder = Path(runtimes.stdout.rstrip("\n")) / "python3-ml"
    config = tmp_path / "faceoff.toml"
    config.write_text(LONG_TIME_LIMITS.read_text() + f'[runtimes.python3-ml]\nfolder = "{folder}"\n')
    command = [
        PROGRAM,
        "eval",
        bundle,
        "--task",
        "defend",
        "--episodes",
        "2",
        "--config",
        config,
        "--out",
        tmp_path / "out",
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr + done.stdout


def builder(**methods: Any) -> Any:
    kind = type("A", (), {"reset": lambda self: None, **methods})
    return lambda env_info, **kwargs: kind()


@pytest.mark.parametrize(
    ("order", "shape"), [(1, (7,)), (2, (7,)), (3, (2, 7)), (4, (2, 7)), (5, (3, 7)), (-1, (2, 7)), (None, (20, 3, 7))]
)
def test_action_shape_follows_the_interpolation_order(order: int | None, shape: tuple[int, ...]) -> None:
    action = np.arange(np.prod(shape), dtype=np.float32).reshape(shape)
    agent = adapt(builder(draw_action=lambda self, observation: action), {"interpolation_order": order})
    ready, _, act = answers_of(
        agent, HELLO, {"type": "reset", "episode": 0}, {"type": "step", "step": 0, "obs": OBSERVATION}
    )
    assert ready["interpolation"] == order
    assert act["action"] == action.tolist()


def test_surplus_rows_of_an_action_are_cut_off() -> None:
    action = np.arange(21.0).reshape(3, 7)
    agent = adapt(builder(draw_action=lambda self, observation: action))
    answers = answers_of(agent, HELLO, {"type": "step", "step": 0, "obs": OBSERVATION})
    assert answers[-1]["action"] == action[:2].tolist()


@pytest.mark.parametrize("action", [np.zeros(14), np.zeros((2, 6)), np.zeros((1, 7)), None, "up", [[0.0], [1.0, 2.0]]])
def test_wrong_action_is_refused_with_its_shape(action: Any) -> None:
    agent = adapt(builder(draw_action=lambda self, observation: action))
    error = answers_of(agent, HELLO, {"type": "step", "step": 0, "obs": OBSERVATION})[-1]["error"]
    assert "draw_action: expected an array of shape (2, 7) for interpolation order 3, got " in error


def test_agent_gets_arrays_and_episode_starts() -> None:
    calls: list[str] = []

    class Probe:
        preprocessors = [lambda observation: observation + 1.0]

        def reset(self) -> None:
            calls.append("reset")

        def episode_start(self) -> None:
            calls.append("episode_start")
            self.reset()

        def draw_action(self, observation: Any) -> Any:
            assert observation.dtype == np.float64
            np.testing.assert_array_equal(observation, np.array(OBSERVATION) + 1.0)
            return np.zeros((2, 7))

    answers = answers_of(
        adapt(lambda env_info: Probe()),
        HELLO,
        {"type": "reset", "episode": 0},
        {"type": "step", "step": 0, "obs": OBSERVATION},
    )
    assert [answer["type"] for answer in answers] == ["ready", "ready", "act"]
    assert calls == ["episode_start", "reset"]


def test_builder_gets_parameters_but_no_framework_settings() -> None:
    received: dict[str, Any] = {}

    def build_agent(env_info: dict[str, Any], **kwargs: Any) -> Any:
        received[env_info["env_name"]] = kwargs
        return builder(draw_action=None)(env_info)

    config = {"interpolation_order": 5, "n_cores": 4, "env": ["7dof"], "seed": None, "gain": 2.0}
    for task in ("defend", "tournament"):
        answers_of(adapt(build_agent, config), {**HELLO, "task": task})
    assert received == {"7dof-defend": {"gain": 2.0}, "tournament": {"gain": 2.0, "interpolation_order": 5}}


def test_objects_that_are_no_agents_are_refused(tmp_path: Path) -> None:
    for agent, message in [
        (builder(), "build_agent: expected an agent with draw_action, got A; derive its class from AgentBase"),
        (lambda env_info: None, "got NoneType"),
    ]:
        assert message in answers_of(adapt(agent), HELLO)[-1]["error"]
    with pytest.raises(faceoff.ArgumentTypeError, match="build_agent: expected a function of env_info, got 3"):
        adapt(3)  # type: ignore[arg-type]
    with pytest.raises(faceoff.ArgumentTypeError, match="config: expected a mapping of settings, got 'fast'"):
        adapt(builder(), "fast")  # type: ignore[arg-type]
    with pytest.raises(faceoff.ArgumentError, match="interpolation_order: expected one of"):
        adapt(builder(), {"interpolation_order": 0})
    with pytest.raises(
        faceoff.ArgumentError, match="bundle: expected a folder made by python -m faceoff.challenge_2023"
    ):
        play(tmp_path)
    with pytest.raises(faceoff.ArgumentTypeError, match="bundle: expected the path of a folder, got 3"):
        play(3)  # type: ignore[arg-type]
    assert "OrderError: Adapter: expected a class made by adapt" in answers_of(Adapter, HELLO)[-1]["error"]


def test_other_package_of_2023_in_the_process_is_refused(
    restored_imports: None, bundle: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "air_hockey_challenge", type(sys)("air_hockey_challenge"))
    for call in (install_substitute, lambda: load_builder(bundle / "team")):
        with pytest.raises(faceoff.OrderError, match="air_hockey_challenge: expected that it is not imported yet"):
            call()


def test_agent_acts_alike_with_and_without_mujoco(
    restored_imports: None, bundle: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mujoco")
    build_agent = load_builder(bundle / "team")
    messages = [HELLO, {"type": "reset", "episode": 0}]
    messages += [{"type": "step", "step": step, "obs": OBSERVATION} for step in range(20)]
    with_mujoco = answers_of(adapt(build_agent), *messages)
    monkeypatch.setitem(sys.modules, "mujoco", None)
    assert answers_of(adapt(build_agent), *messages) == with_mujoco
    assert len(with_mujoco) == len(messages)
