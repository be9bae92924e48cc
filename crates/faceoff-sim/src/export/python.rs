//! Export of the nominal model's constants as a Python module, each with a comment.

use super::parts::{level_mallet_angles, rotation, vector};
use crate::{
    episode::{
        constraints::{HEIGHT_TOLERANCE_M, LINK_HEIGHT_M},
        env_info::env_info_for,
    },
    model::{
        CONTROL_STEP_S, EE_DESIRED_HEIGHT_M, GRAVITY_M_S2, INITIAL_Q, JOINTS, LIMIT_FRACTION,
        LINKS, Link, SUBSTEP_S, SUBSTEPS, TOOL,
    },
    robot::{controller::LIMITER_GAIN, universal_joint},
    table::geometry::{PUCK, TABLE},
};
use std::fmt::{Display, Write as _};

/// The numbers as a module of constants for the package `faceoff.kinematics`: tuples over the seven joints, base
/// to tip, and plain numbers. Names carry the unit; SI units, radians.
#[must_use]
pub fn python() -> String {
    let mut out = PythonModule::new();
    out.section("The arm: joints and links, base to tip.");
    out.integer("JOINTS", JOINTS, "driven joints");
    out.multiline_tuple(
        "LINK_OFFSET_M",
        LINKS.map(|link| tuple(&vector(link.offset))),
        "each joint in its parent's frame",
    );
    out.multiline_tuple(
        "LINK_MOUNT",
        LINKS.map(|link| {
            let rows = rotation(link.mount).map(|row| tuple(&row));
            format!("({})", rows.join(", "))
        }),
        "rotation matrix, rows, of each link in its parent at angle 0; each joint turns about its link's z",
    );
    out.per_joint("MASS_KG", |link| link.mass_kg, "");
    out.multiline_tuple(
        "CENTRE_OF_MASS_M",
        LINKS.map(|link| tuple(&link.centre_m)),
        "link's frame",
    );
    out.multiline_tuple(
        "INERTIA_KG_M2",
        LINKS.map(|link| tuple(&link.inertia_kg_m2)),
        "about the centre of mass, link's axes: xx, yy, zz, xy, xz, yz",
    );
    out.per_joint(
        "POSITION_LIMIT_RAD",
        |link| link.range_rad,
        "±, the physical stop",
    );
    out.per_joint(
        "VELOCITY_LIMIT_RAD_S",
        |link| link.velocity_limit_rad_s,
        "±",
    );
    let [_, acceleration] = env_info_for(1, 0).joint_acc_limit;
    out.line(
        "ACCELERATION_LIMIT_RAD_S2",
        tuple(&acceleration),
        "±, as the protocol's message `hello` states it",
    );
    out.per_joint(
        "TORQUE_LIMIT_N_M",
        |link| link.torque_limit_n_m,
        "±, the controller's clamp",
    );
    out.per_joint("DAMPING_N_M_S", |link| link.damping, "viscous");
    out.per_joint("DRY_FRICTION_N_M", |link| link.friction_n_m, "±");
    out.per_joint("ARMATURE_KG_M2", |link| link.armature_kg_m2, "rotors");
    out.per_joint("KP_N_M", |link| link.kp, "controller, per rad");
    out.per_joint("KD_N_M_S", |link| link.kd, "controller, per rad/s");
    out.line(
        "LIMIT_FRACTION",
        LIMIT_FRACTION,
        "the rules count positions and velocities beyond this share of a limit",
    );
    out.line(
        "LIMITER_GAIN_PER_S",
        LIMITER_GAIN,
        "a commanded joint nears its stop no faster than this times the distance",
    );
    out.line(
        "START_Q",
        tuple(&INITIAL_Q),
        "joint positions at the start of an episode, rad",
    );
    out.line(
        "START_UNIVERSAL_RAD",
        tuple(&level_mallet_angles(&INITIAL_Q)),
        "angles of the universal joint in that pose, mallet vertical",
    );
    out.section("The tool: on link 7 the end effector, on it by the universal joint the mallet.");
    for (name, value, note) in [
        (
            "END_EFFECTOR_Z_M",
            TOOL.end_effector_z_m,
            "along link 7's z",
        ),
        ("END_EFFECTOR_MASS_KG", TOOL.end_effector_mass_kg, ""),
        (
            "END_EFFECTOR_INERTIA_KG_M2",
            TOOL.end_effector_inertia_kg_m2,
            "about every axis",
        ),
        ("MALLET_MASS_KG", TOOL.mallet_mass_kg, ""),
        (
            "MALLET_CENTRE_OF_MASS_Z_M",
            TOOL.mallet_centre_z_m,
            "along the mallet's z",
        ),
        (
            "MALLET_INERTIA_KG_M2",
            TOOL.mallet_inertia_kg_m2,
            "about every axis",
        ),
        (
            "MALLET_CYLINDER_Z_M",
            TOOL.cylinder_centre_z_m,
            "centre of the cylinder that touches the puck, along the mallet's z",
        ),
        ("MALLET_RADIUS_M", TOOL.cylinder_radius_m, ""),
        ("MALLET_HALF_HEIGHT_M", TOOL.cylinder_half_height_m, ""),
        (
            "UNIVERSAL_KP_N_M",
            universal_joint::KP,
            "controller, per rad",
        ),
        (
            "UNIVERSAL_KD_N_M_S",
            universal_joint::KD,
            "controller, per rad/s",
        ),
        (
            "UNIVERSAL_TORQUE_LIMIT_N_M",
            universal_joint::TORQUE_LIMIT_N_M,
            "±",
        ),
        (
            "UNIVERSAL_RANGE_RAD",
            universal_joint::RANGE_RAD,
            "±, of its desired angles",
        ),
        (
            "UNIVERSAL_FILTER_NEW",
            universal_joint::FILTER_NEW,
            "weight of the newest hinge velocity in its low-pass filter, per substep",
        ),
    ] {
        out.line(name, value, note);
    }
    out.section("Where the mallet has to be, in the robot's base frame.");
    for (name, value, note) in [
        (
            "EE_DESIRED_HEIGHT_M",
            EE_DESIRED_HEIGHT_M,
            "of the end effector",
        ),
        ("EE_HEIGHT_TOLERANCE_M", HEIGHT_TOLERANCE_M, "±"),
        (
            "LINK_HEIGHT_M",
            LINK_HEIGHT_M,
            "least height of the origins of links 4 (elbow) and 7 (wrist)",
        ),
    ] {
        out.line(name, value, note);
    }
    out.section("Table and puck.");
    for (name, value, note) in [
        (
            "BASE_X_M",
            TABLE.base_x_m,
            "from the base to the table's centre, along x",
        ),
        (
            "BASE_Z_M",
            TABLE.base_z_m,
            "height of the base above the table's surface",
        ),
        ("TABLE_LENGTH_M", TABLE.length_m, "goal line to goal line"),
        ("TABLE_WIDTH_M", TABLE.width_m, ""),
        ("GOAL_WIDTH_M", TABLE.goal_width_m, ""),
        ("PUCK_RADIUS_M", PUCK.radius_m, ""),
        ("PUCK_MASS_KG", PUCK.mass_kg, ""),
        ("PUCK_YAW_INERTIA_KG_M2", PUCK.inertia_kg_m2, ""),
        ("PUCK_DAMPING_N_S_M", PUCK.damping, "viscous"),
        ("PUCK_YAW_DAMPING_N_M_S", PUCK.yaw_damping, "viscous"),
        ("PUCK_HEIGHT_M", PUCK.height_m, ""),
    ] {
        out.line(name, value, note);
    }
    out.section("Time and gravity.");
    out.line("CONTROL_STEP_S", CONTROL_STEP_S, "one action");
    out.line("SUBSTEP_S", SUBSTEP_S, "one step of controller and physics");
    out.integer("SUBSTEPS", SUBSTEPS, "in a control step");
    out.line("GRAVITY_M_S2", GRAVITY_M_S2, "along −z");
    out.text
}

/// The text of a Python module that is being written.
struct PythonModule {
    text: String,
}

impl PythonModule {
    fn new() -> Self {
        Self {
            text: "\"\"\"The numbers of robot, table and puck, as the simulator has them. SI units, radians.\n\n\
                   Written by `faceoff sim export --format python`; a test compares it with what the program writes.\n\
                   \"\"\"\n\nfrom typing import Final\n"
                .to_owned(),
        }
    }

    /// Appends text.
    fn put(&mut self, line: std::fmt::Arguments<'_>) {
        self.text
            .write_fmt(line)
            .expect("writing to a string cannot fail");
    }

    /// A comment that begins a group of constants.
    fn section(&mut self, title: &str) {
        self.put(format_args!("\n# {title}\n"));
    }

    /// A comment on the next constant.
    fn note(&mut self, note: &str) {
        if !note.is_empty() {
            self.put(format_args!("# {note}\n"));
        }
    }

    /// A constant with a comment.
    fn line(&mut self, name: &str, value: impl Literal, note: &str) {
        self.note(note);
        self.put(format_args!("{name}: Final = {}\n", value.literal()));
    }

    /// An integer constant with a comment.
    fn integer(&mut self, name: &str, value: usize, note: &str) {
        self.note(note);
        self.put(format_args!("{name}: Final = {value}\n"));
    }

    /// A tuple with a number of each link or its joint.
    fn per_joint(&mut self, name: &str, value: impl Fn(&Link) -> f64, note: &str) {
        let values: Vec<f64> = LINKS.iter().map(value).collect();
        self.line(name, tuple(&values), note);
    }

    /// A tuple of tuples, with a line for each item.
    fn multiline_tuple(
        &mut self,
        name: &str,
        items: impl IntoIterator<Item = impl Display>,
        note: &str,
    ) {
        self.note(note);
        self.put(format_args!("{name}: Final = (\n"));
        for item in items {
            self.put(format_args!("    {item},\n"));
        }
        self.put(format_args!(")\n"));
    }
}

/// A value as a Python literal.
trait Literal {
    fn literal(self) -> String;
}

impl Literal for f64 {
    fn literal(self) -> String {
        // With a decimal point or exponent, so that Python reads a float.
        format!("{self:?}")
    }
}

impl Literal for String {
    fn literal(self) -> String {
        self
    }
}

/// A Python tuple of floats.
fn tuple(numbers: &[f64]) -> String {
    let literals: Vec<String> = numbers.iter().map(|number| number.literal()).collect();
    format!("({})", literals.join(", "))
}
