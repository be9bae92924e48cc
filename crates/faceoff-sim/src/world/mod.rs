//! The physical world: a puck, and one or two arms around it.

mod arm;
mod cone;
mod contacts;
mod joints;
mod solver;
mod substep;

use crate::{
    dynamics::arm::Kinematics,
    model::{DOFS, INITIAL_Q, JOINTS, SUBSTEPS},
    robot::plant::Plant,
    table::{
        contact_finder,
        contact_law::{MALLET, RIM},
        geometry::TABLE,
        mallet_cylinder::MalletCylinder,
        puck::{Damping, Puck},
    },
};
pub use arm::Arm;
use contacts::{Contacts, MalletMotion, Pair};
use faceoff_types::Interpolation;
use solver::add;
use wide::f64x2;

/// A mallet's striking cylinder: centre x, y, z (m) and velocity vx, vy (m/s), table frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MalletState {
    /// m.
    pub position: [f64; 3],
    /// m/s.
    pub velocity: [f64; 2],
}

/// Puck and arms, advanced by one millisecond at a time. Clone saves a world exactly.
#[derive(Debug, Clone)]
pub struct World {
    plant: Plant,
    arms: Vec<Arm>,
    puck: Puck,
    puck_damping: Damping,
    /// Robot 1's mallet, when it is imposed in place of being moved by an arm.
    imposed: Option<MalletState>,
    /// Force of the air on the puck, N.
    air_n: [f64; 2],
    /// Index of the next substep within the control step.
    substep: usize,
}

impl World {
    /// A world of one arm per initial joint position (at most two), all at rest, and a puck at
    /// [x, y, yaw, vx, vy, yaw rate] in the table frame.
    #[must_use]
    pub fn new(plant: &Plant, joints: &[[f64; JOINTS]], puck: [f64; 6]) -> Self {
        debug_assert!(joints.len() <= 2);
        contact_finder::make_ready();
        Self {
            plant: plant.clone(),
            arms: joints.iter().take(2).map(|q| Arm::new(plant, q)).collect(),
            puck: Puck::from_state(puck),
            puck_damping: Damping::NOMINAL,
            imposed: None,
            air_n: [0.0; 2],
            substep: 0,
        }
    }

    /// A world of `robots` arms in their initial pose.
    #[must_use]
    pub fn with_robots(plant: &Plant, robots: usize, puck: [f64; 6]) -> Self {
        Self::new(plant, &[INITIAL_Q; 2][..robots.min(2)], puck)
    }

    /// Gives a robot (0 or 1) its action for the coming control step: row-major, of length
    /// [`Interpolation::len`].
    pub fn command(&mut self, robot: usize, interpolation: Interpolation, action: &[f64]) {
        self.arms[robot].command(interpolation, action);
    }

    /// Imposes the motion of robot 1's mallet from now on, or frees it. With an imposed mallet
    /// robot 1's arm stays where it is.
    pub fn impose_mallet(&mut self, mallet: Option<MalletState>) {
        self.imposed = mallet;
    }

    /// Sets the force of the air on the puck, N.
    pub fn set_air_force(&mut self, force_n: [f64; 2]) {
        self.air_n = force_n;
    }

    /// Number of arms.
    #[must_use]
    pub fn robots(&self) -> usize {
        self.arms.len()
    }

    /// The puck: [x, y, yaw, vx, vy, yaw rate], table frame.
    #[must_use]
    pub fn puck(&self) -> &Puck {
        &self.puck
    }

    /// Puts the puck somewhere else.
    pub fn set_puck(&mut self, puck: [f64; 6]) {
        self.puck = Puck::from_state(puck);
    }

    /// Positions of a robot's driven joints, rad.
    #[must_use]
    pub fn joints(&self, robot: usize) -> [f64; JOINTS] {
        head(&self.arms[robot].q)
    }

    /// True velocities of a robot's driven joints, rad/s.
    #[must_use]
    pub fn joint_velocities(&self, robot: usize) -> [f64; JOINTS] {
        head(&self.arms[robot].dq)
    }

    /// Low-pass filtered velocities of a robot's driven joints, rad/s.
    #[must_use]
    pub fn filtered_velocities(&self, robot: usize) -> &[f64; JOINTS] {
        &self.arms[robot].dq_filtered
    }

    /// Angles of a robot's universal joint, rad.
    #[must_use]
    pub fn universal(&self, robot: usize) -> [f64; 2] {
        let q = &self.arms[robot].q;
        [q[7], q[8]]
    }

    /// Torques applied in the last substep, N m.
    #[must_use]
    pub fn torques(&self, robot: usize) -> &[f64; JOINTS] {
        &self.arms[robot].torque
    }

    /// A robot's forward kinematics, in its own base frame.
    #[must_use]
    pub fn kinematics(&self, robot: usize) -> Kinematics<f64> {
        Kinematics::new(&self.arms[robot].q)
    }

    /// A robot's end effector before the last substep, m, its own base frame: what the reference's
    /// observation of the opponent shows.
    #[must_use]
    pub fn end_effector_before(&self, robot: usize) -> [f64; 3] {
        self.arms[robot].ee_before
    }

    /// A robot's mallet.
    #[must_use]
    pub fn mallet(&self, robot: usize) -> MalletState {
        if let (0, Some(mallet)) = (robot, self.imposed) {
            return mallet;
        }
        let kinematics = self.kinematics(robot);
        let centre = kinematics.cylinder_centre();
        let jacobian = kinematics.jacobian_at(centre);
        let arm = &self.arms[robot];
        let (mut vx, mut vy) = (0.0, 0.0);
        for i in 0..DOFS {
            vx += jacobian[i].x * arm.dq[i];
            vy += jacobian[i].y * arm.dq[i];
        }
        let side = side(robot);
        MalletState {
            position: table_from_robot(robot, centre.lane(0)),
            velocity: [side * vx, side * vy],
        }
    }

    /// Advances by a control step, 20 substeps. `air` is called before each of them.
    pub fn control_step(&mut self, mut air: impl FnMut(&Puck) -> [f64; 2]) {
        for _ in 0..SUBSTEPS {
            self.air_n = air(&self.puck);
            self.substep();
        }
    }

    /// Advances by one substep, 1 ms. After 20 of them a new action is due; without one the last
    /// trajectory would be repeated, so [`World::command`] or [`World::hold`] first.
    pub fn substep(&mut self) {
        if self.imposed.is_some() {
            self.substep_imposed();
        } else {
            match self.arms.len() {
                0 => self.advance_puck_alone(),
                1 => self.substep_lanes::<f64>(),
                _ => self.substep_lanes::<f64x2>(),
            }
        }
        self.substep = (self.substep + 1) % SUBSTEPS;
    }

    /// Commands a robot's last commanded position again, at rest, for the coming control step.
    pub fn hold(&mut self, robot: usize, interpolation: Interpolation) {
        self.arms[robot].hold(interpolation);
    }

    /// Lets a robot's last trajectory run on for the coming control step: at constant velocity for 80 ms
    /// in all, then at rest.
    pub fn coast(&mut self, robot: usize) {
        self.arms[robot].coast();
    }

    /// Replaces the decay rate of the puck's velocity, 1/s; its spin is damped as before.
    pub fn set_puck_damping(&mut self, per_s: f64) {
        self.puck_damping = Damping::per_s(per_s);
    }

    fn advance_puck_alone(&mut self) {
        let mut contacts = Contacts::none();
        self.add_rims(&mut contacts);
        let force = (!contacts.is_empty()).then(|| {
            contacts.solve_puck(&self.puck.free_acceleration(&self.puck_damping, self.air_n))
        });
        self.advance_puck(force);
    }

    fn substep_imposed(&mut self) {
        let mut contacts = Contacts::none();
        self.add_rims(&mut contacts);
        if let Some(mallet) = self.imposed {
            let cylinder = MalletCylinder::upright(mallet.position);
            let puck = [self.puck.pose[0], self.puck.pose[1]];
            if let Some(touch) = contact_finder::mallet_and_puck(&cylinder, puck) {
                let motion = MalletMotion {
                    jacobian: None,
                    velocity: [mallet.velocity[0], mallet.velocity[1], 0.0],
                };
                contacts.add(
                    touch,
                    &MALLET,
                    Pair::Mallet {
                        robot: 0,
                        mallet: &motion,
                        puck: &self.puck.velocity,
                    },
                );
            }
        }
        let force = (!contacts.is_empty()).then(|| {
            contacts.solve_puck(&self.puck.free_acceleration(&self.puck_damping, self.air_n))
        });
        self.advance_puck(force);
    }

    fn add_rims(&self, contacts: &mut Contacts) {
        contact_finder::rims([self.puck.pose[0], self.puck.pose[1]], |touch| {
            contacts.add(
                touch,
                &RIM,
                Pair::Rim {
                    puck: &self.puck.velocity,
                },
            );
        });
    }

    fn advance_puck(&mut self, contact: Option<[f64; 3]>) {
        let mut force = [self.air_n[0], self.air_n[1], 0.0];
        if let Some(contact) = contact {
            for i in 0..3 {
                force[i] += contact[i];
            }
        }
        self.puck.advance(&self.puck_damping, force);
    }
}

/// A robot's side of the table: its base frame is turned by π for robot 2.
#[inline(always)]
fn side(robot: usize) -> f64 {
    if robot == 0 { 1.0 } else { -1.0 }
}

/// A point of a robot's base frame in the table frame, m.
#[inline(always)]
fn table_from_robot(robot: usize, p: [f64; 3]) -> [f64; 3] {
    let side = side(robot);
    [
        side * (p[0] - TABLE.base_x_m),
        side * p[1],
        p[2] + TABLE.base_z_m,
    ]
}

/// A point of the table frame in a robot's base frame, m.
fn robot_from_table(robot: usize, p: [f64; 3]) -> [f64; 3] {
    let side = side(robot);
    [
        side * p[0] + TABLE.base_x_m,
        side * p[1],
        p[2] - TABLE.base_z_m,
    ]
}

fn head(q: &[f64; DOFS]) -> [f64; JOINTS] {
    std::array::from_fn(|i| q[i])
}
