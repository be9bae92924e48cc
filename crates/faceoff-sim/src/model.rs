//! The numbers of the robot: a KUKA LBR iiwa 14 arm with a rod, at whose end a mallet hangs on a *universal joint* (two hinges). They
//! are read from the *reference*, the simulator of the 2023 Robot Air Hockey Challenge; `docs/robot.md` lists them.

pub use crate::{JOINTS, SUBSTEPS};
pub use faceoff_types::CONTROL_STEP_S;

/// Degrees of freedom of the *plant* (the simulated arm): the seven driven joints and the two hinges of the universal joint.
pub const DOFS: usize = 9;

/// Rotation of a link's frame against its parent's at joint angle 0. Only exact quarter and half turns occur,
/// which cost no arithmetic. Quaternions are (w, x, y, z).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mount {
    /// Quaternion (1, 0, 0, 0).
    Aligned,
    /// Quaternion (0, 0, √½, √½): half a turn about y + z.
    HalfTurnYz,
    /// Quaternion (√½, √½, 0, 0): a quarter turn about x.
    QuarterTurnX,
}

/// Position of a link's joint in the frame of its parent (the previous link, or the base).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Offset {
    /// Along the parent's y, m.
    Y(f64),
    /// Along the parent's z, m.
    Z(f64),
}

/// A link and the joint (about the link's own z) that carries it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// Position of the joint in the parent's frame.
    pub offset: Offset,
    /// Orientation in the parent's frame at joint angle 0.
    pub mount: Mount,
    /// kg.
    pub mass_kg: f64,
    /// Centre of mass in the link's frame, m.
    pub centre_m: [f64; 3],
    /// Inertia about the centre of mass, link's axes: xx, yy, zz, xy, xz, yz, kg m².
    pub inertia_kg_m2: [f64; 6],
    /// Joint range ±, rad; its ends are the joint's stops.
    pub range_rad: f64,
    /// Viscous joint damping, N m s/rad.
    pub damping: f64,
    /// Largest torque ± of the joint's dry friction, N m.
    pub friction_n_m: f64,
    /// Rotor inertia reflected to the joint, kg m².
    pub armature_kg_m2: f64,
    /// Joint velocity limit ±, rad/s.
    pub velocity_limit_rad_s: f64,
    /// Torque limit ±, N m (the controller's clamp).
    pub torque_limit_n_m: f64,
    /// Proportional gain of the joint controller, N m/rad.
    pub kp: f64,
    /// Derivative gain of the joint controller, N m s/rad.
    pub kd: f64,
}

/// One degree, rad.
const DEG: f64 = std::f64::consts::PI / 180.0;

/// The seven driven links, base to tip.
pub const LINKS: [Link; JOINTS] = [
    Link {
        offset: Offset::Z(0.1575),
        mount: Mount::Aligned,
        mass_kg: 8.240527,
        centre_m: [4.007709e-6, -0.033936, 0.122467],
        inertia_kg_m2: [
            0.021981,
            0.022182,
            0.008234,
            -2.897243e-7,
            6.3165236e-7,
            0.003285,
        ],
        range_rad: 2.96706,
        damping: 0.33032,
        friction_n_m: 0.384477,
        armature_kg_m2: 0.0,
        velocity_limit_rad_s: 85.0 * DEG,
        torque_limit_n_m: 320.0,
        kp: 1500.0,
        kd: 60.0,
    },
    Link {
        offset: Offset::Z(0.2025),
        mount: Mount::HalfTurnYz,
        mass_kg: 6.357896,
        centre_m: [0.003402, 0.034792, 0.046725],
        inertia_kg_m2: [
            0.015565,
            0.005180,
            0.015484,
            -4.147301e-6,
            1.192255e-5,
            0.002538,
        ],
        range_rad: 2.0944,
        damping: 0.21216,
        friction_n_m: 0.496333,
        armature_kg_m2: 0.0,
        velocity_limit_rad_s: 85.0 * DEG,
        torque_limit_n_m: 320.0,
        kp: 1500.0,
        kd: 80.0,
    },
    Link {
        offset: Offset::Y(0.2045),
        mount: Mount::HalfTurnYz,
        mass_kg: 4.042756,
        centre_m: [-0.001452, 0.031526, 0.133584],
        inertia_kg_m2: [
            0.010914,
            0.010381,
            0.003139,
            -3.540575e-6,
            -9.059062e-6,
            -0.002128,
        ],
        range_rad: 2.96706,
        damping: 0.1,
        friction_n_m: 0.173951,
        armature_kg_m2: 0.0,
        velocity_limit_rad_s: 100.0 * DEG,
        torque_limit_n_m: 176.0,
        kp: 1200.0,
        kd: 60.0,
    },
    Link {
        offset: Offset::Z(0.2155),
        mount: Mount::QuarterTurnX,
        mass_kg: 3.642249,
        centre_m: [-0.002527, 0.053508, 0.037205],
        inertia_kg_m2: [
            0.007536,
            0.002538,
            0.007206,
            -5.707028e-6,
            2.781894e-6,
            0.001256,
        ],
        range_rad: 2.0944,
        damping: 0.219041,
        friction_n_m: 0.3751,
        armature_kg_m2: 0.0,
        velocity_limit_rad_s: 75.0 * DEG,
        torque_limit_n_m: 176.0,
        kp: 1200.0,
        kd: 30.0,
    },
    Link {
        offset: Offset::Y(0.1845),
        mount: Mount::HalfTurnYz,
        mass_kg: 2.580896,
        centre_m: [0.001855, 0.024573, 0.080131],
        inertia_kg_m2: [
            0.005201,
            0.004488,
            0.002242,
            1.089316e-7,
            9.035623e-7,
            -0.001613,
        ],
        range_rad: 2.96706,
        damping: 0.185923,
        friction_n_m: 0.481099,
        armature_kg_m2: 0.0,
        velocity_limit_rad_s: 130.0 * DEG,
        torque_limit_n_m: 110.0,
        kp: 1000.0,
        kd: 10.0,
    },
    Link {
        offset: Offset::Z(0.2155),
        mount: Mount::QuarterTurnX,
        mass_kg: 2.760564,
        centre_m: [-0.001739, -0.001973, -0.002502],
        inertia_kg_m2: [
            0.002534,
            0.001821,
            0.002393,
            -1.311766e-6,
            9.508242e-7,
            0.000134,
        ],
        range_rad: 2.0944,
        damping: 0.1,
        friction_n_m: 0.196149,
        armature_kg_m2: 0.0,
        velocity_limit_rad_s: 135.0 * DEG,
        torque_limit_n_m: 40.0,
        kp: 1000.0,
        kd: 1.0,
    },
    Link {
        offset: Offset::Y(0.081),
        mount: Mount::HalfTurnYz,
        mass_kg: 1.285417,
        centre_m: [0.000735, 0.000387, 0.026460],
        inertia_kg_m2: [
            0.000151,
            0.000150,
            0.000187,
            -7.223100e-8,
            2.038333e-6,
            -3.396830e-7,
        ],
        range_rad: 3.05433,
        damping: 0.1,
        friction_n_m: 0.299238,
        armature_kg_m2: 0.01,
        velocity_limit_rad_s: 135.0 * DEG,
        torque_limit_n_m: 40.0,
        kp: 500.0,
        kd: 0.5,
    },
];

/// Range ± of each hinge of the universal joint, rad; its ends are the hinge's stops.
pub const HINGE_RANGE_RAD: f64 = std::f64::consts::FRAC_PI_2;

/// The tool on link 7: the end effector, the fixed end of the rod, and the mallet, which hangs on it by the universal joint. The
/// mallet's z axis points from the universal joint to the mallet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tool {
    /// Position of the end effector (the reference's "striker joint link") along link 7's z, m.
    pub end_effector_z_m: f64,
    /// Mass of the end effector, centred on its origin, kg.
    pub end_effector_mass_kg: f64,
    /// Its inertia, the same about every axis, kg m².
    pub end_effector_inertia_kg_m2: f64,
    /// Mass of the mallet, kg.
    pub mallet_mass_kg: f64,
    /// The mallet's centre of mass along its z, m.
    pub mallet_centre_z_m: f64,
    /// Its inertia about the centre of mass, the same about every axis, kg m².
    pub mallet_inertia_kg_m2: f64,
    /// Centre of the striking cylinder, the mallet's part that touches the puck, along the mallet's z, m.
    pub cylinder_centre_z_m: f64,
    /// Radius of the striking cylinder, m.
    pub cylinder_radius_m: f64,
    /// Half the height of the striking cylinder, m.
    pub cylinder_half_height_m: f64,
}

pub const TOOL: Tool = Tool {
    end_effector_z_m: 0.585,
    end_effector_mass_kg: 0.1,
    end_effector_inertia_kg_m2: 0.001,
    mallet_mass_kg: 0.283,
    mallet_centre_z_m: 0.0682827,
    mallet_inertia_kg_m2: 0.005,
    cylinder_centre_z_m: 0.0505,
    cylinder_radius_m: 0.04815,
    cylinder_half_height_m: 0.03,
};

/// Gravity along −z, m/s².
pub const GRAVITY_M_S2: f64 = 9.81;

/// The length of a substep, a step of physics and controller, s.
pub const SUBSTEP_S: f64 = 0.001;

/// Joint positions at the start of an episode, rad: the reference's inverse kinematics for the end effector
/// at (0.65, 0, 0.1645) m in the base frame, to the digits of its recordings.
pub const INITIAL_Q: [f64; JOINTS] = [0.0, -0.196067345, 0.0, -1.84363898, 0.0, 0.970422238, 0.0];

/// The rules apply joint limits at this fraction of the physical ones (`docs/rules.md`, "Penalty points").
pub const LIMIT_FRACTION: f64 = 0.95;

/// Height at which the rules want the end effector, m, in the robot's base frame (the reference's `ee_desired_height`).
pub const EE_DESIRED_HEIGHT_M: f64 = 0.1645;
