//! The physical world: a puck and up to two arms on a table, stepped one *substep* (1 ms) at a time.
//!
//! Robots are 0 and 1 in the code and stand opposite each other; texts call them robot 1 and robot 2. The *table frame* has its origin in
//! the table's centre, x towards robot 2, z up; each robot also has its own *base frame*.

mod arm;
mod arm_lanes;
mod bounds;
mod cone;
mod contact_detection;
mod contacts;
mod divergence;
mod friction;
mod impacts;
mod joints;
mod lane_worlds;
mod puck_substep;
mod scalar_arms;
mod solver;
mod substep;
mod time_step;

use crate::{AirHockeyRuleset, Interpolation};
use crate::{
    dynamics::arm::Kinematics,
    model::{DOFS, INITIAL_Q, JOINTS},
    robot::plant::Plant,
    table::{
        contact_finder,
        frames::{axis_sign, table_from_robot},
        puck::{Damping, Puck},
    },
};
use arm::Arm;
pub use bounds::{Bounds, Divergence, DivergenceCause};
pub use impacts::{ContactBody, Impact, Impacts};

/// A mallet's striking cylinder: centre x, y, z (m) and velocity vx, vy (m/s), table frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MalletState {
    pub position: [f64; 3],
    /// m/s.
    pub velocity: [f64; 2],
}

/// Puck and arms. A clone continues with the same bits.
#[derive(Debug, Clone)]
pub struct World {
    plant: Plant,
    arms: Vec<Arm>,
    puck: Puck,
    puck_damping: Damping,
    /// State of robot 0's mallet, if its motion is given by the caller instead of computed.
    imposed_mallet: Option<MalletState>,
    /// Force of the air flow on the puck along x and y, N.
    air_n: [f64; 2],
    /// Index of the next substep within the control step.
    substep: usize,
    bounds: Bounds,
    /// The robots that first commanded or moved beyond what a robot can do; `None` while there is none.
    runaway_robots: Option<[bool; 2]>,
    /// The robots whose arms took part in the latest contact of any arm.
    last_contact_robots: [bool; 2],
    /// Set once the world would have left its bounds.
    divergence: Option<Divergence>,
    impacts: Impacts,
}

impl World {
    /// A world with an arm at rest for each item of `joints` (initial joint positions, rad; at most two items), and a puck in the state
    /// [x, y, yaw, vx, vy, yaw rate] in the table frame.
    #[must_use]
    pub fn new(plant: &Plant, joints: &[[f64; JOINTS]], puck: [f64; 6]) -> Self {
        debug_assert!(joints.len() <= 2);
        contact_finder::build_colliders();
        Self {
            plant: plant.clone(),
            arms: joints.iter().take(2).map(|q| Arm::new(plant, q)).collect(),
            puck: Puck::from_state(puck),
            puck_damping: Damping::NOMINAL,
            imposed_mallet: None,
            air_n: [0.0; 2],
            substep: 0,
            bounds: Bounds::of(AirHockeyRuleset::CURRENT),
            runaway_robots: None,
            last_contact_robots: [false; 2],
            divergence: None,
            impacts: Impacts::default(),
        }
    }

    /// Replaces the bounds beyond which the world counts as diverged.
    pub fn set_bounds(&mut self, bounds: Bounds) {
        self.bounds = bounds;
    }

    /// `Some` once the world would have left its bounds. It then stays in its last state within them, so all its numbers
    /// are finite.
    #[must_use]
    pub fn divergence(&self) -> Option<Divergence> {
        self.divergence
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
        if !self.arms[robot].is_trajectory_finite() {
            self.record_runaway(|index, _| index == robot);
        }
    }

    /// Records the robots for which `is_runaway` is true, unless others were recorded earlier.
    fn record_runaway(&mut self, is_runaway: impl Fn(usize, &Arm) -> bool) {
        let mut found = [false; 2];
        for (robot, arm) in self.arms.iter().enumerate() {
            found[robot] = is_runaway(robot, arm);
        }
        if found != [false; 2] {
            self.runaway_robots.get_or_insert(found);
        }
    }

    /// Imposes the motion of robot 0's mallet from now on, or lets its arm move it again (`None`). With an imposed mallet
    /// robot 0's arm stays where it is.
    pub fn impose_mallet(&mut self, mallet: Option<MalletState>) {
        self.imposed_mallet = mallet;
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

    /// The puck's state, in the table frame.
    #[must_use]
    pub fn puck(&self) -> &Puck {
        &self.puck
    }

    /// The contacts of the puck that began in the last or current control step.
    #[must_use]
    pub fn impacts(&self) -> &Impacts {
        &self.impacts
    }

    /// Positions of a robot's driven joints, rad.
    #[must_use]
    pub fn joints(&self, robot: usize) -> [f64; JOINTS] {
        driven(&self.arms[robot].q)
    }

    /// True velocities of a robot's driven joints, rad/s.
    #[must_use]
    pub fn joint_velocities(&self, robot: usize) -> [f64; JOINTS] {
        driven(&self.arms[robot].dq)
    }

    /// Low-pass filtered velocities of a robot's driven joints, rad/s.
    #[must_use]
    pub fn filtered_velocities(&self, robot: usize) -> &[f64; JOINTS] {
        &self.arms[robot].dq_filtered
    }

    /// Angles of a robot's universal joint (the two hinges of its mallet), rad.
    #[must_use]
    pub fn universal(&self, robot: usize) -> [f64; 2] {
        let q = &self.arms[robot].q;
        [q[7], q[8]]
    }

    /// Torques of a robot's drives in the last substep, N m.
    #[must_use]
    pub fn torques(&self, robot: usize) -> &[f64; JOINTS] {
        &self.arms[robot].torque
    }

    /// A robot's forward kinematics, in its own base frame.
    #[must_use]
    pub fn kinematics(&self, robot: usize) -> Kinematics<f64> {
        Kinematics::new(&self.arms[robot].q)
    }

    /// Position of a robot's end effector before the last substep, m, in its own base frame. The observation of the opponent shows it,
    /// as in the simulator of the 2023 Robot Air Hockey Challenge.
    #[must_use]
    pub fn end_effector_before(&self, robot: usize) -> [f64; 3] {
        self.arms[robot].ee_before
    }

    /// The state of a robot's mallet.
    #[must_use]
    pub fn mallet(&self, robot: usize) -> MalletState {
        if let (0, Some(mallet)) = (robot, self.imposed_mallet) {
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
        let sign = axis_sign(robot);
        MalletState {
            position: table_from_robot(robot, centre.to_array()),
            velocity: [sign * vx, sign * vy],
        }
    }

    /// Commands a robot's last commanded position again, at rest, for the coming control step.
    pub fn hold(&mut self, robot: usize, interpolation: Interpolation) {
        self.arms[robot].hold(interpolation);
    }

    /// Continues a robot's last trajectory for the coming control step: at constant velocity for 80 ms in total,
    /// then at rest.
    pub fn coast(&mut self, robot: usize) {
        self.arms[robot].coast();
    }

    /// Replaces the decay rate of the puck's linear velocity, 1/s; its spin is damped as before.
    pub fn set_puck_damping(&mut self, rate_per_s: f64) {
        self.puck_damping = Damping::with_decay_rate(rate_per_s);
    }
}

/// The first seven numbers: those of the driven joints, without the mallet's hinges.
fn driven(q: &[f64; DOFS]) -> [f64; JOINTS] {
    std::array::from_fn(|i| q[i])
}
