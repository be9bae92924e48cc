"""The exported model in other libraries: pinocchio and MuJoCo agree with the simulator.

The simulator's numbers come from `faceoff sim kinematics` and `faceoff sim trace`.
"""

import math
import subprocess
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from program import PROGRAM, REPOSITORY, exported_model, faceoff, kinematics, trace

from faceoff.kinematics import model as numbers

# The simulated arm with the mallet, and the controller's model, which ends at the end effector.
MODELS = ("plant", "controller")
# Joints with a motor; the plant's last two are those of the mallet's universal joint.
DRIVEN = numbers.JOINTS


def poses(count, dofs, seed):
    """Random joint positions and velocities within the limits, the start pose first."""
    rng = np.random.default_rng(seed)
    reach = np.array([*numbers.POSITION_LIMIT_RAD, 1.5, 1.5])[:dofs]
    q = rng.uniform(-reach, reach, (count, dofs))
    q[0] = [*numbers.START_Q, *numbers.START_UNIVERSAL_RAD][:dofs]
    return q, rng.normal(0.0, 1.0, (count, dofs))


def answers(q, dq):
    return kinematics([{"q": a.tolist(), "dq": b.tolist()} for a, b in zip(q, dq)])


def dofs_of(model):
    """The model's number of joints."""
    return 9 if model == "plant" else 7


def dynamics_of(answer, model):
    """Mass matrix and bias of a result of `faceoff sim kinematics`."""
    part = answer["plant"] if model == "plant" else answer
    return np.array(part["mass"]), np.array(part["bias"])


@pytest.mark.parametrize("model", MODELS)
class TestUrdfInPinocchio:
    """pinocchio 4, which reads URDF: frames to 1e-12 m, mass matrix and bias to 1e-10."""

    @pytest.fixture
    def robot(self, model):
        pin = pytest.importorskip("pinocchio")
        robot = pin.buildModelFromXML(exported_model("urdf", model))
        # URDF cannot describe rotors.
        armature = np.zeros(robot.nv)
        armature[:DRIVEN] = numbers.ARMATURE_KG_M2
        robot.armature = armature
        return pin, robot, robot.createData()

    def test_positions_mass_matrix_and_bias_agree(self, robot, model):
        pin, robot, data = robot
        assert robot.nq == dofs_of(model)
        q, dq = poses(100, robot.nq, seed=1)
        for pose, rate, answer in zip(q, dq, answers(q, dq)):
            pin.framesForwardKinematics(robot, data, pose)

            def frame(name):
                return data.oMf[robot.getFrameId(name)]

            for i in range(DRIVEN):
                link = frame(f"link_{i + 1}")
                np.testing.assert_allclose(link.translation, answer["links"][i], atol=1e-12)
                rotation = np.reshape(answer["rotations"][i], (3, 3))
                np.testing.assert_allclose(link.rotation, rotation, atol=1e-12)
            np.testing.assert_allclose(frame("end_effector").translation, answer["ee"], atol=1e-12)
            if model == "plant":
                mallet = frame("mallet").act(np.array([0.0, 0.0, numbers.MALLET_CYLINDER_Z_M]))
                np.testing.assert_allclose(mallet, answer["plant"]["mallet"], atol=1e-12)
            mass, bias = dynamics_of(answer, model)
            np.testing.assert_allclose(pin.crba(robot, data, pose), mass, atol=1e-10)
            np.testing.assert_allclose(pin.nle(robot, data, pose, rate), bias, atol=1e-10)

    def test_limits_and_friction_are_exported(self, robot, model):
        _, robot, _ = robot
        np.testing.assert_array_equal(robot.upperPositionLimit[:DRIVEN], numbers.POSITION_LIMIT_RAD)
        np.testing.assert_array_equal(-robot.lowerPositionLimit[:DRIVEN], numbers.POSITION_LIMIT_RAD)
        np.testing.assert_array_equal(robot.upperVelocityLimit[:DRIVEN], numbers.VELOCITY_LIMIT_RAD_S)
        np.testing.assert_array_equal(robot.upperEffortLimit[:DRIVEN], numbers.TORQUE_LIMIT_N_M)
        np.testing.assert_array_equal(robot.damping[:DRIVEN], numbers.DAMPING_N_M_S)
        np.testing.assert_array_equal(robot.friction[:DRIVEN], numbers.DRY_FRICTION_N_M)


def mass_of_mjcf(model):
    """The arm's mass, kg, in the exported MJCF, which also has the puck."""
    _, robot, _ = load(model)
    return sum(robot.body_mass) - numbers.PUCK_MASS_KG


@pytest.mark.parametrize("model", MODELS)
class TestUrdfInOtherReaders:
    """All load it with the mass of the MJCF; none finds a moving link without mass, or adds one."""

    def test_mujoco_finds_the_mass_matrix(self, model):
        mujoco = pytest.importorskip("mujoco")
        robot = mujoco.MjModel.from_xml_string(exported_model("urdf", model))
        data = mujoco.MjData(robot)
        assert sum(robot.body_mass) == pytest.approx(mass_of_mjcf(model), abs=1e-9)
        robot.dof_armature[:DRIVEN] = numbers.ARMATURE_KG_M2
        q, dq = poses(20, robot.nq, seed=4)
        for pose, rate, answer in zip(q, dq, answers(q, dq)):
            data.qpos[:], data.qvel[:] = pose, rate
            mujoco.mj_forward(robot, data)
            mass, _ = dynamics_of(answer, model)
            np.testing.assert_allclose(full_mass(mujoco, robot, data), mass, atol=1e-9)

    def test_pybullet_and_pinocchio_find_the_mass(self, model, tmp_path):
        bullet = pytest.importorskip("pybullet")
        pin = pytest.importorskip("pinocchio")
        path = tmp_path / "arm.urdf"
        path.write_text(exported_model("urdf", model))
        bullet.connect(bullet.DIRECT)
        try:
            robot = bullet.loadURDF(str(path), useFixedBase=True)
            links = range(-1, bullet.getNumJoints(robot))
            total = sum(bullet.getDynamicsInfo(robot, link)[0] for link in links)
        finally:
            bullet.disconnect()
        expected = mass_of_mjcf(model)
        assert total == pytest.approx(expected, abs=1e-9)
        assert pin.computeTotalMass(pin.buildModelFromXML(path.read_text())) == pytest.approx(expected, abs=1e-9)


def load(model="plant"):
    mujoco = pytest.importorskip("mujoco")
    loaded = mujoco.MjModel.from_xml_string(exported_model("mjcf", model))
    return mujoco, loaded, mujoco.MjData(loaded)


@pytest.mark.parametrize("model", MODELS)
def test_mujoco_finds_the_same_positions_mass_matrix_and_bias(model):
    """MuJoCo 4: positions to 1e-12 m, mass matrix and bias to 1e-10."""
    mujoco, robot, data = load(model)
    dofs = dofs_of(model)
    base = np.array([-numbers.BASE_X_M, 0.0, numbers.BASE_Z_M])
    assert robot.nq == dofs + 3, "the puck's x, y and yaw come last"
    q, dq = poses(100, dofs, seed=2)
    for pose, rate, answer in zip(q, dq, answers(q, dq)):
        data.qpos[:dofs], data.qvel[:dofs] = pose, rate
        mujoco.mj_forward(robot, data)
        for i in range(DRIVEN):
            link = data.body(f"link_{i + 1}")
            np.testing.assert_allclose(link.xpos - base, answer["links"][i], atol=1e-12)
            np.testing.assert_allclose(link.xmat, answer["rotations"][i], atol=1e-12)
        np.testing.assert_allclose(data.site("end_effector").xpos - base, answer["ee"], atol=1e-12)
        if model == "plant":
            mallet = data.geom("mallet").xpos - base
            np.testing.assert_allclose(mallet, answer["plant"]["mallet"], atol=1e-12)
        mass, bias = dynamics_of(answer, model)
        np.testing.assert_allclose(full_mass(mujoco, robot, data)[:dofs, :dofs], mass, atol=1e-10)
        np.testing.assert_allclose(data.qfrc_bias[:dofs], bias, atol=1e-10)


def full_mass(mujoco, robot, data):
    """The mass matrix, computed by multiplication with unit vectors: MuJoCo's own layout is internal."""
    columns = []
    for unit in np.eye(robot.nv):
        column = np.zeros(robot.nv)
        mujoco.mj_mulM(robot, data, column, unit)
        columns.append(column)
    return np.array(columns)


def test_key_frame_is_the_start_pose():
    mujoco, robot, data = load()
    mujoco.mj_resetDataKeyframe(robot, data, robot.key("start").id)
    np.testing.assert_array_equal(data.qpos[:DRIVEN], numbers.START_Q)
    mujoco.mj_forward(robot, data)
    ee = data.site("end_effector").xpos + [numbers.BASE_X_M, 0.0, -numbers.BASE_Z_M]
    np.testing.assert_allclose(ee, [0.65, 0.0, numbers.EE_DESIRED_HEIGHT_M], atol=1e-4)
    np.testing.assert_allclose(data.geom("mallet").xmat.reshape(3, 3)[:, 2], [0, 0, -1], atol=1e-9)
    state = trace({"puck": [0, 0, 0, 0, 0, 0], "duration_ms": 1})[0]
    np.testing.assert_allclose(data.qpos[DRIVEN:9], state["universal"][0], atol=1e-9)


class UniversalController:
    """The controller of the universal joint as in docs/robot.md, on MuJoCo's state."""

    def __init__(self):
        self.filtered = np.zeros(2)

    def torque(self, rotation, angle, rate):
        """Torques of both hinges for the end effector's rotation and the hinges' angles and speeds."""
        new = numbers.UNIVERSAL_FILTER_NEW
        self.filtered = new * rate + (1.0 - new) * self.filtered
        desired = np.clip(self.upright(rotation), -numbers.UNIVERSAL_RANGE_RAD, numbers.UNIVERSAL_RANGE_RAD)
        torque = numbers.UNIVERSAL_KP_N_M * (desired - angle) - numbers.UNIVERSAL_KD_N_M_S * self.filtered
        limit = numbers.UNIVERSAL_TORQUE_LIMIT_N_M
        return np.clip(torque, -limit, limit)

    @staticmethod
    def upright(rotation):
        """Angles of both hinges at which the mallet is vertical."""
        x, y = rotation[:, 0], rotation[:, 1]

        def angle(a, b, axis):
            return math.atan2(np.cross(a, b) @ axis, a @ b)

        first = angle(x, np.array([-y[1], y[0], 0.0]), y)
        cross = np.array([[0, -y[2], y[1]], [y[2], 0, -y[0]], [-y[1], y[0], 0]])
        turned = x + math.sin(first) * cross @ x + (1 - math.cos(first)) * (cross * cross) @ x
        return np.array([first, angle(y, np.array([turned[1], -turned[0], 0.0]), turned)])


def test_arm_motion_in_mujoco_agrees():
    """One second under the torques of the simulator's controller: joints within 1e-6 rad, universal joint too."""
    rng = np.random.default_rng(3)
    steps, amplitude = 50, rng.uniform(0.1, 0.4, DRIVEN)
    frequency_rad_s = rng.uniform(3.0, 6.0, DRIVEN)
    t = 0.02 * np.arange(1, steps + 1)[:, None]
    q = np.array(numbers.START_Q) + amplitude * (1 - np.cos(frequency_rad_s * t)) / 2
    dq = amplitude * frequency_rad_s * np.sin(frequency_rad_s * t) / 2
    scenario = {
        "puck": [0.8, 0.4, 0, 0, 0, 0],
        "duration_ms": 20 * steps,
        "interpolation": [3],
        "actions": [np.stack([q, dq], axis=1).tolist()],
    }
    simulated = trace(scenario)
    mujoco, robot, data = load()
    mujoco.mj_resetDataKeyframe(robot, data, robot.key("start").id)
    data.qpos[7:9] = simulated[0]["universal"][0]
    data.qpos[9:] = scenario["puck"][:3]
    universal = UniversalController()
    max_difference = np.zeros(2)
    for state in simulated[1:]:
        mujoco.mj_kinematics(robot, data)
        rotation = data.body("end_effector").xmat.reshape(3, 3)
        data.ctrl[:DRIVEN] = state["torque"][0]
        data.ctrl[DRIVEN:] = universal.torque(rotation, data.qpos[7:9], data.qvel[7:9])
        mujoco.mj_step(robot, data)
        max_difference[0] = max(max_difference[0], np.abs(data.qpos[:7] - state["q"][0]).max())
        max_difference[1] = max(max_difference[1], np.abs(data.qpos[7:9] - state["universal"][0]).max())
    moved = np.abs(np.array(simulated[-1]["q"][0]) - numbers.START_Q)
    print("moved", moved, "differences", max_difference)
    assert moved.max() > 0.1
    assert max_difference.max() < 1e-6


def test_sliding_puck_in_mujoco_agrees():
    """Half a second without contacts: within 1e-9 m."""
    scenario = {"puck": [-0.4, 0.1, 0.2, 1.0, 0.3, 4.0], "duration_ms": 500}
    last = trace(scenario)[-1]["puck"]
    mujoco, robot, data = load()
    data.qpos[9:], data.qvel[9:] = scenario["puck"][:3], scenario["puck"][3:]
    for _ in range(500):
        mujoco.mj_step(robot, data)
    np.testing.assert_allclose([*data.qpos[9:], *data.qvel[9:]], last, atol=1e-9)


@pytest.mark.parametrize("vy", [0.8, 1.5, 2.5])
def test_bounce_off_a_long_rim_in_mujoco_agrees_roughly(vy):
    """The contact law is the same: velocity after the bounce within 2 % of the speed before."""
    scenario = {"puck": [0.2, 0.4, 0.0, 0.5, vy, 0.0], "duration_ms": 200}
    simulated = trace(scenario)[-1]["puck"]
    mujoco, robot, data = load()
    data.qpos[9:], data.qvel[9:] = scenario["puck"][:3], scenario["puck"][3:]
    for _ in range(200):
        mujoco.mj_step(robot, data)
    assert simulated[4] < 0.0, "the puck must bounce"
    difference = np.array(simulated[3:5]) - data.qvel[9:11]
    print(simulated, data.qvel[9:], difference)
    assert np.linalg.norm(difference) < 0.02 * math.hypot(0.5, vy)


DOCUMENT = (REPOSITORY / "docs" / "robot.md").read_text()


def test_document_describes_the_universal_joint_controller():
    """The simulator's tests check the other numbers of the page."""
    text = " ".join(DOCUMENT.split())
    for sentence in (
        f"{numbers.UNIVERSAL_KP_N_M:g} N m/rad times the remaining angle",
        f"minus {numbers.UNIVERSAL_KD_N_M_S:g} N m s/rad times the hinge's speed",
        f"with {numbers.UNIVERSAL_FILTER_NEW:g} of the newest",
        f"at most {numbers.UNIVERSAL_TORQUE_LIMIT_N_M:g} N m",
        f"within ±{numbers.UNIVERSAL_RANGE_RAD / (math.pi / 2):g}·π/2",
        f"{numbers.LIMITER_GAIN_PER_S:g} per second times the distance left to the stop",
        f"Elbow and wrist (the origins of links 4 and 7): above {numbers.LINK_HEIGHT_M:g} m",
        f"{100 * numbers.EE_HEIGHT_TOLERANCE_M:g} cm more or less",
    ):
        assert sentence in text, sentence


def test_document_programs_run(tmp_path, monkeypatch):
    pytest.importorskip("pinocchio")
    pytest.importorskip("mujoco")
    (tmp_path / "robot.urdf").write_text(exported_model("urdf"))
    (tmp_path / "robot.xml").write_text(exported_model("mjcf"))
    monkeypatch.chdir(tmp_path)
    programs = [part.split("```")[0] for part in DOCUMENT.split("```python\n")[1:]]
    assert len(programs) == 2
    for program in programs:
        exec(compile(program, "docs/robot.md", "exec"), {})


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("format_", ["urdf", "mjcf"])
def test_exported_files_need_no_other_files(format_, model):
    tags = {element.tag for element in ET.fromstring(exported_model(format_, model)).iter()}
    assert not tags & {"mesh", "include", "texture", "asset"}


def test_generated_files_equal_the_export():
    """After a change of the model, regenerate them: faceoff sim export --format … --out …"""
    package = REPOSITORY / "crates" / "faceoff-py" / "python" / "faceoff" / "kinematics"
    assert (package / "model.py").read_text() == exported_model("python")
    assert (REPOSITORY / "docs" / "images" / "robot.svg").read_text() == exported_model("svg")
    ET.fromstring(exported_model("svg"))


def test_out_option_writes_the_printed_export(tmp_path):
    for format_ in ("urdf", "mjcf", "python", "svg"):
        out = tmp_path / format_
        assert faceoff("sim", "export", "--format", format_, "--out", str(out)) == ""
        assert out.read_text() == exported_model(format_)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--format", "stl"], "urdf, mjcf, python, svg"),
        ([], "--format"),
        (["--format", "urdf", "--model", "ideal"], "plant, controller"),
        (["--format", "svg", "--model", "controller"], "expected --format urdf or mjcf"),
        (["--format", "urdf", "--out", "/nowhere/robot.urdf"], "--out /nowhere/robot.urdf"),
    ],
)
def test_invalid_options_are_refused(options, message):
    done = subprocess.run([PROGRAM, "sim", "export", *options], capture_output=True, text=True)
    assert done.returncode != 0 and message in done.stderr, done.stderr
    assert done.stdout == ""
