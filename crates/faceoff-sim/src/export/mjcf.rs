//! Export of arm, table and puck as MJCF, MuJoCo's XML format, with the constants of the contacts.

use super::{
    numbers::{spaced, tidy},
    parts::{ExportedModel, end_of_link, level_mallet_angles, quaternion, vector, visual_radius_m},
};
use crate::{
    model::{GRAVITY_M_S2, INITIAL_Q, JOINTS, LINKS, SUBSTEP_S, TOOL},
    robot::universal_joint::TORQUE_LIMIT_N_M,
    table::{
        contact_law::{FULL_IMPEDANCE_DEPTH_M, JOINT, MALLET, Material, RIM},
        frames::table_from_robot,
        geometry::{PUCK, TABLE},
    },
};
use std::{f64::consts::FRAC_PI_2, fmt::Write as _};

/// Robot 1, table and puck as MJCF, in the table frame. Joints in order: `joint_1` … `joint_7`, of the plant
/// `universal_y` and `universal_x`, then `puck_x`, `puck_y`, `puck_yaw`; a motor (N m) for each joint of the
/// arm; the key frame `start` has the arm in its start pose and the puck in the middle. SI units, radians.
#[must_use]
pub fn mjcf(model: ExportedModel) -> String {
    let mut out = String::new();
    write(model, &mut out).expect("writing to a string cannot fail");
    out
}

fn write(model: ExportedModel, out: &mut String) -> std::fmt::Result {
    writeln!(
        out,
        "<!-- Written by `faceoff sim export`. SI units, radians. -->"
    )?;
    writeln!(out, "<mujoco model=\"faceoff\">")?;
    writeln!(
        out,
        "  <compiler angle=\"radian\" inertiafromgeom=\"false\"/>\n  \
         <option timestep=\"{SUBSTEP_S}\" gravity=\"0 0 {}\" integrator=\"Euler\" cone=\"elliptic\"/>",
        -GRAVITY_M_S2
    )?;
    // Contacts are off by default (`contype`, `conaffinity`); only the pairs at the end of the file have contacts.
    writeln!(
        out,
        "  <default>\n    <geom contype=\"0\" conaffinity=\"0\" rgba=\"0.6 0.6 0.65 1\"/>\n    \
         <default class=\"driven\"><joint type=\"hinge\" axis=\"0 0 1\" limited=\"true\" \
         solreffriction=\"{solref}\" solimpfriction=\"{solimp}\" solreflimit=\"{solref}\" \
         solimplimit=\"{solimp}\"/></default>\n    \
         <default class=\"rim\"><geom rgba=\"0.35 0.25 0.2 1\"/></default>\n  </default>",
        solref = solref(&JOINT),
        solimp = solimp(&JOINT),
    )?;
    writeln!(out, "  <worldbody>")?;
    writeln!(
        out,
        "    <light pos=\"0 0 3\" dir=\"0 0 -1\" directional=\"true\"/>"
    )?;
    let rims = table(out)?;
    arm_and_puck(model, out)?;
    writeln!(out, "  </worldbody>")?;
    pairs(model, &rims, out)?;
    motors(model, out)?;
    let mut pose = INITIAL_Q.to_vec();
    if model == ExportedModel::Plant {
        pose.extend(level_mallet_angles(&INITIAL_Q));
    }
    pose.extend([0.0; 3]);
    writeln!(
        out,
        "  <keyframe>\n    <key name=\"start\" qpos=\"{}\"/>\n  </keyframe>\n</mujoco>",
        spaced(&pose)
    )
}

/// Writes the surface and the rims (walls around the table); returns the names of the rims' parts.
fn table(out: &mut String) -> Result<Vec<String>, std::fmt::Error> {
    const SURFACE_HALF_THICKNESS_M: f64 = 0.01;
    let (half_length, half_width) = (TABLE.half_length_m(), TABLE.half_width_m());
    let (thickness, post) = (TABLE.rim_thickness_m, TABLE.post_radius_m);
    let outer_x = half_length + thickness;
    let half_height = PUCK.height_m;
    writeln!(
        out,
        "    <geom name=\"surface\" type=\"box\" pos=\"0 0 {}\" size=\"{}\" rgba=\"0.9 0.9 0.92 1\"/>",
        -SURFACE_HALF_THICKNESS_M,
        spaced(&[
            tidy(outer_x),
            tidy(half_width + thickness),
            SURFACE_HALF_THICKNESS_M
        ]),
    )?;
    let mut names = Vec::new();
    let mut rim = |out: &mut String, name: String, kind: &str, centre: [f64; 2], size: &[f64]| {
        let mut size = size.to_vec();
        size.push(half_height);
        let [x, y] = centre;
        let written = writeln!(
            out,
            "    <geom name=\"{name}\" class=\"rim\" type=\"{kind}\" pos=\"{}\" size=\"{}\"/>",
            spaced(&[x, y, half_height].map(tidy)),
            spaced(&size.into_iter().map(tidy).collect::<Vec<_>>()),
        );
        names.push(name);
        written
    };
    for (side, name_suffix) in [(1.0, "left"), (-1.0, "right")] {
        let y = side * (half_width + thickness / 2.0);
        rim(
            out,
            format!("rim_{name_suffix}"),
            "box",
            [0.0, y],
            &[outer_x, thickness / 2.0],
        )?;
    }
    // The end of a short rim at the goal is rounded: a box, a smaller box and a cylinder at each corner.
    let mouth = TABLE.goal_width_m / 2.0;
    let (box_y, box_half) = middle_and_half(mouth + post, half_width);
    for (end, near) in [(1.0, "far"), (-1.0, "near")] {
        for (side, name_suffix) in [(1.0, "left"), (-1.0, "right")] {
            let name = |part: &str| format!("rim_{near}_{name_suffix}{part}");
            let x = end * (half_length + thickness / 2.0);
            rim(
                out,
                name(""),
                "box",
                [x, side * box_y],
                &[thickness / 2.0, box_half],
            )?;
            let lip_size = [thickness / 2.0 - post, post / 2.0];
            rim(
                out,
                name("_lip"),
                "box",
                [x, side * (mouth + post / 2.0)],
                &lip_size,
            )?;
            for (part, x) in [
                ("_post", end * (half_length + post)),
                ("_post_outside", end * (outer_x - post)),
            ] {
                rim(
                    out,
                    name(part),
                    "cylinder",
                    [x, side * (mouth + post)],
                    &[post],
                )?;
            }
        }
    }
    Ok(names)
}

/// Middle and half length of an interval.
fn middle_and_half(from: f64, to: f64) -> (f64, f64) {
    ((from + to) / 2.0, (to - from) / 2.0)
}

/// Writes the arm and then the puck, so that the arm's joints come first.
fn arm_and_puck(model: ExportedModel, out: &mut String) -> std::fmt::Result {
    let base = table_from_robot(0, [0.0; 3]).map(tidy);
    writeln!(out, "    <body name=\"base\" pos=\"{}\">", spaced(&base))?;
    visual_capsule(out, vector(LINKS[0].offset), visual_radius_m(0))?;
    for (i, link) in LINKS.iter().enumerate() {
        writeln!(
            out,
            "    <body name=\"link_{}\" pos=\"{}\" quat=\"{}\">",
            i + 1,
            spaced(&vector(link.offset)),
            spaced(&quaternion(link.mount)),
        )?;
        writeln!(
            out,
            "      <joint name=\"joint_{}\" class=\"driven\" range=\"{} {}\" damping=\"{}\" frictionloss=\"{}\" \
             armature=\"{}\"/>",
            i + 1,
            -link.range_rad,
            link.range_rad,
            link.damping,
            link.friction_n_m,
            link.armature_kg_m2,
        )?;
        writeln!(
            out,
            "      <inertial pos=\"{}\" mass=\"{}\" fullinertia=\"{}\"/>",
            spaced(&link.centre_m),
            link.mass_kg,
            spaced(&link.inertia_kg_m2),
        )?;
        visual_capsule(out, end_of_link(i), visual_radius_m(i))?;
    }
    let ee = end_of_link(JOINTS - 1);
    writeln!(
        out,
        "    <body name=\"end_effector\" pos=\"{}\">",
        spaced(&ee)
    )?;
    isotropic(
        out,
        0.0,
        TOOL.end_effector_mass_kg,
        TOOL.end_effector_inertia_kg_m2,
    )?;
    writeln!(out, "      <site name=\"end_effector\" size=\"0.01\"/>")?;
    if model == ExportedModel::Plant {
        mallet(out)?;
    }
    writeln!(out, "    {}", "</body>".repeat(JOINTS + 2))?;
    puck(out)
}

/// Writes the mallet on its two hinges.
fn mallet(out: &mut String) -> std::fmt::Result {
    writeln!(out, "    <body name=\"mallet\">")?;
    for (name, axis) in [("universal_y", "0 1 0"), ("universal_x", "1 0 0")] {
        writeln!(
            out,
            "      <joint name=\"{name}\" type=\"hinge\" axis=\"{axis}\" limited=\"true\" range=\"{} {FRAC_PI_2}\" \
             solreflimit=\"{}\" solimplimit=\"{}\"/>",
            -FRAC_PI_2,
            solref(&JOINT),
            solimp(&JOINT),
        )?;
    }
    isotropic(
        out,
        TOOL.mallet_centre_z_m,
        TOOL.mallet_mass_kg,
        TOOL.mallet_inertia_kg_m2,
    )?;
    writeln!(
        out,
        "      <geom name=\"mallet\" type=\"cylinder\" pos=\"0 0 {}\" size=\"{} {}\" rgba=\"0.8 0.2 0.2 1\"/>",
        TOOL.cylinder_centre_z_m, TOOL.cylinder_radius_m, TOOL.cylinder_half_height_m
    )?;
    writeln!(out, "    </body>")
}

/// Writes the puck. It neither rises nor tips, so only its yaw inertia matters.
fn puck(out: &mut String) -> std::fmt::Result {
    writeln!(out, "    <body name=\"puck\">")?;
    for (name, kind, axis, damping) in [
        ("puck_x", "slide", "1 0 0", PUCK.damping),
        ("puck_y", "slide", "0 1 0", PUCK.damping),
        ("puck_yaw", "hinge", "0 0 1", PUCK.yaw_damping),
    ] {
        writeln!(
            out,
            "      <joint name=\"{name}\" type=\"{kind}\" axis=\"{axis}\" damping=\"{damping}\"/>"
        )?;
    }
    isotropic(out, 0.0, PUCK.mass_kg, PUCK.inertia_kg_m2)?;
    let half_height = PUCK.height_m / 2.0;
    writeln!(
        out,
        "      <geom name=\"puck\" type=\"cylinder\" pos=\"0 0 {half_height}\" size=\"{} {half_height}\" \
         rgba=\"0.1 0.1 0.1 1\"/>",
        PUCK.radius_m
    )?;
    writeln!(out, "    </body>")
}

/// Writes a body's inertia: centre of mass at height `z` (m), mass (kg), inertia about every axis (kg m²).
fn isotropic(out: &mut String, z: f64, mass: f64, inertia: f64) -> std::fmt::Result {
    writeln!(
        out,
        "      <inertial pos=\"0 0 {z}\" mass=\"{mass}\" diaginertia=\"{inertia} {inertia} {inertia}\"/>"
    )
}

/// Writes a capsule for display, from the body's origin to `end`, m.
fn visual_capsule(out: &mut String, end: [f64; 3], radius: f64) -> std::fmt::Result {
    writeln!(
        out,
        "      <geom type=\"capsule\" fromto=\"0 0 0 {}\" size=\"{radius}\"/>",
        spaced(&end)
    )
}

/// Writes the pairs of bodies that can be in contact with the puck.
fn pairs(model: ExportedModel, rims: &[String], out: &mut String) -> std::fmt::Result {
    writeln!(out, "  <contact>")?;
    let mut pair = |other: &str, material: &Material| {
        let mu = material.friction;
        writeln!(
            out,
            "    <pair geom1=\"{other}\" geom2=\"puck\" condim=\"3\" friction=\"{mu} {mu}\" solref=\"{}\" \
             solimp=\"{}\"/>",
            solref(material),
            solimp(material)
        )
    };
    for name in rims {
        pair(name, &RIM)?;
    }
    if model == ExportedModel::Plant {
        pair("mallet", &MALLET)?;
    }
    writeln!(out, "  </contact>")
}

/// Writes a motor for each joint of the arm.
fn motors(model: ExportedModel, out: &mut String) -> std::fmt::Result {
    writeln!(out, "  <actuator>")?;
    let mut motor = |joint: &str, limit: f64| {
        writeln!(
            out,
            "    <motor name=\"{joint}\" joint=\"{joint}\" ctrllimited=\"true\" ctrlrange=\"{} {limit}\"/>",
            -limit
        )
    };
    for (i, link) in LINKS.iter().enumerate() {
        motor(&format!("joint_{}", i + 1), link.torque_limit_n_m)?;
    }
    if model == ExportedModel::Plant {
        motor("universal_y", TORQUE_LIMIT_N_M)?;
        motor("universal_x", TORQUE_LIMIT_N_M)?;
    }
    writeln!(out, "  </actuator>")
}

/// The attribute `solref`: a material's time constant, s, and damping ratio. MuJoCo derives damping and stiffness from them.
fn solref(material: &Material) -> String {
    let final_impedance = material.impedance_1;
    let time_constant_s = 2.0 / (final_impedance * material.damping_per_s);
    let damping_ratio =
        1.0 / (final_impedance * time_constant_s * material.stiffness_per_s2.sqrt());
    spaced(&[time_constant_s, damping_ratio].map(tidy))
}

/// The attribute `solimp`: impedance at depth 0, final impedance, the depth (m) at which it is reached, and the shape in between: a
/// quadratic spline around the middle.
fn solimp(material: &Material) -> String {
    spaced(&[
        material.impedance_0,
        material.impedance_1,
        FULL_IMPEDANCE_DEPTH_M,
        0.5,
        2.0,
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn materials_convert_to_mujoco_parameters() {
        assert_eq!(solref(&RIM), "0.0075 0.1");
        assert_eq!(solref(&MALLET), "0.02 0.3");
        assert_eq!(solref(&JOINT), "0.02 1");
        assert_eq!(solimp(&RIM), "0.99 0.999 0.001 0.5 2");
    }

    #[test]
    fn controller_model_has_no_mallet() {
        let (plant, controller) = (mjcf(ExportedModel::Plant), mjcf(ExportedModel::Controller));
        assert!(plant.contains("universal_x") && plant.contains("geom1=\"mallet\""));
        assert!(!controller.contains("universal") && !controller.contains("mallet"));
        for text in [plant, controller] {
            assert_eq!(
                text.matches("<body").count(),
                text.matches("</body>").count()
            );
        }
    }
}
