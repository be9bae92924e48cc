//! *Scalar arms*: arms that are solved one by one instead of together with others in SIMD lanes. These are arms in contact, and arms with a
//! joint at its stop (the end of its range).

use super::{
    arm_lanes::ArmLanes,
    contact_detection::{MalletPose, find_contacts},
    contacts::Contacts,
    lane_worlds::LaneWorld,
    solver::{Mass, Problem, accelerations, accelerations_in_contact},
};
use crate::{
    dynamics::{
        arm::Kinematics,
        lanes::{Lanes, MAX_LANES, row, set_row},
        spatial::{Motion, Vec3},
    },
    model::DOFS,
};

/// Dynamics of all arms in one substep, before constraints and contacts.
#[derive(Debug)]
pub struct ArmDynamics<T> {
    pub kinematics: Kinematics<T>,
    /// Joint-space inertias of the arms, kg m².
    pub mass: Mass<T>,
    /// Torques of the controllers minus bias (gravity, centrifugal and Coriolis torques) and damping, N m.
    pub load: [T; DOFS],
}

impl<T: Lanes> ArmDynamics<T> {
    /// The equations of one arm.
    pub fn problem(&self, lane: usize) -> Problem {
        Problem {
            mass: std::array::from_fn(|i| row(&self.mass[i], lane)),
            load: row(&self.load, lane),
        }
    }
}

/// Solutions of the scalar arms, by lane.
#[derive(Debug)]
pub struct ScalarSolutions {
    /// The lanes of the scalar arms, as bits.
    pub lanes: u32,
    /// The lanes of the arms in contact, as bits.
    lanes_in_contact: u32,
    solutions: [ArmSolution; MAX_LANES],
}

#[derive(Debug, Clone, Copy)]
struct ArmSolution {
    /// rad/s².
    acceleration: [f64; DOFS],
    /// Torques of the contacts, N m.
    contact_torque: [f64; DOFS],
    /// Torques of dry friction and stops, N m.
    constraint_torque: [f64; DOFS],
}

impl ScalarSolutions {
    pub fn empty() -> Self {
        let zero = ArmSolution {
            acceleration: [0.0; DOFS],
            contact_torque: [0.0; DOFS],
            constraint_torque: [0.0; DOFS],
        };
        Self {
            lanes: 0,
            lanes_in_contact: 0,
            solutions: [zero; MAX_LANES],
        }
    }

    /// Removes the solutions of the previous substep.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.lanes = 0;
        self.lanes_in_contact = 0;
    }

    /// Writes the solutions into their lanes: accelerations, torques of the constraints, and torques of contacts, which are added to the
    /// load.
    #[cold]
    #[inline(never)]
    pub fn insert<T: Lanes>(
        &self,
        acceleration: &mut [T; DOFS],
        constraint_torque: &mut [T; DOFS],
        load: &mut [T; DOFS],
    ) {
        for (lane, solved) in self.solutions.iter().enumerate() {
            let contains = |lanes: u32| lanes >> lane & 1 == 1;
            if contains(self.lanes) {
                set_row(acceleration, lane, &solved.acceleration);
                set_row(constraint_torque, lane, &solved.constraint_torque);
            }
            if contains(self.lanes_in_contact) {
                let mut torques = row(load, lane);
                for i in 0..DOFS {
                    torques[i] += solved.contact_torque[i];
                }
                set_row(load, lane, &torques);
            }
        }
    }
}

/// Solves one world's contacts, if it has any, and with them its arms. `centres` are the centres of its mallets, m, each in its robot's
/// base frame.
#[cold]
#[inline(never)]
pub fn solve_contacts<T: Lanes, A>(
    arms: &ArmLanes<T>,
    lane_world: &mut LaneWorld<'_, A>,
    dynamics: &ArmDynamics<T>,
    centres: &[[f64; 3]; 2],
    scalar: &mut ScalarSolutions,
) {
    let world = &mut *lane_world.world;
    let kinematics = &dynamics.kinematics;
    let lane_of = |robot: usize| (lane_world.first_lane + robot).min(T::COUNT - 1);
    let mallets: [MalletPose; 2] = std::array::from_fn(|robot| MalletPose {
        centre: centres[robot],
        axis: kinematics.mallet_axis.lane(lane_of(robot)),
    });
    let motion = |robot: usize| {
        let lane = lane_of(robot);
        let vector = |v: &Vec3<T>| {
            let [x, y, z] = v.lane(lane);
            Vec3::new(x, y, z)
        };
        let axes = std::array::from_fn(|i| Motion {
            angular: vector(&kinematics.axes[i].angular),
            linear: vector(&kinematics.axes[i].linear),
        });
        (axes, row(&arms.motion.dq, lane))
    };
    let robots = world.arms.len();
    let contacts = find_contacts(&mallets[..robots], motion, &world.puck);
    let touching = contacts.as_ref().map_or(0, Contacts::touching);
    world
        .impacts
        .record_touching(touching, world.substep, &world.puck);
    let Some(contacts) = contacts else {
        return;
    };
    let free_acceleration = world
        .puck
        .free_acceleration(&world.puck_damping, world.air_n);
    let robots_in_contact = contacts.arms_in_contact();
    if robots_in_contact == [false; 2] {
        lane_world.puck_force = Some(contacts.solve_puck(&free_acceleration));
        return;
    }
    world.last_contact_robots = robots_in_contact;
    for (robot, arm) in world.arms.iter_mut().enumerate() {
        let lane = lane_of(robot);
        arms.friction.store(lane, &mut arm.constraints);
        let (q, dq) = (row(&arms.motion.q, lane), row(&arms.motion.dq, lane));
        arm.constraints.prepare_stops(&world.plant, &q, &dq);
    }
    let problems = [0, 1].map(|robot| dynamics.problem(lane_of(robot)));
    let (accelerations, forces) =
        accelerations_in_contact(&mut world.arms, &problems, &contacts, &free_acceleration);
    for (robot, arm) in world.arms.iter().enumerate() {
        let lane = lane_of(robot);
        scalar.lanes |= 1 << lane;
        scalar.lanes_in_contact |= 1 << lane;
        scalar.solutions[lane] = ArmSolution {
            acceleration: accelerations[robot],
            contact_torque: forces.arm_torques[robot],
            constraint_torque: arm.constraints.torques(&accelerations[robot]),
        };
    }
    lane_world.puck_force = Some(forces.puck);
}

/// Solves the arms of a world that have, or had in the previous substep, a joint beyond its stop. `beyond_stop` has the
/// bits of the lanes that have one now.
#[cold]
#[inline(never)]
pub fn solve_stops<T: Lanes, A>(
    arms: &ArmLanes<T>,
    lane_world: &mut LaneWorld<'_, A>,
    dynamics: &ArmDynamics<T>,
    beyond_stop: u32,
    scalar: &mut ScalarSolutions,
) {
    let world = &mut *lane_world.world;
    for (robot, arm) in world.arms.iter_mut().enumerate() {
        let lane = lane_world.first_lane + robot;
        let contains = |lanes: u32| lanes >> lane & 1 == 1;
        let constraints = &mut arm.constraints;
        if contains(scalar.lanes) || !(contains(beyond_stop) || constraints.was_at_stop()) {
            continue;
        }
        arms.friction.store(lane, constraints);
        let (q, dq) = (row(&arms.motion.q, lane), row(&arms.motion.dq, lane));
        constraints.prepare_stops(&world.plant, &q, &dq);
        let acceleration = accelerations(constraints, &dynamics.problem(lane));
        scalar.lanes |= 1 << lane;
        scalar.solutions[lane] = ArmSolution {
            acceleration,
            contact_torque: [0.0; DOFS],
            constraint_torque: constraints.torques(&acceleration),
        };
    }
}
