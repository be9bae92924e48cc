"""`faceoff.kinematics`: NumPy and standard library agree with each other and with the simulator.

A *pose* is the angles of all joints; the *posture* of a point is the pose that `inverse` gives without a start pose.
"""

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from program import kinematics, trace

from faceoff import kinematics as arm
from faceoff.kinematics import model, plain

BOUND = np.array(plain.JOINT_BOUND_RAD)


def random_poses(count, seed, share=0.95):
    """Joint angles, rad, within a share of their bounds."""
    return np.random.default_rng(seed).uniform(-share * BOUND, share * BOUND, (count, 7))


def points_over_the_table(count, seed, reach=1.4):
    """Random points in the mallet's area and the arm's reach, m."""
    rng = np.random.default_rng(seed)
    points = rng.uniform([plain.X_MIN_M, -plain.Y_MAX_M], [reach, plain.Y_MAX_M], (3 * count, 2))
    return points[np.hypot(*points.T) < reach][:count]


def test_plain_file_has_the_constants_of_the_model():
    constants = {name: value for name, value in vars(plain).items() if name.isupper()}
    shared = {name for name in constants if hasattr(model, name)}
    for name in shared:
        assert constants[name] == getattr(model, name), name
    assert {"LINK_OFFSET_M", "POSITION_LIMIT_RAD", "VELOCITY_LIMIT_RAD_S", "START_Q"} <= shared


def test_plain_file_needs_only_the_standard_library(tmp_path):
    """The file is copied alone, as in a bundle, without this package and NumPy."""
    (tmp_path / "arm.py").write_text(Path(plain.__file__).read_text())
    program = "import arm, sys; print(arm.inverse((0.8, 0.1))[1], 'numpy' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-S", "-c", program], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.stdout == "True False\n", done.stderr


class TestAgainstTheSimulator:
    """Positions, Jacobian and constraints to 1e-12."""

    q = random_poses(200, seed=1)
    dq = np.random.default_rng(2).normal(0.0, 1.5, (200, 7))

    @pytest.fixture(scope="class")
    @classmethod
    def answers(cls):
        return kinematics([{"q": q.tolist(), "dq": dq.tolist()} for q, dq in zip(cls.q, cls.dq)])

    def test_forward_frames_heights_and_jacobian(self, answers):
        links = np.array([answer["links"] for answer in answers])
        ee = np.array([answer["ee"] for answer in answers])
        origins, rotations = arm.frames(self.q)
        np.testing.assert_allclose(arm.forward(self.q), ee, atol=1e-12)
        np.testing.assert_allclose(origins[:, :7], links, atol=1e-12)
        np.testing.assert_allclose(origins[:, 7], ee, atol=1e-12)
        expected = np.array([answer["rotations"] for answer in answers]).reshape(-1, 7, 3, 3)
        np.testing.assert_allclose(rotations[:, :7], expected, atol=1e-12)
        np.testing.assert_allclose(arm.heights(self.q), links[:, [3, 6], 2], atol=1e-12)
        jacobian = np.array([answer["jacobian"] for answer in answers])[:, :3]
        np.testing.assert_allclose(arm.jacobian(self.q), jacobian, atol=1e-12)
        for q, position, rows in zip(self.q, ee, jacobian):
            np.testing.assert_allclose(plain.forward(q), position, atol=1e-12)
            np.testing.assert_allclose(plain.jacobian(q), rows, atol=1e-12)

    def test_constraints(self, answers):
        worst = arm.constraints(self.q, self.dq).worst()
        for key in ("ee", "link", "joint_pos", "joint_vel"):
            expected = [answer["constraints"][key] for answer in answers]
            np.testing.assert_allclose(worst[key], expected, atol=1e-12)
            plain_values = [plain.constraints(q, dq)[key] for q, dq in zip(self.q, self.dq)]
            np.testing.assert_allclose(plain_values, expected, atol=1e-12)


class TestInverse:
    def test_postures_reach_their_points_within_all_bounds(self):
        points = points_over_the_table(2000, seed=3, reach=1.43)
        q, ok = arm.inverse(points)
        assert ok.all()
        np.testing.assert_allclose(arm.forward(q)[:, :2], points, atol=1e-9)
        np.testing.assert_allclose(arm.forward(q)[:, 2], model.EE_DESIRED_HEIGHT_M, atol=1e-9)
        values = arm.constraints(q, np.zeros_like(q)).worst()
        assert all((group < 0.0).all() for group in values.values())

    def test_start_pose_is_the_posture_of_its_point(self):
        q, ok = arm.inverse(arm.forward(model.START_Q))
        assert ok
        np.testing.assert_allclose(q, model.START_Q, atol=1e-12)

    def test_solution_is_near_its_start_pose(self):
        points = points_over_the_table(500, seed=4)
        start, _ = arm.inverse(points + np.random.default_rng(5).normal(0.0, 0.02, points.shape))
        q, ok = arm.inverse(points, start)
        assert ok.mean() > 0.99, "at the table's edges a start may lie beyond the bounds"
        np.testing.assert_allclose(arm.forward(q[ok])[:, :2], points[ok], atol=1e-9)
        posture, _ = arm.inverse(points)
        is_nearer = np.linalg.norm(q - start, axis=-1) <= np.linalg.norm(posture - start, axis=-1) + 0.05
        assert is_nearer[ok].all(), "at most as far as the posture"

    def test_most_points_are_reached_from_any_start_pose(self):
        """A local search from a distant pose may end at a bound; the flag is then false."""
        points = points_over_the_table(400, seed=6, reach=1.3)
        q, ok = arm.inverse(points, random_poses(400, seed=7, share=0.6))
        print("reached", ok.mean())
        assert ok.mean() > 0.95
        values = arm.constraints(q[ok], np.zeros_like(q[ok])).worst()
        assert all((group < 0.0).all() for group in values.values())

    def test_low_wrist_is_raised(self):
        """The start pose has a flat hand, with the end effector at the target."""
        reach, hand = 1.3, 1.6
        ahead = reach - plain.HAND_M * math.sin(hand)
        above = model.EE_DESIRED_HEIGHT_M - plain.HAND_M * math.cos(hand) - plain.SHOULDER_M
        side = math.hypot(ahead, above)

        def corner(opposite, a, b):
            return math.acos((a * a + b * b - opposite * opposite) / (2 * a * b))

        upper = math.atan2(ahead, above) - corner(plain.FOREARM_M, plain.UPPER_ARM_M, side)
        forearm = upper + math.pi - corner(side, plain.UPPER_ARM_M, plain.FOREARM_M)
        low = [0.0, upper, 0.0, upper - forearm, 0.0, hand - forearm, 0.0]
        np.testing.assert_allclose(arm.forward(low)[[0, 2]], [reach, model.EE_DESIRED_HEIGHT_M])
        assert arm.heights(low)[1] < model.LINK_HEIGHT_M
        q, ok = arm.inverse([reach, 0.0], low)
        assert ok
        assert arm.heights(q)[1] >= model.LINK_HEIGHT_M

    def test_unreachable_points_are_flagged(self):
        _, ok = arm.inverse([[2.0, 0.0], [0.8, 0.0], [1.1, 1.1]])
        assert ok.tolist() == [False, True, False]
        _, ok = arm.inverse([2.0, 0.0], model.START_Q)
        assert not ok

    def test_distant_points_give_finite_poses(self):
        far = [[1e4, 1e4, -1e4], [0.0, 0.0, 0.0], [-1e4, 0.0, 1e4], [1.4, 0.0, 0.1645]]
        for q0 in (None, model.START_Q, [1e4] * 7):
            q, _ = arm.inverse(far, q0)
            assert np.isfinite(q).all()
            assert np.isfinite([plain.inverse(point, q0)[0] for point in far]).all()

    def test_shapes_follow_the_arguments(self):
        q, ok = arm.inverse(np.full((2, 3, 2), [0.8, 0.1]))
        assert q.shape == (2, 3, 7) and ok.shape == (2, 3)
        q, ok = arm.inverse([0.8, 0.1], np.broadcast_to(model.START_Q, (4, 5, 7)))
        assert q.shape == (4, 5, 7) and ok.shape == (4, 5)
        q, ok = arm.inverse([0.8, 0.1, 0.2], model.START_Q)
        assert q.shape == (7,) and ok.shape == ()
        q, ok = arm.inverse(np.empty((0, 2)), np.empty((0, 7)))
        assert q.shape == (0, 7) and ok.shape == (0,)
        assert arm.jacobian(np.zeros((4, 7))).shape == (4, 3, 7)

    def test_numpy_and_standard_library_agree(self):
        points = points_over_the_table(60, seed=8)
        starts = random_poses(60, seed=9, share=0.5)
        postures, good = arm.inverse(points)
        near, near_good = arm.inverse(points, starts)
        rates = np.random.default_rng(10).normal(0.0, 1.0, (60, 2))
        posture_rates = arm.posture_velocities(points, rates)
        minimal = arm.velocities(starts, rates)
        for i, point in enumerate(points):
            q, ok = plain.inverse(point)
            np.testing.assert_allclose(q, postures[i], atol=1e-12)
            assert ok == good[i]
            q, ok = plain.inverse(point, starts[i])
            assert ok == near_good[i]
            if ok:
                np.testing.assert_allclose(q, near[i], atol=1e-9)
            np.testing.assert_allclose(
                plain.posture_velocities(point, rates[i]), posture_rates[i], atol=1e-11
            )
            np.testing.assert_allclose(plain.velocities(starts[i], rates[i]), minimal[i], atol=1e-11)


class TestVelocities:
    def test_velocities_on_the_axis_of_joint_1_are_finite(self):
        assert np.isfinite(arm.posture_velocities([0.0, 0.0], [1.0, 1.0])).all()
        assert all(map(math.isfinite, plain.posture_velocities([0.0, 0.0], [1.0, 1.0])))

    def test_posture_velocities_are_the_derivative_of_the_posture(self):
        points = points_over_the_table(200, seed=11)
        rates = np.random.default_rng(12).normal(0.0, 1.0, points.shape)
        step_s = 1e-6
        before, _ = arm.inverse(points - step_s * rates)
        after, _ = arm.inverse(points + step_s * rates)
        expected = (after - before) / (2 * step_s)
        np.testing.assert_allclose(arm.posture_velocities(points, rates), expected, atol=1e-6)

    def test_minimum_velocities_move_the_mallet_as_requested(self):
        q, _ = arm.inverse(points_over_the_table(200, seed=13))
        rates = np.random.default_rng(14).normal(0.0, 1.0, (200, 3))
        dq = arm.velocities(q, rates)
        np.testing.assert_allclose(np.einsum("nij,nj->ni", arm.jacobian(q), dq), rates, atol=1e-4)
        posture_rates = arm.posture_velocities(arm.forward(q), rates)
        weighted = np.array(model.VELOCITY_LIMIT_RAD_S)
        minimal, other = (np.linalg.norm(v / weighted, axis=-1) for v in (dq, posture_rates))
        assert (minimal <= other + 1e-4).all()

    def test_speed_share_is_relative_to_the_allowed_velocity(self):
        at_limit = 0.95 * np.array(model.VELOCITY_LIMIT_RAD_S)
        assert arm.speed_share(at_limit) == pytest.approx(1.0)
        assert plain.speed_share(-0.5 * at_limit) == pytest.approx(0.5)


class TestTrajectories:
    start, end = (0.65, 0.0), (0.95, 0.3)

    def test_trajectory_duration_is_set_by_the_joint_speeds(self):
        motion = arm.minimum_jerk(self.start, self.end)
        assert motion.ok and motion.speed_share <= 0.9
        np.testing.assert_allclose(arm.forward(motion.q[-1])[:2], self.end, atol=1e-9)
        np.testing.assert_allclose(motion.dq[-1], 0.0, atol=1e-9)
        faster = arm.minimum_jerk(self.start, self.end, duration_s=motion.duration_s - 0.02)
        assert not faster.ok and faster.speed_share > 0.9

    def test_velocities_and_accelerations_are_derivatives(self):
        motion = arm.minimum_jerk(self.start, self.end, end_velocity=(0.5, -0.2))
        dense = motion.dense.reshape(-1, 3, 7)
        for k in (0, 1):
            slope = (dense[2:, k] - dense[:-2, k]) / 0.002
            np.testing.assert_allclose(dense[1:-1, k + 1], slope, atol=2e-2)
        np.testing.assert_array_equal(dense[19::20, 0], motion.q)
        end = arm.jacobian(motion.q[-1]) @ motion.dq[-1]
        np.testing.assert_allclose(end, [0.5, -0.2, 0.0], atol=1e-9)

    @pytest.mark.parametrize("interpolation", [1, 2, 3, 4, 5, -1, None])
    def test_robot_follows_without_a_violation(self, interpolation):
        """Forth and back on the simulator: no violation, and the mallet arrives within 5 mm."""
        forth = arm.minimum_jerk(self.start, self.end)
        back = arm.minimum_jerk(self.end, self.start)
        actions = np.concatenate([forth.actions(interpolation), back.actions(interpolation)])
        states = trace(
            {
                "puck": [0.8, -0.4, 0, 0, 0, 0],
                "duration_ms": 20 * len(actions),
                "every_ms": 20,
                "joints": [arm.inverse(self.start)[0].tolist()],
                "interpolation": [interpolation],
                "actions": [actions.tolist()],
            }
        )
        for state in states:
            assert max(state["constraints"][0].values()) <= 0.0, state
        for state, goal in ((states[len(forth)], self.end), (states[-1], self.start)):
            assert math.dist(state["ee"][0][:2], goal) < 5e-3

    @pytest.mark.parametrize("interpolation", [3, 4, 5, -1, None])
    def test_setpoints_pass_through_the_knots(self, interpolation):
        motion = arm.minimum_jerk(self.start, self.end)
        q = arm.inverse(self.start)[0]
        points = arm.setpoints(q, motion.actions(interpolation), interpolation)
        np.testing.assert_allclose(points[:, -1, 0], motion.q, atol=1e-12)
        np.testing.assert_allclose(points[:, -1, 1], motion.dq, atol=1e-9)
        np.testing.assert_allclose(points[:, :, 0], motion.dense[:, :, 0], atol=2e-3)

    def test_trajectory_out_of_reach_or_bounds_is_not_ok(self):
        assert not arm.minimum_jerk(self.start, (1.6, 0.0), duration_s=2.0).ok
        assert not arm.minimum_jerk(self.start, (0.65, 0.5), duration_s=2.0).ok
        far = arm.minimum_jerk(self.start, (1e4, 0.0), end_velocity=(1e4, 0.0), duration_s=0.02)
        assert not far.ok and np.isfinite(far.dense).all()
        assert not arm.minimum_jerk(self.start, (1e4, 0.0)).ok


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: arm.forward([0.0] * 6), "q: expected shape (..., 7), got (6,)"),
        (lambda: arm.forward(0.0), "q: expected shape (..., 7), got ()"),
        (lambda: arm.forward(["a"] * 7), "q: expected an array of numbers"),
        (lambda: arm.jacobian([math.nan] * 7), "q: expected numbers within ±10000, got nan"),
        (lambda: arm.inverse([0.8]), "target: expected shape (..., 2) or (..., 3), got (1,)"),
        (lambda: arm.inverse([0.8, math.inf]), "target: expected numbers within ±10000, got inf"),
        (lambda: arm.inverse([[0.8, 0.0]] * 3, [[0.0] * 7] * 2), "target and q0: expected leading"),
        (lambda: arm.constraints([0.0] * 7, [0.0] * 3), "dq: expected shape (..., 7), got (3,)"),
        (lambda: arm.minimum_jerk((0.7, 0.0), (0.8, 0.0), duration_s=-1.0), "duration_s: expected"),
        (lambda: arm.minimum_jerk((0.7, 0.0), (0.8, 0.0), duration_s=math.nan), "duration_s"),
        (lambda: arm.minimum_jerk((0.7, 0.0), (0.8, 0.0), share=0.0), "share: expected"),
        (lambda: arm.minimum_jerk([[0.7, 0.0]], (0.8, 0.0)), "start: expected shape (2,) or (3,)"),
        (lambda: arm.setpoints([0.0] * 7, [[0.0] * 7], 3), "actions: expected shape (n, 2, 7)"),
        (lambda: arm.setpoints([0.0] * 7, [[0.0] * 7], 7), "interpolation: expected one of"),
        (lambda: arm.inverse([2e4, 0.0]), "target: expected numbers within ±10000, got 20000"),
        (lambda: plain.inverse(0.8), "target: expected a sequence of numbers, got 0.8"),
        (lambda: plain.forward([0.0] * 8), "q: expected 7 numbers, got 8"),
        (lambda: plain.inverse([math.nan, 0.0]), "target: expected numbers within ±10000, got nan"),
        (lambda: plain.inverse([0.0]), "target: expected 2 or 3 numbers, got 1"),
    ],
)
def test_invalid_argument_errors_name_the_argument(call, message):
    with pytest.raises(ValueError) as caught:
        call()
    assert message in str(caught.value)
