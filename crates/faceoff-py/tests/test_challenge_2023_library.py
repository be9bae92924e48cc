"""The substitute of `air_hockey_challenge`: its modules, env_info and AgentBase."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from agents_2023 import AWAY, ENV, HOME, ROBOT, TEAM
from program import REPOSITORY

import faceoff
from faceoff import kinematics
from faceoff.challenge_2023 import StandInError, _unavailable, env_info
from faceoff.challenge_2023._agent_base import AgentBase
from faceoff.challenge_2023._loading import SUBSTITUTE
from faceoff.challenge_2023._stand_ins import Box, MDPInfo, RobotModel
from faceoff.errors import MissingError
from faceoff.kinematics import model


@pytest.fixture
def info(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """`env_info` of defend on a machine without MuJoCo."""
    monkeypatch.setitem(sys.modules, "mujoco", None)
    return env_info("defend", 1, ENV)


def env_with_opponent(agent_id: int) -> dict[str, Any]:
    env = copy.deepcopy(ENV)
    own_first = (HOME, AWAY) if agent_id == 1 else (AWAY, HOME)
    env["robot"]["base_frame"] = [frame.tolist() for frame in own_first]
    return {**env, "n_agents": 2, "opponent_ee_ids": [20, 21, 22], "episode_steps": 45000}


def test_env_info_has_the_keys_of_2023(info: dict[str, Any]) -> None:
    assert set(info) == {
        "table", "puck", "mallet", "n_agents", "robot", "puck_pos_ids", "puck_vel_ids", "joint_pos_ids",
        "joint_vel_ids", "opponent_ee_ids", "dt", "rl_info", "constraints", "env_name",
    }  # fmt: skip
    assert set(info["robot"]) == {
        "n_joints", "ee_desired_height", "joint_vel_limit", "joint_acc_limit", "joint_pos_limit", "base_frame",
        "universal_height", "control_frequency", "robot_model", "robot_data",
    }  # fmt: skip
    for key in ("table", "puck", "mallet", "n_agents", "puck_pos_ids", "joint_vel_ids", "opponent_ee_ids", "dt"):
        assert info[key] == ENV[key], key
    assert info["env_name"] == "7dof-defend"
    robot = info["robot"]
    assert robot["control_frequency"] == 50 and isinstance(robot["control_frequency"], int)
    np.testing.assert_array_equal(robot["joint_pos_limit"][1], model.POSITION_LIMIT_RAD)
    np.testing.assert_array_equal(robot["joint_vel_limit"], ENV["robot"]["joint_vel_limit"])
    np.testing.assert_array_equal(robot["base_frame"], [HOME])


def test_rl_info_describes_the_spaces_of_2023(info: dict[str, Any]) -> None:
    rl = info["rl_info"]
    assert (rl.observation_space.shape, rl.action_space.shape, rl.gamma, rl.horizon) == ((20,), (7,), 0.99, 500)
    assert rl.shape == rl.size == (20, 7)
    np.testing.assert_array_equal(rl.observation_space.high[6:13], model.POSITION_LIMIT_RAD)
    np.testing.assert_array_equal(rl.action_space.low, -np.array(model.TORQUE_LIMIT_N_M))
    game = env_info("tournament", 2, env_with_opponent(2))["rl_info"]
    assert (game.observation_space.shape, game.action_space.shape, game.horizon) == ((23,), (14,), 45000)


def test_env_names_and_constraints_follow_the_task() -> None:
    expected = {"hit": "7dof-hit", "defend": "7dof-defend", "prepare": "7dof-prepare", "tournament": "tournament"}
    for task, name in expected.items():
        info = env_info(task, 1, ENV)
        assert info["env_name"] == name
        groups = ["joint_pos_constr", "joint_vel_constr", "ee_constr"] + ["link_constr"] * (task != "tournament")
        assert list(info["constraints"].keys()) == groups


def test_base_frames_are_those_of_robot_1_on_either_side() -> None:
    for agent_id in (1, 2):
        frames = env_info("tournament", agent_id, env_with_opponent(agent_id))["robot"]["base_frame"]
        np.testing.assert_array_equal(frames, [HOME, AWAY])


def test_env_info_arguments_are_checked() -> None:
    without = {key: value for key, value in ENV.items() if key != "table"}
    short = copy.deepcopy(ENV)
    short["robot"]["joint_pos_limit"] = [[0.0] * 6] * 2
    for arguments, message in [
        (("score", 1, ENV), "task: expected one of hit, defend, prepare, tournament, got 'score'"),
        (("hit", 3, ENV), "agent_id: expected one of 1, 2, got 3"),
        (("hit", True, ENV), "agent_id: expected one of 1, 2, got True"),
        (("hit", 1, without), "env: expected the key 'table', got dt, .*; give the env of the message hello"),
        (("hit", 1, None), "env: expected a mapping with the key 'robot', got None"),
        (("hit", 1, {**ENV, "table": 3}), r"env\['table'\]: expected a mapping with the key 'length', got 3"),
        (
            ("hit", 1, {**ENV, "puck": {"radius": "wide"}}),
            r"env\['puck'\]\['radius'\]: expected a finite number, got 'wide'",
        ),
        (("hit", 1, {**ENV, "joint_pos_ids": 6}), r"env\['joint_pos_ids'\]: expected a list of indices, got 6"),
        (("hit", 1, {**ENV, "dt": float("nan")}), r"env\['dt'\]: expected a finite number, got nan"),
        (("hit", 1, {**ENV, "n_agents": 3}), r"env\['n_agents'\]: expected one of 1, 2, got 3"),
        (("hit", 1, {**ENV, "robot": {**ENV["robot"], "base_frame": 1}}), "base_frame'\\]: expected a list of 4×4"),
        (("hit", 1, short), r"joint_pos_limit'\]: expected shape \(2, 7\), got \(2, 6\)"),
    ]:
        with pytest.raises(faceoff.Error, match=message):
            env_info(*arguments)  # type: ignore[arg-type]


def test_getters_return_their_slices(info: dict[str, Any]) -> None:
    observation = np.concatenate([np.arange(6.0), model.START_Q, np.arange(7.0)])
    agent = AgentBase(info)
    np.testing.assert_array_equal(agent.get_puck_pos(observation), [0, 1, 2])
    np.testing.assert_array_equal(agent.get_puck_vel(observation), [3, 4, 5])
    np.testing.assert_array_equal(agent.get_joint_pos(observation), model.START_Q)
    np.testing.assert_array_equal(agent.get_joint_vel(observation), np.arange(7.0))
    for part, whole in zip(agent.get_puck_state(observation), ([0, 1, 2], [3, 4, 5])):
        np.testing.assert_array_equal(part, whole)
    np.testing.assert_array_equal(agent.get_joint_state(observation)[1], np.arange(7.0))
    position, rotation = agent.get_ee_pose(observation)
    np.testing.assert_allclose(position, kinematics.forward(model.START_Q), atol=1e-12)
    assert rotation.shape == (3, 3)
    for wrong in ([0.0] * 20, np.zeros(8), None):
        with pytest.raises(faceoff.ArgumentError, match="obs: expected the array that draw_action gets"):
            agent.get_joint_pos(wrong)  # type: ignore[arg-type]
    # Slices are copies: an agent may change them.
    agent.get_joint_pos(observation)[:] = 0.0
    assert observation[7] != 0.0


def test_agent_base_has_what_mushroom_rl_gave_it(info: dict[str, Any]) -> None:
    agent = AgentBase(info, agent_id=2, anything=3)
    assert (agent.agent_id, agent.mdp_info, agent.policy) == (2, info["rl_info"], None)
    assert agent.robot_model is not info["robot"]["robot_model"]
    agent.add_preprocessor(np.abs)
    assert agent.preprocessors == [np.abs]
    assert agent.copy().preprocessors == [np.abs]
    for call in (agent.reset, agent.episode_start, lambda: agent.draw_action(np.zeros(20)), lambda: agent.fit([])):
        with pytest.raises(NotImplementedError, match="AgentBase has no "):
            call()
    with pytest.raises(faceoff.ArgumentError, match="env_info: expected the key 'rl_info'"):
        AgentBase({})


class SavableAgent(AgentBase):
    def __init__(self, env_info: dict[str, Any], **kwargs: Any) -> None:
        super().__init__(env_info, **kwargs)
        self.gain, self.weights, self.names = 2.5, np.arange(3.0), {"a": [1, 2]}
        self.table, self.buffer, self.thing = [1, "x"], np.zeros(4), object()
        self.inner: Any = None
        self._add_save_attr(
            gain="primitive",
            weights="numpy",
            names="pickle",
            table="json",
            buffer="numpy!",
            thing="none",
            inner="mushroom",
        )


def test_saved_agent_is_loaded_with_its_attributes(info: dict[str, Any], tmp_path: Path) -> None:
    agent = SavableAgent(info)
    agent.inner = SavableAgent(info)
    agent.inner.gain = 7.0
    agent.save(tmp_path / "models" / "agent.msh")
    loaded = SavableAgent.load_agent(tmp_path / "models" / "agent.msh", info, agent_id=2)
    assert (loaded.gain, loaded.names, loaded.table, loaded.agent_id) == (2.5, {"a": [1, 2]}, [1, "x"], 2)
    assert (loaded.thing, loaded.buffer, loaded.inner.gain, loaded.preprocessors) == (None, None, 7.0, [])
    np.testing.assert_array_equal(loaded.weights, np.arange(3.0))
    assert loaded.mdp_info.shape == (20, 7) and loaded.env_info is info
    agent.save(tmp_path / "full.msh", full_save=True)
    np.testing.assert_array_equal(SavableAgent.load(tmp_path / "full.msh").buffer, np.zeros(4))


def test_file_of_mushroom_rl_is_read(info: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Such a file names the classes of the spaces by MushroomRL's modules, which are not there when it is read."""
    spaces, environment = type(sys)("mushroom_rl.utils.spaces"), type(sys)("mushroom_rl.core.environment")
    spaces.Box = type("Box", (), {"__module__": spaces.__name__})  # type: ignore[attr-defined]
    environment.MDPInfo = type("MDPInfo", (), {"__module__": environment.__name__})  # type: ignore[attr-defined]
    with monkeypatch.context() as patch, zipfile.ZipFile(tmp_path / "old.msh", "w") as archive:
        for name in ("mushroom_rl", "mushroom_rl.utils", "mushroom_rl.core"):
            patch.setitem(sys.modules, name, type(sys)(name))
        for module in (spaces, environment):
            patch.setitem(sys.modules, module.__name__, module)
        box = {"type": spaces.Box, "save_attributes": {"_low": "primitive"}, "primitive_dictionary": {"_low": [0.0]}}
        mdp = {
            "type": environment.MDPInfo,
            "save_attributes": {"observation_space": "mushroom", "gamma": "primitive"},
            "primitive_dictionary": {"gamma": 0.9},
        }
        agent = {"type": SavableAgent, "save_attributes": {"mdp_info": "mushroom"}, "primitive_dictionary": {}}
        archive.writestr("agent.config", pickle.dumps(agent))
        archive.writestr("mdp_info.mushroom/agent.config", pickle.dumps(mdp))
        archive.writestr("mdp_info.mushroom/observation_space.mushroom/agent.config", pickle.dumps(box))
    loaded = SavableAgent.load_agent(tmp_path / "old.msh", info)
    assert isinstance(loaded.mdp_info, MDPInfo) and loaded.mdp_info.gamma == 0.9
    assert isinstance(loaded.mdp_info.observation_space, Box) and loaded.mdp_info.observation_space.low == [0.0]


def test_files_that_are_no_agents_are_refused(info: dict[str, Any], tmp_path: Path) -> None:
    (tmp_path / "text").write_text("no archive")
    with zipfile.ZipFile(tmp_path / "empty.zip", "w"):
        pass
    for name, message in [("none", "which is no file"), ("text", r"\(ZIP\)"), ("empty.zip", "entry 'config'")]:
        with pytest.raises(faceoff.ArgumentError, match=f"path: expected .*{message}"):
            AgentBase.load_agent(tmp_path / name, info)
    for call in (AgentBase.load, AgentBase(info).save):
        with pytest.raises(faceoff.ArgumentTypeError, match="path: expected the path of a file, got 3"):
            call(3)  # type: ignore[arg-type]
    with pytest.raises(faceoff.ArgumentError, match="_add_save_attr: gain: expected one of primitive, .*, got 'yaml'"):
        AgentBase(info)._add_save_attr(gain="yaml")


def test_stand_ins_name_what_they_have() -> None:
    robot_model, robot_data = copy.deepcopy(ROBOT)
    with pytest.raises(
        StandInError, match="robot_model.opt: expected one of actuator_ctrlrange, jnt_range, nq, nv, because"
    ):
        robot_model.opt
    with pytest.raises(StandInError, match="robot_data.body: expected one of qpos, .*use forward_kinematics"):
        robot_data.body("iiwa_1/link_4")
    assert issubclass(StandInError, (faceoff.Error, AttributeError)) and not hasattr(robot_data, "ctrl")
    assert isinstance(pickle.loads(pickle.dumps(robot_model)), RobotModel)


IMPORTS = """
from air_hockey_challenge.framework import AgentBase, AirHockeyChallengeWrapper, ChallengeCore
from air_hockey_challenge.framework.agent_base import AgentBase as Same
from air_hockey_challenge.framework.air_hockey_challenge_wrapper import AirHockeyChallengeWrapper
from air_hockey_challenge.framework.challenge_core import ChallengeCore
from air_hockey_challenge.framework.evaluate_agent import PENALTY_POINTS, evaluate
from air_hockey_challenge.framework.evaluate_tournament import run_tournament
from air_hockey_challenge.utils import forward_kinematics, inverse_kinematics, jacobian, robot_to_world, world_to_robot
from air_hockey_challenge.utils.kinematics import forward_kinematics, inverse_kinematics, jacobian, link_to_xml_name
from air_hockey_challenge.utils.transformations import robot_to_world, world_to_robot
from air_hockey_challenge.constraints import *
from air_hockey_challenge.constraints.constraints import Constraint
import sys
assert AgentBase is Same and issubclass(LinkConstraint, Constraint) and np.zeros(1) == 0
assert not {"mujoco", "torch", "faceoff._native"} & set(sys.modules)
"""


def test_imports_of_participants_work_without_other_packages() -> None:
    program = f"import sys; sys.path.insert(0, {str(SUBSTITUTE)!r})\n{IMPORTS}"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_simulator_and_evaluation_of_2023_are_refused_in_use() -> None:
    for call, name, advice in [
        (_unavailable.AirHockeyChallengeWrapper, "AirHockeyChallengeWrapper", "faceoff.gym"),
        (_unavailable.ChallengeCore, "ChallengeCore", "faceoff.gym"),
        (_unavailable.evaluate, "evaluate", "faceoff eval"),
        (_unavailable.run_tournament, "run_tournament", "faceoff play"),
    ]:
        with pytest.raises(MissingError, match=f"^{name}: expected .*, got .*; .*{advice}"):
            call("7dof-hit", interpolation_order=3)


DOCUMENT = (REPOSITORY / "docs" / "from-2023.md").read_text()


def test_program_of_the_document_runs() -> None:
    program = DOCUMENT.split("```python\n")[1].split("```")[0]
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=TEAM, stdin=subprocess.DEVNULL, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


def test_document_names_keys_and_penalty_points(info: dict[str, Any]) -> None:
    for key in set(info) - {key for key in info if key.endswith("_ids")}:
        assert f"`{key}`" in DOCUMENT, key
    points = _unavailable.PENALTY_POINTS
    for group in ("ee_constr", "link_constr", "joint_pos_constr", "joint_vel_constr"):
        assert f"`{group}` {points[group]}" in DOCUMENT, group
    assert f"computation time {points['computation_time_minor']} to {points['computation_time_major']}" in DOCUMENT
