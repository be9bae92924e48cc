//! Arms that are solved one by one, apart from the ordinary ones in their lanes: those that a contact pushes,
//! and those with a joint at its stop.

use super::{
    arm_lanes::ArmLanes,
    contacts::Contacts,
    seats::Seat,
    solver::{Mass, Problem, accelerations, accelerations_in_contact},
    touching::{MalletPose, find_contacts},
};
use crate::{
    dynamics::{
        arm::Kinematics,
        lanes::{Lanes, MAX_LANES, row, set_row},
        spatial::{Motion, Vec3},
    },
    model::DOFS,
};

/// What is known of all arms before their accelerations.
#[derive(Debug)]
pub struct Prepared<T> {
    pub kinematics: Kinematics<T>,
    /// The plants' inertias, kg m².
    pub mass: Mass<T>,
    /// Torques of controllers, less bias and damping, N m.
    pub load: [T; DOFS],
}

impl<T: Lanes> Prepared<T> {
    /// What is to be solved for one arm.
    pub fn problem(&self, lane: usize) -> Problem {
        Problem {
            mass: std::array::from_fn(|i| row(&self.mass[i], lane)),
            load: row(&self.load, lane),
        }
    }
}

/// What came of the arms that were solved apart.
#[derive(Debug)]
pub struct Apart {
    /// Their lanes, as bits.
    pub lanes: u32,
    /// Those that a contact pushes.
    pushed: u32,
    solved: [Solved; MAX_LANES],
}

#[derive(Debug, Clone, Copy)]
struct Solved {
    /// rad/s².
    acceleration: [f64; DOFS],
    /// Torques of the contacts, N m.
    contact: [f64; DOFS],
    /// Torques of dry friction and stops, N m.
    constraint: [f64; DOFS],
}

impl Apart {
    pub fn none() -> Self {
        let nothing = Solved {
            acceleration: [0.0; DOFS],
            contact: [0.0; DOFS],
            constraint: [0.0; DOFS],
        };
        Self {
            lanes: 0,
            pushed: 0,
            solved: [nothing; MAX_LANES],
        }
    }

    /// Forgets the last substep's.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.lanes = 0;
        self.pushed = 0;
    }

    /// Puts what came of them into their lanes.
    #[cold]
    #[inline(never)]
    pub fn insert<T: Lanes>(
        &self,
        acceleration: &mut [T; DOFS],
        constraint: &mut [T; DOFS],
        load: &mut [T; DOFS],
    ) {
        for (lane, solved) in self.solved.iter().enumerate() {
            let is_in = |lanes: u32| lanes >> lane & 1 == 1;
            if is_in(self.lanes) {
                set_row(acceleration, lane, &solved.acceleration);
                set_row(constraint, lane, &solved.constraint);
            }
            if is_in(self.pushed) {
                let mut torques = row(load, lane);
                for i in 0..DOFS {
                    torques[i] += solved.contact[i];
                }
                set_row(load, lane, &torques);
            }
        }
    }
}

/// Solves one world's contacts, if it has any. `centres` are those of its mallets, m, the robots' base frames.
#[cold]
#[inline(never)]
pub fn touch_apart<T: Lanes, A>(
    arms: &ArmLanes<T>,
    seat: &mut Seat<'_, A>,
    prepared: &Prepared<T>,
    centres: &[[f64; 3]; 2],
    apart: &mut Apart,
) {
    let world = &mut *seat.world;
    let kinematics = &prepared.kinematics;
    let lane_of = |robot: usize| (seat.first + robot).min(T::COUNT - 1);
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
    let found = find_contacts(&mallets[..robots], motion, &world.puck);
    let touching = found.as_ref().map_or(0, Contacts::touching);
    world.impacts.touch(touching, world.substep, &world.puck);
    let Some(contacts) = found else {
        return;
    };
    let free = world
        .puck
        .free_acceleration(&world.puck_damping, world.air_n);
    let pushed = contacts.pushed();
    if pushed == [false; 2] {
        seat.puck_force = Some(contacts.solve_puck(&free));
        return;
    }
    world.pushed = pushed;
    for (robot, arm) in world.arms.iter_mut().enumerate() {
        let lane = lane_of(robot);
        arms.friction.store(lane, &mut arm.constraints);
        let (q, dq) = (row(&arms.motion.q, lane), row(&arms.motion.dq, lane));
        arm.constraints.prepare_stops(&world.plant, &q, &dq);
    }
    let problems = [0, 1].map(|robot| prepared.problem(lane_of(robot)));
    let (accelerations, forces) =
        accelerations_in_contact(&mut world.arms, &problems, &contacts, &free);
    for (robot, arm) in world.arms.iter().enumerate() {
        let lane = lane_of(robot);
        apart.lanes |= 1 << lane;
        apart.pushed |= 1 << lane;
        apart.solved[lane] = Solved {
            acceleration: accelerations[robot],
            contact: forces.arms[robot],
            constraint: arm.constraints.torques(&accelerations[robot]),
        };
    }
    seat.puck_force = Some(forces.puck);
}

/// Solves those arms of a world that have a joint at its stop, or had one a substep before. `beyond` tells the
/// lanes in which a joint is.
#[cold]
#[inline(never)]
pub fn stop_apart<T: Lanes, A>(
    arms: &ArmLanes<T>,
    seat: &mut Seat<'_, A>,
    prepared: &Prepared<T>,
    beyond: u32,
    apart: &mut Apart,
) {
    let world = &mut *seat.world;
    for (robot, arm) in world.arms.iter_mut().enumerate() {
        let lane = seat.first + robot;
        let is_in = |lanes: u32| lanes >> lane & 1 == 1;
        let constraints = &mut arm.constraints;
        if is_in(apart.lanes) || !(is_in(beyond) || constraints.any_stop()) {
            continue;
        }
        arms.friction.store(lane, constraints);
        let (q, dq) = (row(&arms.motion.q, lane), row(&arms.motion.dq, lane));
        constraints.prepare_stops(&world.plant, &q, &dq);
        let acceleration = accelerations(constraints, &prepared.problem(lane));
        apart.lanes |= 1 << lane;
        apart.solved[lane] = Solved {
            acceleration,
            contact: [0.0; DOFS],
            constraint: constraints.torques(&acceleration),
        };
    }
}
