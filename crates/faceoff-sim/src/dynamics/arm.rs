//! The arm's equations of motion: forward kinematics, torques by the recursive Newton–Euler algorithm, and the joint-space inertia by the
//! composite-rigid-body algorithm.
//!
//! The *plant* is the simulated arm: seven driven joints and the two hinges of the *universal joint*, on which the mallet hangs. The
//! *controller's model* has the seven driven joints only. `q`, `dq` and `ddq` are joint positions (rad), velocities (rad/s) and
//! accelerations (rad/s²). All vectors are in the robot's base frame. `T` is one number per arm ([`Lanes`]).

use super::{
    lanes::Lanes,
    spatial::{Force, Frame, Inertia, Motion, Vec3},
};
use crate::model::{DOFS, GRAVITY_M_S2, JOINTS, LINKS, Mount, Offset, SUBSTEP_S, TOOL};

/// Frames of the links, and axes of the joints, in the base frame.
#[derive(Debug, Clone, Copy)]
pub struct Kinematics<T> {
    /// Frames of links 1…7, at their joints.
    pub links: [Frame<T>; JOINTS],
    /// Frame of the end effector.
    pub end_effector: Frame<T>,
    /// The mallet's z axis, a unit vector from the universal joint to the mallet.
    pub mallet_axis: Vec3<T>,
    /// Motion of the following bodies at unit rate of each joint: 7 driven ones, then the universal joint's y and x hinge.
    pub axes: [Motion<T>; DOFS],
}

impl<T: Lanes> Kinematics<T> {
    /// Forward kinematics of the driven joints `q[..7]` and the universal joint `q[7..]`.
    #[inline(always)]
    pub fn new(q: &[T; DOFS]) -> Self {
        let mut frame = Frame::base();
        let mut links = [frame; JOINTS];
        let mut axes = [Motion::zero(); DOFS];
        for i in 0..JOINTS {
            frame = link_frame(&frame, LINKS[i].offset, LINKS[i].mount, q[i]);
            links[i] = frame;
            axes[i] = Motion::hinge(frame.z, frame.origin);
        }
        let end_effector = Frame {
            origin: frame.origin + frame.z.scale(T::splat(TOOL.end_effector_z_m)),
            ..frame
        };
        // Universal joint: a hinge about the end effector's y, then one about the turned x.
        let (sin_1, cos_1) = q[7].sin_cos();
        let (sin_2, cos_2) = q[8].sin_cos();
        let ee = &end_effector;
        let x = ee.x.scale(cos_1) - ee.z.scale(sin_1);
        let z = ee.x.scale(sin_1) + ee.z.scale(cos_1);
        let mallet_axis = z.scale(cos_2) - ee.y.scale(sin_2);
        axes[7] = Motion::hinge(ee.y, ee.origin);
        axes[8] = Motion::hinge(x, ee.origin);
        Self {
            links,
            end_effector,
            mallet_axis,
            axes,
        }
    }

    /// Centre of the mallet's striking cylinder, m, base frame.
    #[inline(always)]
    pub fn cylinder_centre(&self) -> Vec3<T> {
        self.end_effector.origin + self.mallet_axis.scale(T::splat(TOOL.cylinder_centre_z_m))
    }

    /// The linear velocity, m/s, that a rate of 1 rad/s of each joint gives to a point fixed to the mallet.
    #[inline(always)]
    pub fn jacobian_at(&self, point: Vec3<T>) -> [Vec3<T>; DOFS] {
        self.axes.map(|axis| axis.velocity_at(point))
    }
}

/// The frame of a link whose joint is at angle `q`, rad.
#[inline(always)]
fn link_frame<T: Lanes>(parent: &Frame<T>, offset: Offset, mount: Mount, q: T) -> Frame<T> {
    let origin = parent.origin
        + match offset {
            Offset::Y(d) => parent.y.scale(T::splat(d)),
            Offset::Z(d) => parent.z.scale(T::splat(d)),
        };
    let zero = Vec3::zero();
    let (x, y, z) = match mount {
        Mount::Aligned => (parent.x, parent.y, parent.z),
        Mount::HalfTurnYz => (zero - parent.x, parent.z, parent.y),
        Mount::QuarterTurnX => (parent.x, parent.z, zero - parent.y),
    };
    let (sin, cos) = q.sin_cos();
    Frame {
        x: x.scale(cos) + y.scale(sin),
        y: y.scale(cos) - x.scale(sin),
        z,
        origin,
    }
}

/// Spatial inertias of the bodies at one set of joint positions, with nominal masses.
#[derive(Debug, Clone, Copy)]
pub struct Bodies<T> {
    /// Links 1…7.
    pub links: [Inertia<T>; JOINTS],
    /// The end effector, fixed on link 7.
    pub end_effector: Inertia<T>,
    /// The mallet, on the universal joint's second hinge.
    pub mallet: Inertia<T>,
}

impl<T: Lanes> Bodies<T> {
    #[inline(always)]
    pub fn new(kinematics: &Kinematics<T>) -> Self {
        let links = std::array::from_fn(|i| {
            let link = &LINKS[i];
            Inertia::of_body(
                &kinematics.links[i],
                link.mass_kg,
                link.centre_m,
                link.inertia_kg_m2,
            )
        });
        let ee = kinematics.end_effector.origin;
        let mallet_centre = ee
            + kinematics
                .mallet_axis
                .scale(T::splat(TOOL.mallet_centre_z_m));
        Self {
            links,
            end_effector: Inertia::isotropic(
                ee,
                TOOL.end_effector_mass_kg,
                TOOL.end_effector_inertia_kg_m2,
            ),
            mallet: Inertia::isotropic(
                mallet_centre,
                TOOL.mallet_mass_kg,
                TOOL.mallet_inertia_kg_m2,
            ),
        }
    }

    /// Inertias of the seven links of the controller's model. Link 7 includes the end effector; there is no
    /// mallet.
    #[inline(always)]
    pub fn controller(&self) -> [Inertia<T>; JOINTS] {
        let mut bodies = self.links;
        bodies[6] = bodies[6] + self.end_effector;
        bodies
    }

    /// The bodies of the plant: `scale` multiplies the masses of links 1…7, end effector and mallet.
    #[inline(always)]
    pub fn plant(&self, scale: &[T; 9]) -> PlantBodies<T> {
        let mut links = self.links;
        for i in 0..JOINTS {
            links[i] = links[i].scaled(scale[i]);
        }
        links[6] = links[6] + self.end_effector.scaled(scale[7]);
        PlantBodies {
            links,
            mallet: self.mallet.scaled(scale[8]),
        }
    }
}

/// The moving bodies of the plant. The universal joint's first hinge carries only the second one.
#[derive(Debug, Clone, Copy)]
pub struct PlantBodies<T> {
    /// Links 1…7; link 7 includes the end effector.
    pub links: [Inertia<T>; JOINTS],
    /// The mallet, on the second hinge.
    pub mallet: Inertia<T>,
}

/// Index of the degree of freedom that carries the mallet: the second hinge.
const MALLET_DOF: usize = DOFS - 1;

/// Inverse dynamics of the controller's seven-joint model by recursive Newton–Euler: the torques
/// `M(q) ddq + bias(q, dq)`, N m, with the joint-space inertia M. The bias consists of gravity, centrifugal and Coriolis torques.
#[inline(always)]
pub fn controller_torques<T: Lanes>(
    kinematics: &Kinematics<T>,
    bodies: &[Inertia<T>; JOINTS],
    dq: &[T; JOINTS],
    ddq: &[T; JOINTS],
) -> [T; JOINTS] {
    let mut velocity = Motion::zero();
    // An upward acceleration of the base is equivalent to gravity.
    let mut acceleration = Motion {
        angular: Vec3::zero(),
        linear: Vec3::splat([0.0, 0.0, GRAVITY_M_S2]),
    };
    let mut forces = [Force::zero(); JOINTS];
    for i in 0..JOINTS {
        let joint_velocity = kinematics.axes[i].scale(dq[i]);
        // `velocity` is still the parent's: the link's own part would add nothing, since the cross product of an axis with itself is 0.
        acceleration =
            acceleration + kinematics.axes[i].scale(ddq[i]) + velocity.cross_motion(joint_velocity);
        velocity = velocity + joint_velocity;
        forces[i] = force_of(&bodies[i], velocity, acceleration);
    }
    let mut total = Force::zero();
    let mut torques = [T::splat(0.0); JOINTS];
    for i in (0..JOINTS).rev() {
        total = total + forces[i];
        torques[i] = kinematics.axes[i].dot(total) + T::splat(LINKS[i].armature_kg_m2) * ddq[i];
    }
    torques
}

/// The force that gives a body this motion.
#[inline(always)]
fn force_of<T: Lanes>(body: &Inertia<T>, velocity: Motion<T>, acceleration: Motion<T>) -> Force<T> {
    body.mul(acceleration) + velocity.cross_force(body.mul(velocity))
}

/// The bias of the nine-joint plant by recursive Newton–Euler: gravity, centrifugal and Coriolis torques, N m.
#[inline(always)]
pub fn plant_bias<T: Lanes>(
    kinematics: &Kinematics<T>,
    bodies: &PlantBodies<T>,
    dq: &[T; DOFS],
) -> [T; DOFS] {
    let mut velocity = Motion::zero();
    let mut acceleration = Motion {
        angular: Vec3::zero(),
        linear: Vec3::splat([0.0, 0.0, GRAVITY_M_S2]),
    };
    let mut forces = [Force::zero(); JOINTS];
    let mut total = Force::zero();
    for i in 0..DOFS {
        let joint_velocity = kinematics.axes[i].scale(dq[i]);
        acceleration = acceleration + velocity.cross_motion(joint_velocity);
        velocity = velocity + joint_velocity;
        if i < JOINTS {
            forces[i] = force_of(&bodies.links[i], velocity, acceleration);
        } else if i == MALLET_DOF {
            total = force_of(&bodies.mallet, velocity, acceleration);
        }
    }
    let mut torques = [T::splat(0.0); DOFS];
    for i in (0..DOFS).rev() {
        if i < JOINTS {
            total = total + forces[i];
        }
        torques[i] = kinematics.axes[i].dot(total);
    }
    torques
}

/// The plant's joint-space inertia by the composite-rigid-body algorithm, kg m². Only the lower
/// triangle is filled.
#[inline(always)]
pub fn mass_matrix<T: Lanes>(
    kinematics: &Kinematics<T>,
    bodies: &PlantBodies<T>,
) -> [[T; DOFS]; DOFS] {
    let mut mass = [[T::splat(0.0); DOFS]; DOFS];
    let mut composite = bodies.mallet;
    for i in (0..DOFS).rev() {
        if i < JOINTS {
            composite = composite + bodies.links[i];
        }
        let momentum = composite.mul(kinematics.axes[i]);
        for j in 0..=i {
            mass[i][j] = kinematics.axes[j].dot(momentum);
        }
    }
    for i in 0..JOINTS {
        mass[i][i] += T::splat(LINKS[i].armature_kg_m2);
    }
    mass
}

/// The matrix `M + h D` of the semi-implicit Euler step with implicit joint damping: joint-space inertia M (kg m²), length h of a substep
/// (s), joint damping D (N m s/rad).
#[inline(always)]
pub fn damped_mass_matrix<T: Lanes>(
    mass: &[[T; DOFS]; DOFS],
    damping: &[T; JOINTS],
) -> [[T; DOFS]; DOFS] {
    let mut m = *mass;
    for i in 0..JOINTS {
        m[i][i] += T::splat(SUBSTEP_S) * damping[i];
    }
    m
}
