//! Export of the arm as URDF, the XML robot description of ROS: the arm alone, on its base frame.

use super::{
    numbers::{spaced, tidy},
    parts::{ExportedModel, end_of_link, roll_pitch_yaw, vector, visual_radius_m},
};
use crate::{
    model::{JOINTS, LINKS, TOOL},
    robot::universal_joint::TORQUE_LIMIT_N_M,
};
use std::{f64::consts::FRAC_PI_2, fmt::Write as _};

/// Mass and inertia of the link between the two hinges of the universal joint, which the simulator does not have. Readers need some: MuJoCo
/// refuses a moving link without mass, and PyBullet gives it 1 kg. They change the mass matrix by less than 1e-10.
const UNIVERSAL_MASS_KG: f64 = 1e-11;
const UNIVERSAL_INERTIA_KG_M2: f64 = 1e-14;

/// The arm as URDF 1.0: links `base`, `link_1` … `link_7`, `end_effector` and, of the plant, `mallet`; joints
/// `joint_1` … `joint_7`, `universal_y`, `universal_x`. Its root is the robot's base frame. SI units, radians.
///
/// URDF has no rotor inertia: a comment states [`crate::model::Link::armature_kg_m2`] of joint 7.
#[must_use]
pub fn urdf(model: ExportedModel) -> String {
    let mut out = String::new();
    write(model, &mut out).expect("writing to a string cannot fail");
    out
}

fn write(model: ExportedModel, out: &mut String) -> std::fmt::Result {
    writeln!(out, "<?xml version=\"1.0\"?>")?;
    writeln!(
        out,
        "<!-- Written by `faceoff sim export`. SI units, radians. -->"
    )?;
    for (i, link) in LINKS.iter().enumerate() {
        if link.armature_kg_m2 != 0.0 {
            writeln!(
                out,
                "<!-- Not part of URDF: the rotor of joint_{} adds {} kg m² to the inertia about it. -->",
                i + 1,
                link.armature_kg_m2
            )?;
        }
    }
    writeln!(out, "<robot name=\"faceoff_iiwa\">")?;
    writeln!(out, "  <link name=\"base\">")?;
    visual_cylinder(out, vector(LINKS[0].offset), visual_radius_m(0))?;
    writeln!(out, "  </link>")?;
    for i in 0..JOINTS {
        driven_joint(out, i)?;
        link(out, i)?;
    }
    writeln!(out, "  <joint name=\"tool\" type=\"fixed\">")?;
    origin(out, end_of_link(JOINTS - 1), [0.0; 3])?;
    ends(out, "link_7", "end_effector")?;
    writeln!(out, "  </joint>")?;
    writeln!(out, "  <link name=\"end_effector\">")?;
    let ee = TOOL.end_effector_inertia_kg_m2;
    inertial(
        out,
        TOOL.end_effector_mass_kg,
        [0.0; 3],
        [ee, ee, ee, 0.0, 0.0, 0.0],
    )?;
    writeln!(out, "  </link>")?;
    if model == ExportedModel::Plant {
        universal_joint(out)?;
    }
    writeln!(out, "</robot>")
}

/// Writes joint `i` (0…6).
fn driven_joint(out: &mut String, i: usize) -> std::fmt::Result {
    let link = &LINKS[i];
    let parent = match i {
        0 => "base".to_owned(),
        _ => format!("link_{i}"),
    };
    writeln!(out, "  <joint name=\"joint_{}\" type=\"revolute\">", i + 1)?;
    origin(out, vector(link.offset), roll_pitch_yaw(link.mount))?;
    ends(out, &parent, &format!("link_{}", i + 1))?;
    writeln!(out, "    <axis xyz=\"0 0 1\"/>")?;
    limit(
        out,
        link.range_rad,
        link.torque_limit_n_m,
        link.velocity_limit_rad_s,
    )?;
    writeln!(
        out,
        "    <dynamics damping=\"{}\" friction=\"{}\"/>",
        link.damping, link.friction_n_m
    )?;
    writeln!(out, "  </joint>")
}

/// Writes link `i` (0…6).
fn link(out: &mut String, i: usize) -> std::fmt::Result {
    let link = &LINKS[i];
    writeln!(out, "  <link name=\"link_{}\">", i + 1)?;
    inertial(out, link.mass_kg, link.centre_m, link.inertia_kg_m2)?;
    visual_cylinder(out, end_of_link(i), visual_radius_m(i))?;
    writeln!(out, "  </link>")
}

/// Writes the universal joint and the mallet: a hinge about the end effector's y carries a hinge about the rotated x, which carries the
/// mallet.
fn universal_joint(out: &mut String) -> std::fmt::Result {
    for (axis, parent, child) in [
        ("y", "end_effector", "universal"),
        ("x", "universal", "mallet"),
    ] {
        writeln!(out, "  <joint name=\"universal_{axis}\" type=\"revolute\">")?;
        origin(out, [0.0; 3], [0.0; 3])?;
        ends(out, parent, child)?;
        let direction = if axis == "y" { "0 1 0" } else { "1 0 0" };
        writeln!(out, "    <axis xyz=\"{direction}\"/>")?;
        // Its speed has no limit, but URDF requires a number.
        limit(out, FRAC_PI_2, TORQUE_LIMIT_N_M, 1000.0)?;
        writeln!(out, "  </joint>")?;
        if child == "universal" {
            writeln!(out, "  <link name=\"universal\">")?;
            let i = UNIVERSAL_INERTIA_KG_M2;
            inertial(out, UNIVERSAL_MASS_KG, [0.0; 3], [i, i, i, 0.0, 0.0, 0.0])?;
            writeln!(out, "  </link>")?;
        }
    }
    writeln!(out, "  <link name=\"mallet\">")?;
    let i = TOOL.mallet_inertia_kg_m2;
    inertial(
        out,
        TOOL.mallet_mass_kg,
        [0.0, 0.0, TOOL.mallet_centre_z_m],
        [i, i, i, 0.0, 0.0, 0.0],
    )?;
    for kind in ["visual", "collision"] {
        cylinder(
            out,
            kind,
            [0.0, 0.0, TOOL.cylinder_centre_z_m],
            [0.0; 3],
            (TOOL.cylinder_radius_m, 2.0 * TOOL.cylinder_half_height_m),
        )?;
    }
    writeln!(out, "  </link>")
}

/// Writes a frame's position (m) and roll, pitch and yaw (rad).
fn origin(out: &mut String, xyz: [f64; 3], rpy: [f64; 3]) -> std::fmt::Result {
    writeln!(
        out,
        "    <origin xyz=\"{}\" rpy=\"{}\"/>",
        spaced(&xyz),
        spaced(&rpy)
    )
}

/// Writes the two links that a joint connects.
fn ends(out: &mut String, parent: &str, child: &str) -> std::fmt::Result {
    writeln!(out, "    <parent link=\"{parent}\"/>")?;
    writeln!(out, "    <child link=\"{child}\"/>")
}

/// Writes a joint's limits: range ±, rad, effort ±, N m, velocity ±, rad/s.
fn limit(out: &mut String, range: f64, effort: f64, velocity: f64) -> std::fmt::Result {
    writeln!(
        out,
        "    <limit lower=\"{}\" upper=\"{range}\" effort=\"{effort}\" velocity=\"{velocity}\"/>",
        -range
    )
}

/// Writes mass (kg), centre of mass (m) and inertia about it (kg m²; xx, yy, zz, xy, xz, yz).
fn inertial(out: &mut String, mass: f64, centre: [f64; 3], inertia: [f64; 6]) -> std::fmt::Result {
    let [xx, yy, zz, xy, xz, yz] = inertia;
    writeln!(out, "    <inertial>")?;
    writeln!(
        out,
        "      <origin xyz=\"{}\" rpy=\"0 0 0\"/>",
        spaced(&centre)
    )?;
    writeln!(out, "      <mass value=\"{mass}\"/>")?;
    writeln!(
        out,
        "      <inertia ixx=\"{xx}\" iyy=\"{yy}\" izz=\"{zz}\" ixy=\"{xy}\" ixz=\"{xz}\" iyz=\"{yz}\"/>"
    )?;
    writeln!(out, "    </inertial>")
}

/// Writes a cylinder for display, from the link's origin to the point `end` on its y or z axis, m.
fn visual_cylinder(out: &mut String, end: [f64; 3], radius: f64) -> std::fmt::Result {
    let along_y = end[1] != 0.0;
    let rpy = [if along_y { FRAC_PI_2 } else { 0.0 }, 0.0, 0.0];
    let middle = end.map(|x| tidy(x / 2.0));
    cylinder(out, "visual", middle, rpy, (radius, end[1] + end[2]))
}

/// Writes a cylinder; `kind` is `visual` or `collision`, lengths are in m, `rpy` is in rad.
fn cylinder(
    out: &mut String,
    kind: &str,
    centre: [f64; 3],
    rpy: [f64; 3],
    (radius, length): (f64, f64),
) -> std::fmt::Result {
    writeln!(out, "    <{kind}>")?;
    writeln!(
        out,
        "      <origin xyz=\"{}\" rpy=\"{}\"/>",
        spaced(&centre),
        spaced(&rpy)
    )?;
    writeln!(
        out,
        "      <geometry><cylinder radius=\"{radius}\" length=\"{length}\"/></geometry>"
    )?;
    writeln!(out, "    </{kind}>")
}
