"""Kinematics, transformations and constraints of 2023 equal those of Faceoff and of MuJoCo."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest
from agents_2023 import AWAY, ENV, HOME, ROBOT, Q
from program import exported_model

import faceoff
from faceoff import kinematics
from faceoff.challenge_2023 import env_info
from faceoff.challenge_2023._constraints import Constraint, ConstraintList
from faceoff.challenge_2023._kinematics import (
    LINKS,
    forward_kinematics,
    inverse_kinematics,
    jacobian,
    link_to_xml_name,
)
from faceoff.challenge_2023._stand_ins import RobotData, RobotModel
from faceoff.challenge_2023._transformations import robot_to_world, world_to_robot
from faceoff.kinematics import model


def test_forward_kinematics_and_jacobian_equal_faceoffs() -> None:
    origins, rotations = kinematics.frames(Q)
    for q, origin, rotation, rows in zip(Q, origins, rotations, kinematics.jacobian(Q)):
        for index, link in enumerate(LINKS):
            position, matrix = forward_kinematics(*ROBOT, q, link)
            np.testing.assert_allclose(position, origin[index], atol=1e-12)
            np.testing.assert_allclose(matrix, rotation[index], atol=1e-12)
        np.testing.assert_allclose(jacobian(*ROBOT, q)[:3], rows, atol=1e-12)
        np.testing.assert_array_equal(ROBOT[1].qpos, q)


def test_kinematics_equal_mujoco_on_the_exported_model() -> None:
    mujoco = pytest.importorskip("mujoco")
    robot = mujoco.MjModel.from_xml_string(exported_model("mjcf", "controller"))
    data, base = mujoco.MjData(robot), [-model.BASE_X_M, 0.0, model.BASE_Z_M]
    for q in Q:
        data.qpos[:7] = q
        mujoco.mj_forward(robot, data)
        for link in LINKS[:7]:
            position, matrix = forward_kinematics(*ROBOT, q, link)
            body = data.body(f"link_{link}")
            np.testing.assert_allclose(position, body.xpos - base, atol=1e-12)
            np.testing.assert_allclose(matrix.ravel(), body.xmat, atol=1e-12)
            rows = np.empty((6, robot.nv))
            mujoco.mj_jacBody(robot, data, rows[:3], rows[3:], robot.body(f"link_{link}").id)
            np.testing.assert_allclose(jacobian(*ROBOT, q, link), rows[:, :7], atol=1e-12)
        np.testing.assert_allclose(forward_kinematics(*ROBOT, q)[0], data.site("end_effector").xpos - base, atol=1e-12)


def test_robot_model_is_mujocos_where_it_is_installed() -> None:
    mujoco = pytest.importorskip("mujoco")
    robot = env_info("hit", 1, ENV)["robot"]
    mj_model, mj_data = copy.deepcopy(robot["robot_model"]), copy.deepcopy(robot["robot_data"])
    assert isinstance(mj_model, mujoco.MjModel) and isinstance(mj_data, mujoco.MjData)
    assert (mj_model.nq, mj_model.nv, mj_model.nu) == (7, 7, 7)
    np.testing.assert_allclose(mj_model.jnt_range, RobotModel().jnt_range)
    np.testing.assert_allclose(mj_model.actuator_ctrlrange, RobotModel().actuator_ctrlrange)
    for q in Q[:10]:
        for link in LINKS:
            position, matrix = forward_kinematics(mj_model, mj_data, q, link)
            body = mj_data.body(link_to_xml_name(mj_model, link))
            np.testing.assert_allclose(position, body.xpos, atol=1e-12)
            np.testing.assert_allclose(matrix.ravel(), body.xmat, atol=1e-12)
            rows = np.empty((6, 7))
            mujoco.mj_jacBody(mj_model, mj_data, rows[:3], rows[3:], body.id)
            np.testing.assert_allclose(jacobian(mj_model, mj_data, q, link), rows, atol=1e-12)
    mass, bias = np.empty((7, 7)), mj_data.qfrc_bias
    mujoco.mj_forward(mj_model, mj_data)
    reference = mujoco.MjModel.from_xml_string(exported_model("mjcf", "controller"))
    data = mujoco.MjData(reference)
    data.qpos[:7] = mj_data.qpos
    mujoco.mj_forward(reference, data)
    np.testing.assert_allclose(bias, data.qfrc_bias[:7], atol=1e-10)
    for column, unit in enumerate(np.eye(7)):
        mujoco.mj_mulM(mj_model, mj_data, mass[column], unit)
        whole = np.empty(reference.nv)
        mujoco.mj_mulM(reference, data, whole, np.concatenate([unit, np.zeros(reference.nv - 7)]))
        np.testing.assert_allclose(mass[column], whole[:7], atol=1e-10)


def test_inverse_kinematics_reaches_points_and_rotations() -> None:
    rng = np.random.default_rng(1)
    successes = 0
    for _ in range(20):
        position, rotation = forward_kinematics(*ROBOT, np.array(model.START_Q) + rng.uniform(-0.3, 0.3, 7))
        success, q = inverse_kinematics(*ROBOT, position, initial_q=list(model.START_Q))
        assert success is True and q.shape == (7,)
        np.testing.assert_allclose(forward_kinematics(*ROBOT, q)[0], position, atol=1e-4)
        success, q = inverse_kinematics(*ROBOT, position, rotation, np.array(model.START_Q))
        if success:
            reached = forward_kinematics(*ROBOT, q)
            np.testing.assert_allclose(reached[0], position, atol=1e-4)
            np.testing.assert_allclose(reached[1], rotation, atol=2e-4)
            successes += 1
    assert successes > 10, "it may give up near a joint's bound, as in 2023"


def mujoco_inverse(robot: Any, q: Any, position: Any, rotation: Any, link: str) -> tuple[bool, Any]:
    """The iteration of 2023 with MuJoCo's functions instead of NumPy's."""
    mujoco, (mj_model, data) = pytest.importorskip("mujoco"), robot
    bound, body = 0.95 * np.array(model.POSITION_LIMIT_RAD), mj_model.body(link_to_xml_name(mj_model, link)).id
    data.qpos = q
    target, inverse, difference, turn = np.empty(4), np.empty(4), np.empty(4), np.empty(3)
    mujoco.mju_mat2Quat(target, np.ravel(rotation))
    for _ in range(1000):
        mujoco.mj_fwdPosition(mj_model, data)
        mujoco.mju_negQuat(inverse, data.xquat[body])
        mujoco.mju_mulQuat(difference, target, inverse)
        mujoco.mju_quat2Vel(turn, difference, 1)
        error = np.concatenate([position - data.xpos[body], turn])
        size = np.linalg.norm(error[:3]) + np.linalg.norm(turn)
        if size < 1e-4:
            return True, data.qpos.copy()
        rows = np.empty((6, 7))
        mujoco.mj_jacBody(mj_model, data, rows[:3], rows[3:], body)
        step = np.linalg.solve(rows.T @ rows + 1e-3 * np.eye(7), rows.T @ error)
        length = np.linalg.norm(step)
        if size / length > 20.0:
            break
        data.qpos = np.clip(data.qpos + step * min(1.0, 0.1 / length), -bound, bound)
    return False, data.qpos.copy()


def test_inverse_kinematics_equals_its_iteration_in_mujoco() -> None:
    pytest.importorskip("mujoco")
    robot = env_info("hit", 1, ENV)["robot"]
    objects = (robot["robot_model"], robot["robot_data"])
    rng = np.random.default_rng(3)
    outcomes = set()
    for case in range(60):
        link = ("ee", "7", "4")[case % 3]
        start = np.array(model.START_Q) + rng.uniform(-0.2, 0.2, 7)
        position, rotation = forward_kinematics(*ROBOT, start + rng.uniform(-0.6, 0.6, 7), link)
        success, q = inverse_kinematics(*ROBOT, position, rotation, start, link)
        expected_success, expected = mujoco_inverse(objects, start, position, rotation, link)
        assert success == expected_success
        np.testing.assert_allclose(q, expected, atol=1e-9)
        outcomes.add(success)
    assert outcomes == {True, False}


def test_inverse_kinematics_starts_where_the_data_is() -> None:
    robot = (RobotModel(), RobotData())
    target = kinematics.forward(model.START_Q)
    forward_kinematics(*robot, model.START_Q)
    assert inverse_kinematics(*robot, target)[0]
    np.testing.assert_array_equal(robot[1].qpos, model.START_Q)
    success, found = inverse_kinematics(*robot, [3.0, 0.0, 0.2])
    assert success is False and (np.abs(found) <= 0.95 * np.array(model.POSITION_LIMIT_RAD) + 1e-12).all()


def test_initial_pose_of_2023_is_found() -> None:
    """The pose at which episodes start was computed by this function: mallet at 0.65 m, rod turned by 150°."""
    angle = 5 / 6 * np.pi
    turned = [[np.cos(angle), 0.0, np.sin(angle)], [0.0, 1.0, 0.0], [-np.sin(angle), 0.0, np.cos(angle)]]
    start = np.array([0.0, -0.1961, 0.0, -1.8436, 0.0, 0.9704, 0.0])
    success, q = inverse_kinematics(*ROBOT, np.array([0.65, 0.0, 0.1645]), np.array(turned), initial_q=start)
    assert success
    np.testing.assert_allclose(q, model.START_Q, atol=1e-6)


def test_half_turn_has_a_finite_rotation_error() -> None:
    rotation = forward_kinematics(*ROBOT, model.START_Q)[1]
    for axis in range(3):
        half_turn = -np.eye(3)
        half_turn[axis, axis] = 1.0
        assert np.isfinite(inverse_kinematics(*ROBOT, None, half_turn @ rotation, model.START_Q)[1]).all()


def test_transformations_invert_each_other() -> None:
    rotation = forward_kinematics(*ROBOT, Q[0])[1]
    for frame in (HOME, AWAY):
        for point in ([0.3, -0.2], [0.3, -0.2, 0.1]):
            there, turned = robot_to_world(frame, point, rotation)
            assert there.shape == (len(point),)
            np.testing.assert_allclose(there, (frame @ [*point, *[0.0] * (3 - len(point)), 1.0])[: len(point)])
            back, again = world_to_robot(frame, there, turned)
            np.testing.assert_allclose(again, rotation, atol=1e-12)
            np.testing.assert_allclose(back, point, atol=1e-12)
    np.testing.assert_allclose(world_to_robot(AWAY, [1.51, 0.0, 0.0])[0], [0.0, 0.0, 0.1], atol=1e-12)
    np.testing.assert_array_equal(robot_to_world(AWAY, [0.0, 0.0])[1], AWAY[:3, :3])


def test_constraints_equal_the_rules() -> None:
    constraints = env_info("defend", 1, ENV)["constraints"]
    dq = np.random.default_rng(2).normal(0.0, 2.0, Q.shape)
    for q, rates in zip(Q, dq):
        values, expected = constraints.fun(q, rates), kinematics.constraints(q, rates)
        np.testing.assert_array_equal(values["joint_pos_constr"], expected.joint_pos)
        np.testing.assert_array_equal(values["joint_vel_constr"], expected.joint_vel)
        np.testing.assert_array_equal(values["ee_constr"], expected.ee)
        np.testing.assert_array_equal(values["link_constr"], expected.link[::-1])
    ee = constraints.get("ee_constr")
    assert ee.z_lb == pytest.approx(0.1445) and ee.z_ub == pytest.approx(0.1845)
    assert ee.x_lb == pytest.approx(0.58415) and ee.y_ub == -ee.y_lb == pytest.approx(0.47085)


def test_constraint_jacobians_equal_difference_quotients() -> None:
    constraints = env_info("defend", 1, ENV)["constraints"]
    q, dq, step = Q[3], np.linspace(-1.0, 1.0, 7), 1e-6
    for name, rows in constraints.jacobian(q, dq).items():
        constraint = constraints.get(name)
        assert rows.shape == (constraint.output_dim, 14)
        for column, unit in enumerate(step * np.eye(14)):
            change = constraint.fun(q + unit[:7], dq + unit[7:]) - constraint.fun(q - unit[:7], dq - unit[7:])
            np.testing.assert_allclose(rows[:, column], change / (2 * step), atol=1e-8)


def test_constraint_lists_accept_constraints_of_teams() -> None:
    info = env_info("defend", 1, ENV)

    class Slow(Constraint):
        def __init__(self, env_info: Any) -> None:
            super().__init__(env_info, output_dim=1)
            self._name = "slow"

        def _fun(self, q: Any, dq: Any) -> Any:
            self._fun_value[0] = np.linalg.norm(dq) - 1.0
            return self._fun_value

    constraints = ConstraintList()
    constraints.add(Slow(info))
    assert constraints.fun(Q[0], np.zeros(7))["slow"] == [-1.0]
    with pytest.raises(NotImplementedError, match="Slow has no _jacobian"):
        constraints.jacobian(Q[0], np.zeros(7))
    constraints.delete("slow")
    assert not constraints.keys() and constraints.get("slow") is None
    for call, message in [
        (lambda: constraints.delete("slow"), "name: expected one of the list's, no constraint, got 'slow'"),
        (lambda: Constraint(info, 0), "output_dim: expected a whole number from 1, got 0"),
        (lambda: constraints.add(3), "c: expected a Constraint, got 3"),  # type: ignore[arg-type]
        (lambda: info["constraints"].fun(Q[0, :6], Q[0]), r"q: expected shape \(7,\), got \(6,\)"),
    ]:
        with pytest.raises(faceoff.Error, match=message):
            call()


def test_kinematics_arguments_are_checked() -> None:
    q, robot = model.START_Q, ROBOT
    for call, message in [
        (lambda: forward_kinematics(*robot, q[:6]), r"q: expected shape \(7,\), got \(6,\)"),
        (lambda: forward_kinematics(*robot, [float("nan")] * 7), "q: expected finite numbers, got nan"),
        (lambda: forward_kinematics(*robot, "pose"), "q: expected numbers of shape"),
        (lambda: jacobian(*robot, q, "8"), "link: expected one of 1, 2, 3, 4, 5, 6, 7, ee, got '8'"),
        (lambda: link_to_xml_name(robot[0], 4), "link: expected one of .*, got 4"),  # type: ignore[arg-type]
        (lambda: forward_kinematics(q, None, q), r"mj_model: expected env_info\['robot'\]\['robot_model'\], got tuple"),
        (lambda: jacobian(robot[0], robot[0], q), "mj_data: expected .*robot_data'\\], got RobotModel"),
        (lambda: inverse_kinematics(*robot, [0.8, 0.1]), r"desired_position: expected shape \(3,\), got \(2,\)"),
        (lambda: inverse_kinematics(*robot, None), "desired_position: expected three numbers, or a desired_rotation"),
        (lambda: inverse_kinematics(*robot, None, np.eye(4)), r"desired_rotation: expected shape \(3, 3\)"),
        (lambda: inverse_kinematics(*robot, [0.8, 0.1, 0.2], None, q[:3]), r"initial_q: expected shape \(7,\)"),
        (lambda: robot_to_world(np.eye(3), [0.0, 0.0]), r"base_frame: expected shape \(4, 4\)"),
        (lambda: world_to_robot(HOME, 3.0), r"translation: expected shape \(2,\) or \(3,\), got \(\)"),
    ]:
        with pytest.raises(faceoff.Error, match=message):
            call()
