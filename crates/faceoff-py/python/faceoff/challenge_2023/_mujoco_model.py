"""`robot_model` and `robot_data`: MuJoCo's objects where MuJoCo is installed, else stand-ins."""

from __future__ import annotations

from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from faceoff.challenge_2023._stand_ins import RobotData, RobotModel
from faceoff.errors import ArgumentTypeError
from faceoff.kinematics import model


def robot_objects() -> tuple[Any, Any]:
    """`MjModel` and `MjData` of the arm without the mallet, its base at the origin; without MuJoCo their stand-ins.

    Names are those of 2023: bodies `iiwa_1/base`, `iiwa_1/link_1` … and `iiwa_1/striker_joint_link`, joints
    `iiwa_1/joint_1` ….
    """
    try:
        import mujoco
    except ImportError:
        return RobotModel(), RobotData()
    robot_model = mujoco.MjModel.from_xml_string(_mjcf())
    return robot_model, mujoco.MjData(robot_model)


def check_robot(mj_model: Any, mj_data: Any) -> None:
    """Refuses other arguments than `robot_model` and `robot_data`."""
    for name, value, stand_in, kind, key in (
        ("mj_model", mj_model, RobotModel, "MjModel", "robot_model"),
        ("mj_data", mj_data, RobotData, "MjData", "robot_data"),
    ):
        # By the name of the class: MuJoCo may not be installed.
        if not isinstance(value, stand_in) and type(value).__name__ != kind:
            raise ArgumentTypeError(
                f"{name}: expected env_info['robot']['{key}'], got {type(value).__name__}; give "
                "robot_model and robot_data"
            )


def update_positions(mj_model: Any, mj_data: Any) -> None:
    """Computes positions of all bodies in MuJoCo's object, as the functions of 2023 did; a stand-in has none."""
    if not isinstance(mj_data, RobotData):
        import mujoco

        mujoco.mj_fwdPosition(mj_model, mj_data)


def _mjcf() -> str:
    """The controller's model of the arm as MJCF."""
    bodies, motors = "", ""
    for joint in range(model.JOINTS):
        name = f"iiwa_1/joint_{joint + 1}"
        limit, torque = model.POSITION_LIMIT_RAD[joint], model.TORQUE_LIMIT_N_M[joint]
        bodies += (
            _element("body", name=f"iiwa_1/link_{joint + 1}", pos=model.LINK_OFFSET_M[joint], xyaxes=_axes(joint))
            + _element(
                "inertial",
                pos=model.CENTRE_OF_MASS_M[joint],
                mass=model.MASS_KG[joint],
                fullinertia=model.INERTIA_KG_M2[joint],
                end="/",
            )
            + _element(
                "joint",
                name=name,
                axis=(0, 0, 1),
                range=(-limit, limit),
                damping=model.DAMPING_N_M_S[joint],
                frictionloss=model.DRY_FRICTION_N_M[joint],
                armature=model.ARMATURE_KG_M2[joint],
                end="/",
            )
        )
        motors += _element("motor", name=name, joint=name, ctrlrange=(-torque, torque), end="/")
    inertia = model.END_EFFECTOR_INERTIA_KG_M2
    bodies += _element("body", name="iiwa_1/striker_joint_link", pos=(0, 0, model.END_EFFECTOR_Z_M)) + _element(
        "inertial", pos=(0, 0, 0), mass=model.END_EFFECTOR_MASS_KG, diaginertia=(inertia,) * 3, end="/"
    )
    compiler = _element("compiler", angle="radian", autolimits="true", end="/")
    option = _element("option", timestep=model.SUBSTEP_S, gravity=(0, 0, -model.GRAVITY_M_S2), end="/")
    base = _element("body", name="iiwa_1/base")
    arm = base + bodies + "</body>" * (model.JOINTS + 2)
    return f"<mujoco>{compiler}{option}<worldbody>{arm}</worldbody><actuator>{motors}</actuator></mujoco>"


def _axes(joint: int) -> tuple[float, ...]:
    """The first two axes of a link in its parent."""
    mount = np.array(model.LINK_MOUNT[joint])
    return tuple(mount[:, :2].T.ravel().tolist())


def _element(tag: str, end: str = "", **attributes: object) -> str:
    def text(value: object) -> str:
        return " ".join(map(repr, value)) if isinstance(value, tuple) else str(value)

    words = " ".join(f"{name}={quoteattr(text(value))}" for name, value in attributes.items())
    return f"<{tag} {words}{end}>"
