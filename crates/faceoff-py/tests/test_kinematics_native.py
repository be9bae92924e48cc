"""`faceoff.kinematics.native` has the results and errors of `faceoff.kinematics` and `faceoff.kinematics.plain`."""

import math
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import faceoff
from faceoff import _native
from faceoff import kinematics as arm
from faceoff.kinematics import MalletMotion, model, native, plain

BOUND = np.array(plain.JOINT_BOUND_RAD)
#: The largest accepted angles and coordinates.
FAR = plain.NUMBER_LIMIT


def drawn_poses() -> np.ndarray:
    """Poses (4006, 7), rad: within the bounds, anywhere, in one plane, and at the largest accepted values."""
    draws = np.random.default_rng(1)
    flat = draws.uniform(-BOUND, BOUND, (1000, 7))
    flat[:, [2, 4, 6]] = 0.0
    special = [np.zeros(7), model.START_Q, BOUND, -BOUND, np.full(7, FAR), np.full(7, -FAR)]
    anywhere = draws.uniform(-7.0, 7.0, (1000, 7))
    return np.concatenate([draws.uniform(-BOUND, BOUND, (2000, 7)), anywhere, flat, special])


def drawn_points() -> np.ndarray:
    """Points (5006, 3), m: over the table, around the arm, mostly out of reach, and at the largest values."""
    draws = np.random.default_rng(2)
    table = draws.uniform([plain.X_MIN_M, -plain.Y_MAX_M], [1.5, plain.Y_MAX_M], (2000, 2))
    height = np.full((2000, 1), model.EE_DESIRED_HEIGHT_M)
    far = [[FAR, FAR, -FAR], [-FAR, 0.0, FAR], [2.0, 0.0, 0.0], [0.0, 0.0, 0.5], [0.0, 0.0, 0.0]]
    return np.concatenate(
        [
            np.concatenate([table, height], axis=1),
            draws.uniform(-2.0, 2.0, (3000, 3)),
            far,
            [arm.forward(model.START_Q)],
        ]
    )


def starts_near(points: np.ndarray) -> np.ndarray:
    """Poses, rad, for points some centimetres away, with a small change of all joints."""
    draws = np.random.default_rng(3)
    postures, _ = arm.inverse(np.clip(points + draws.normal(0.0, 0.03, points.shape), -FAR, FAR))
    return np.clip(postures + draws.normal(0.0, 0.1, postures.shape), -BOUND, BOUND)


def test_compiled_half_has_the_constants_of_the_plain_file() -> None:
    constants = _native.arm_constants()
    for name, value in constants.items():
        # The arc cosine of joint 2's bound comes from another library.
        assert value == pytest.approx(getattr(plain, name), rel=1e-15, abs=0.0), name
    parameters = {"HAND_PER_REACH_RAD_M", "JOINT_BOUND_RAD", "SOLUTION_TOLERANCE_M", "ITERATIONS", "DAMPING", "WEIGHT"}
    assert parameters <= set(constants)


class TestAgainstNumpyAndPlain:
    """To 1e-12, except where the arithmetic amplifies rounding errors; the test then says why."""

    def test_positions_derivatives_and_heights(self) -> None:
        q = drawn_poses()
        for name in ("forward", "jacobian", "heights"):
            actual, numpy_result = getattr(native, name)(q), getattr(arm, name)(q)
            np.testing.assert_allclose(actual, numpy_result, rtol=0.0, atol=1e-12, err_msg=name)
            one_by_one = [getattr(plain, name)(pose) for pose in q]
            np.testing.assert_allclose(actual, one_by_one, rtol=0.0, atol=1e-12, err_msg=name)
        for actual, numpy_result in zip(native.frames(q), arm.frames(q), strict=True):
            np.testing.assert_allclose(actual, numpy_result, rtol=0.0, atol=1e-12)

    def test_constraints(self) -> None:
        q = drawn_poses()
        dq = np.random.default_rng(4).normal(0.0, 2.0, q.shape)
        actual, numpy_result = native.constraints(q, dq), arm.constraints(q, dq)
        assert type(actual) is type(numpy_result)
        for name, values in numpy_result._asdict().items():
            np.testing.assert_allclose(getattr(actual, name), values, rtol=0.0, atol=1e-12, err_msg=name)
        plain_results = [plain.constraints(*pair) for pair in zip(q.tolist(), dq.tolist(), strict=True)]
        for name, values in actual.worst().items():
            one_by_one = [each[name] for each in plain_results]
            np.testing.assert_allclose(values, one_by_one, rtol=0.0, atol=1e-12, err_msg=name)

    def test_postures(self) -> None:
        points = drawn_points()
        q, is_solved = native.inverse(points)
        numpy_result, numpy_solved = arm.inverse(points)
        np.testing.assert_allclose(q, numpy_result, rtol=0.0, atol=1e-12)
        np.testing.assert_array_equal(is_solved, numpy_solved)
        assert 1000 < is_solved.sum() < 3000, "points in reach and out of it"
        plain_results = [plain.inverse(point) for point in points]
        np.testing.assert_allclose(q, [pose for pose, _ in plain_results], rtol=0.0, atol=1e-12)
        assert is_solved.tolist() == [solved for _, solved in plain_results]

    def test_postures_of_a_stretched_and_a_folded_arm(self) -> None:
        """Here an angle depends on the root of a length: a rounding error of 1e-16 m becomes 1e-8 rad."""
        reach = np.linspace(1.3, 1.6, 300_001)
        points = np.stack([reach, np.zeros_like(reach)], axis=1)
        q, is_solved = native.inverse(points)
        numpy_result, numpy_solved = arm.inverse(points)
        assert np.abs(q[:, 3]).min() == 0.0, "some are stretched"
        np.testing.assert_allclose(q, numpy_result, rtol=0.0, atol=1e-7)
        assert (is_solved != numpy_solved).sum() <= 1, "one point may lie on the bound itself"

    def test_velocities_of_postures(self) -> None:
        """Relative to the largest value, which grows near a stretched arm; there the sign is rounding noise."""
        points = drawn_points()
        speeds = np.random.default_rng(5).normal(0.0, 1.0, points.shape)
        q, _ = arm.inverse(points)
        is_bent = np.abs(np.sin(q[:, 3])) > 1e-3
        actual, numpy_result = native.posture_velocities(points, speeds), arm.posture_velocities(points, speeds)
        assert is_bent.sum() > 2000 and np.isfinite(actual).all()
        plain_results = np.array([plain.posture_velocities(*pair) for pair in zip(points, speeds, strict=True)])
        assert relative_difference(actual, numpy_result)[is_bent].max() < 1e-12
        assert relative_difference(actual, plain_results)[is_bent].max() < 1e-12

    def test_least_velocities(self) -> None:
        """Relative to the largest value, to 1e-10: only the damping of 1e-6 makes a stretched arm solvable."""
        q = drawn_poses()
        speeds = np.random.default_rng(6).normal(0.0, 1.0, (len(q), 3))
        actual = native.velocities(q, speeds)
        plain_results = np.array([plain.velocities(*pair) for pair in zip(q, speeds, strict=True)])
        assert relative_difference(actual, arm.velocities(q, speeds)).max() < 1e-10
        assert relative_difference(actual, plain_results).max() < 1e-10

    def test_poses_found_near_a_start(self) -> None:
        """To 1e-10, the end of the iterations; each starts from the rounding errors of the one before."""
        points = drawn_points()
        starts = starts_near(points)
        q, is_solved = native.inverse(points, starts)
        assert is_solved.sum() > 2000
        numpy_result, numpy_solved = arm.inverse(points, starts)
        np.testing.assert_array_equal(is_solved, numpy_solved)
        np.testing.assert_allclose(q[is_solved], numpy_result[is_solved], rtol=0.0, atol=1e-10)
        sample = slice(None, None, 10)
        plain_results = [plain.inverse(*pair) for pair in zip(points[sample], starts[sample], strict=True)]
        assert is_solved[sample].tolist() == [solved for _, solved in plain_results]
        found = np.array([pose for pose, _ in plain_results])
        np.testing.assert_allclose(q[sample][is_solved[sample]], found[is_solved[sample]], rtol=0.0, atol=1e-10)

    def test_poses_found_from_anywhere(self) -> None:
        """Over many iterations at bounds, rounding errors may lead to another valid pose."""
        points = drawn_points()
        starts = np.resize(drawn_poses(), (len(points), 7))
        q, is_solved = native.inverse(points, starts)
        numpy_result, numpy_solved = arm.inverse(points, starts)
        both = is_solved & numpy_solved
        assert both.sum() > 2000 and (is_solved != numpy_solved).mean() < 0.002
        assert (np.abs(q - numpy_result)[both].max(axis=1) > 1e-9).mean() < 0.03
        np.testing.assert_allclose(arm.forward(q[is_solved]), points[is_solved], rtol=0.0, atol=plain.SOLUTION_TOLERANCE_M)
        assert (np.abs(q) <= BOUND + 1e-12).all()
        assert (arm.heights(q[is_solved]) > model.LINK_HEIGHT_M).all()


def relative_difference(actual: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Differences (n, m) relative to the largest number of each row."""
    shares: np.ndarray = np.abs(actual - expected) / np.abs(expected).max(axis=1, keepdims=True)
    return shares


def test_points_have_the_same_bits_alone_and_in_a_batch() -> None:
    points = drawn_points()[::10]
    starts = starts_near(points)
    for arguments in ((points,), (points, starts)):
        q, is_solved = native.inverse(*arguments)
        for i in range(len(points)):
            q_single, solved = native.inverse(*(each[i] for each in arguments))
            np.testing.assert_array_equal(q_single, q[i])
            assert solved == is_solved[i] and type(solved) is np.bool_


def layouts(array: np.ndarray) -> list[Any]:
    """The same numbers, shape (n, m), in different memory layouts and types."""
    wide = np.zeros((2 * len(array), array.shape[1] + 3))
    wide[::2, 1:-2] = array
    bytewise = np.zeros(array.nbytes + 1, np.uint8)
    unaligned = bytewise[1:].view(np.float64).reshape(array.shape)
    unaligned[:] = array
    assert not unaligned.flags.aligned
    fixed = array.copy()
    fixed.flags.writeable = False
    return [
        np.asfortranarray(array),
        wide[::2, 1:-2],
        array[::-1].copy()[::-1],
        unaligned,
        fixed,
        array.astype(">f8"),
        array.tolist(),
        [tuple(row) for row in array.tolist()],
    ]


def test_memory_layout_does_not_change_results() -> None:
    q = drawn_poses()[:50]
    points = drawn_points()[:50]
    speeds = np.random.default_rng(7).normal(0.0, 1.0, points.shape)
    calls: list[tuple[Callable[..., Any], tuple[np.ndarray, ...]]] = [
        (native.forward, (q,)),
        (native.jacobian, (q,)),
        (native.heights, (q,)),
        (native.frames, (q,)),
        (native.inverse, (points,)),
        (native.inverse, (points, q)),
        (native.posture_velocities, (points, speeds)),
        (native.velocities, (q, speeds)),
        (native.constraints, (q, q)),
    ]
    for call, arguments in calls:
        expected = call(*arguments)
        for arguments in zip(*map(layouts, arguments), strict=True):
            np.testing.assert_equal(call(*arguments), expected)
    np.testing.assert_array_equal(native.forward(q.astype(np.float32)), native.forward(q.astype(np.float32).astype(float)))
    np.testing.assert_array_equal(native.forward([0, 0, 0, -1, 0, 1, 0]), native.forward([0.0, 0, 0, -1, 0, 1, 0]))


@pytest.mark.parametrize("leading", [(), (1,), (0,), (2, 3), (2, 0, 4), (1, 2, 1, 2)])
def test_shapes_and_types_equal_numpys(leading: tuple[int, ...]) -> None:
    q = np.broadcast_to(model.START_Q, (*leading, 7))
    xy, xyz = np.full((*leading, 2), 0.7), np.full((*leading, 3), 0.3)
    calls: list[tuple[str, tuple[np.ndarray, ...]]] = [
        ("forward", (q,)),
        ("jacobian", (q,)),
        ("heights", (q,)),
        ("frames", (q,)),
        ("inverse", (xy,)),
        ("inverse", (xyz, q)),
        ("posture_velocities", (xyz, xy)),
        ("velocities", (q, xyz)),
        ("constraints", (q, q)),
    ]
    for name, arguments in calls:
        actual, numpy_result = getattr(native, name)(*arguments), getattr(arm, name)(*arguments)
        if not isinstance(actual, tuple):
            actual, numpy_result = (actual,), (numpy_result,)
        for a, b in zip(actual, numpy_result, strict=True):
            assert type(a) is type(b) and a.dtype == b.dtype and a.shape == b.shape, name
            np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-9)


def test_leading_dimensions_are_broadcast() -> None:
    points, starts = drawn_points()[:12].reshape(3, 4, 3), np.tile(model.START_Q, (4, 1))
    q, is_solved = native.inverse(points, starts)
    assert q.shape == (3, 4, 7) and is_solved.shape == (3, 4)
    single, _ = native.inverse(points[2, 1], starts[1])
    np.testing.assert_array_equal(q[2, 1], single)
    assert native.velocities(model.START_Q, np.zeros((5, 2))).shape == (5, 7)
    assert native.constraints(np.zeros((5, 1, 7)), np.zeros(7)).joint_vel.shape == (5, 1, 14)


def test_arguments_are_unchanged_and_results_are_new_arrays() -> None:
    q, dq = np.tile(model.START_Q, (3, 1)), np.zeros((3, 7))
    before = q.copy()
    values = native.constraints(q, dq)
    values.ee[:] = 9.0
    for result in (native.forward(q), *native.inverse(native.forward(q), q), native.velocities(q, dq[:, :3])):
        assert not np.shares_memory(result, q)
        result[:] = 0
    np.testing.assert_array_equal(q, before)


INVALID_CALLS: list[tuple[str, tuple[Any, ...]]] = [
    ("forward", ([0.0] * 6,)),
    ("forward", (0.0,)),
    ("forward", (["a"] * 7,)),
    ("forward", ([[0.0] * 7, [0.0] * 6],)),
    ("forward", (None,)),
    ("forward", ([1j] * 7,)),
    ("forward", (np.zeros((7, 2)),)),
    ("jacobian", ([math.nan] * 7,)),
    ("jacobian", ([[0.0] * 7, [0.0] * 6 + [-math.inf]],)),
    ("heights", ([1.1e4] + [0.0] * 6,)),
    ("frames", (np.zeros((0, 8)),)),
    ("inverse", ([0.8],)),
    ("inverse", (0.8,)),
    ("inverse", ([0.8, math.inf],)),
    ("inverse", ([0.8, 0.0, math.nan],)),
    ("inverse", ([2e4, 0.0],)),
    ("inverse", ([0.8, 0.0], [0.0] * 6)),
    ("inverse", ([0.8, 0.0], [math.nan] * 7)),
    ("inverse", ([[0.8, 0.0]] * 3, [[0.0] * 7] * 2)),
    ("inverse", (np.zeros((0, 2)), np.zeros((2, 7)))),
    ("posture_velocities", ([0.8, 0.0], [1.0])),
    ("posture_velocities", ([0.8], [1.0, 0.0])),
    ("posture_velocities", ([[0.8, 0.0]] * 3, [[1.0, 0.0]] * 2)),
    ("velocities", ([0.0] * 7, [math.nan, 0.0])),
    ("velocities", ([0.0] * 8, [1.0, 0.0])),
    ("constraints", ([0.0] * 7, [0.0] * 3)),
    ("constraints", ([[0.0] * 7] * 2, [[0.0] * 7] * 3)),
]


@pytest.mark.parametrize(("name", "arguments"), INVALID_CALLS)
def test_errors_equal_those_of_the_numpy_functions(name: str, arguments: tuple[Any, ...]) -> None:
    errors = []
    for module in (arm, native):
        with pytest.raises(Exception) as caught:
            getattr(module, name)(*arguments)
        errors.append((type(caught.value), str(caught.value)))
    assert errors[0] == errors[1]
    assert issubclass(errors[0][0], (ValueError, TypeError))


def test_compiled_half_refuses_unsuitable_arrays() -> None:
    poses = np.zeros((4, 7))
    for q, ee in (
        (poses, np.empty((3, 3))),
        (poses, np.empty((4, 2))),
        (np.asfortranarray(np.ones((4, 7))), np.empty((4, 3))),
        (poses, np.empty((4, 6))[:, ::2]),
        (np.zeros((4, 6)), np.empty((4, 3))),
    ):
        with pytest.raises(faceoff.ArgumentError, match="rows"):
            _native.arm_forward(q, ee)
    with pytest.raises(faceoff.ArgumentError, match="rows"):
        _native.arm_inverse(np.zeros((4, 3)), poses[:3], np.empty((4, 7)), np.empty(4, np.bool_))
    with pytest.raises(TypeError):
        _native.arm_forward(poses.astype(np.float32), np.empty((4, 3)))


def test_mallet_commands_agree_between_both_inverses() -> None:
    draws = np.random.default_rng(8)
    numpy_motion, native_motion = MalletMotion(16, 2.0), MalletMotion(16, 2.0, native.inverse)
    single = MalletMotion(1, 2.0, native.inverse)
    for step in range(300):
        if step % 10 == 0:
            actions = draws.choice([-1.0, 0.0, 0.5, 1.0], (16, 2))
        commands = native_motion.command(actions)
        np.testing.assert_allclose(commands, numpy_motion.command(actions), rtol=0.0, atol=1e-9)
        np.testing.assert_array_equal(commands[3:4], single.command(actions[3:4]))
    assert np.ptp(native_motion.xy, axis=0).min() > 0.3, "the mallets have moved"


@pytest.mark.parametrize("name", ["faceoff/kinematics", "arm", "lib/geometry/robot"])
def test_folder_under_any_name_needs_no_compiled_half(name: str, tmp_path: Path) -> None:
    """The folder is copied alone, as in a bundle."""
    shutil.copytree(Path(arm.__file__).parent, tmp_path / name)
    first = name.split("/")[0]
    if first != name:
        (tmp_path / first / "__init__.py").touch()
    program = (
        f"import {name.replace('/', '.')} as arm, sys\n"
        "print(arm.inverse((0.8, 0.1))[1], arm.MalletMotion(1, 1.0).xy.shape, arm.__file__)\n"
        f"print(*(name for name in sys.modules if 'faceoff' in name and not name.startswith('{first}')), sep='')\n"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, timeout=600, text=True)
    assert done.stdout == f"True (1, 2) {tmp_path / name / '__init__.py'}\n\n", done.stderr


def test_names_equal_those_of_numpy_except_trajectories() -> None:
    motions = {"MalletMotion", "Trajectory", "minimum_jerk", "setpoints"}
    assert set(native.__all__) == set(arm.__all__) - motions
    assert native.speed_share(model.VELOCITY_LIMIT_RAD_S) == pytest.approx(1.0 / model.LIMIT_FRACTION)


def test_import_of_numpy_functions_loads_no_compiled_ones() -> None:
    program = "import faceoff.kinematics, sys; print(*(name for name in sys.modules if name.endswith('native')))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, timeout=600, text=True)
    assert done.stdout == "\n", done.stderr
