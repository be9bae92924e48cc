//! One *substep* (1 ms of physics) of the arms of one world, or of several worlds in the lanes of SIMD registers: each arm has a lane.
//!
//! The common computations are done in lanes, with masks for conditions. Rare cases are computed per arm or per
//! world ("scalar" below): contacts, joints at their stops, changes in which joints' dry friction is at its bound, and states outside
//! the ordinary range.

use super::{
    arm::Arm,
    arm_lanes::{ArmLanes, MotionLanes},
    bounds::{is_ordinary, is_ordinary_puck},
    contact_detection::may_touch,
    lane_worlds::{LaneWorld, world_in_lane},
    scalar_arms::{ArmDynamics, ScalarSolutions, solve_contacts, solve_stops},
    solver::search_bound_set,
};
use crate::{
    dynamics::{
        arm::{
            Bodies, Kinematics, controller_torques, damped_mass_matrix, mass_matrix, plant_bias,
        },
        lanes::{Lanes, row, set_row},
        ldlt::Ldlt,
    },
    model::{DOFS, HINGE_RANGE_RAD, JOINTS, LINKS, SUBSTEP_S},
    robot::{
        controller::{filter_velocity, torque},
        trajectory::Setpoint,
    },
    table::puck::Puck,
};

/// One substep of all arms in the lanes, and of the pucks of their worlds.
#[inline(always)]
pub fn substep<T: Lanes, A>(
    arms: &mut ArmLanes<T>,
    lane_worlds: &mut [LaneWorld<'_, A>],
    scalar: &mut ScalarSolutions,
) {
    let motion_before = arms.motion;
    let dynamics = arm_dynamics(arms, lane_worlds);
    scalar.clear();
    solve_contacts_and_stops(arms, lane_worlds, &dynamics, scalar);

    let mut acceleration = ordinary_accelerations(arms, lane_worlds, &dynamics, scalar);
    // Torques of dry friction, and of stops in scalar lanes, N m.
    let mut constraint_torque = [T::splat(0.0); DOFS];
    constraint_torque[..JOINTS].copy_from_slice(&arms.friction.torques(&acceleration));
    let mut load = dynamics.load;
    if scalar.lanes != 0 {
        scalar.insert(&mut acceleration, &mut constraint_torque, &mut load);
    }
    for i in 0..DOFS {
        load[i] += constraint_torque[i];
    }

    // Semi-implicit Euler step, with implicit joint damping.
    let acceleration =
        Ldlt::new(&damped_mass_matrix(&dynamics.mass, &arms.plant.damping)).solve(&load);
    let motion = &mut arms.motion;
    let step = T::splat(SUBSTEP_S);
    for i in 0..DOFS {
        motion.dq[i] += step * acceleration[i];
        motion.q[i] += step * motion.dq[i];
    }
    filter_velocity(&mut motion.dq_filtered, &motion.dq);
    let ordinary = T::bits(is_ordinary(motion));
    for lane_world in lane_worlds
        .iter_mut()
        .filter(|lane_world| lane_world.is_moving)
    {
        let puck_before = lane_world.world.puck;
        lane_world.world.advance_puck(lane_world.puck_force.take());
        if ordinary & lane_world.lanes() != lane_world.lanes()
            || !is_ordinary_puck(&lane_world.world.puck)
        {
            check_world(arms, lane_world, &motion_before, puck_before);
        }
    }
}

/// Computes the equations of motion of all arms, and the torques of their controllers.
#[inline(always)]
fn arm_dynamics<T: Lanes, A>(
    arms: &mut ArmLanes<T>,
    lane_worlds: &[LaneWorld<'_, A>],
) -> ArmDynamics<T> {
    let desired = Setpoint::gather(|lane| {
        let (lane_world, arm) = world_in_lane(lane_worlds, lane);
        &lane_world.world.arms[arm].trajectory[lane_world.world.substep]
    });
    let MotionLanes { q, dq, dq_filtered } = &arms.motion;
    let plant = &arms.plant;

    // The controller's model and the plant (the simulated arm) share the forward kinematics.
    let kinematics = Kinematics::new(q);
    let bodies = Bodies::new(&kinematics);
    let feed_forward = controller_torques(
        &kinematics,
        &bodies.controller(),
        dq_filtered,
        &desired.acceleration,
    );
    let bodies = bodies.plant(&plant.mass_scale);
    let bias = plant_bias(&kinematics, &bodies, dq);
    let mass = mass_matrix(&kinematics, &bodies);

    let command = arms.limiter.limit(&desired);
    arms.torque = torque(plant, &command, q, dq_filtered, &feed_forward);
    let ee = &kinematics.end_effector;
    let universal_torque =
        arms.universal_controller
            .torque(ee.x, ee.y, [q[7], q[8]], [dq[7], dq[8]]);
    let mut load = [T::splat(0.0); DOFS];
    for i in 0..JOINTS {
        load[i] = arms.torque[i] - bias[i] - plant.damping[i] * dq[i];
    }
    for i in 0..2 {
        load[7 + i] = universal_torque[i] - bias[7 + i];
    }
    arms.friction.prepare(dq);
    arms.ee_before = ee.origin;
    ArmDynamics {
        kinematics,
        mass,
        load,
    }
}

/// Solves contacts and joints at their stops, arm by arm.
#[inline(always)]
fn solve_contacts_and_stops<T: Lanes, A>(
    arms: &ArmLanes<T>,
    lane_worlds: &mut [LaneWorld<'_, A>],
    dynamics: &ArmDynamics<T>,
    scalar: &mut ScalarSolutions,
) {
    let centre = dynamics.kinematics.cylinder_centre();
    let beyond_stop = T::bits(is_beyond_stop(&arms.motion.q));
    for lane_world in lane_worlds
        .iter_mut()
        .filter(|lane_world| lane_world.is_moving)
    {
        let lanes = [
            lane_world.first_lane,
            (lane_world.first_lane + 1).min(T::COUNT - 1),
        ];
        let centres = lanes.map(|lane| centre.lane(lane));
        let robots = lane_world.world.arms.len();
        if may_touch(&centres[..robots], &lane_world.world.puck) {
            solve_contacts(arms, lane_world, dynamics, &centres, scalar);
        } else {
            lane_world.world.impacts.clear_touching();
        }
        let was_at_stop = |arm: &Arm| arm.constraints.was_at_stop();
        if beyond_stop & lane_world.lanes() != 0 || lane_world.world.arms.iter().any(was_at_stop) {
            solve_stops(arms, lane_world, dynamics, beyond_stop, scalar);
        }
    }
}

/// Mask of the arms with a joint beyond its stop (the end of its range).
#[inline(always)]
fn is_beyond_stop<T: Lanes>(q: &[T; DOFS]) -> T::Mask {
    let is_joint_beyond = |i: usize| {
        let range = LINKS.get(i).map_or(HINGE_RANGE_RAD, |link| link.range_rad);
        T::splat(range).less_than(q[i].abs())
    };
    let mut beyond = is_joint_beyond(0);
    for i in 1..DOFS {
        beyond = T::mask_or(beyond, is_joint_beyond(i));
    }
    beyond
}

/// Accelerations, rad/s², under load and dry friction. Each arm stores which of its frictions are at a bound (its *bound set*). If the
/// accelerations contradict the stored set, the right one is searched. Lanes of arms that were solved one by one are not searched.
#[inline(always)]
fn ordinary_accelerations<T: Lanes, A>(
    arms: &mut ArmLanes<T>,
    lane_worlds: &mut [LaneWorld<'_, A>],
    dynamics: &ArmDynamics<T>,
    scalar: &ScalarSolutions,
) -> [T; DOFS] {
    let mut matrix = dynamics.mass;
    let mut rhs = dynamics.load;
    let (diagonal, friction_torque) = arms.friction.assemble();
    for i in 0..DOFS {
        rhs[i] += friction_torque.get(i).copied().unwrap_or(T::splat(0.0));
    }
    for i in 0..JOINTS {
        matrix[i][i] += diagonal[i];
    }
    let mut acceleration = Ldlt::new(&matrix).solve(&rhs);
    let bound_sets = arms.friction.classify(&acceleration);
    if bound_sets.changed | scalar.lanes != 0 {
        arms.friction.store_bound_sets(&bound_sets);
        let changed = bound_sets.changed & !scalar.lanes;
        update_bound_sets(
            arms,
            lane_worlds,
            dynamics,
            changed,
            scalar.lanes,
            &mut acceleration,
        );
    }
    acceleration
}

/// Searches the bound sets of the arms in the lanes `changed`, and loads those of the arms in `scalar_lanes`, which were solved one by
/// one. Both are bits.
#[cold]
#[inline(never)]
fn update_bound_sets<T: Lanes, A>(
    arms: &mut ArmLanes<T>,
    lane_worlds: &mut [LaneWorld<'_, A>],
    dynamics: &ArmDynamics<T>,
    changed: u32,
    scalar_lanes: u32,
    acceleration: &mut [T; DOFS],
) {
    for lane_world in lane_worlds
        .iter_mut()
        .filter(|lane_world| lane_world.is_moving)
    {
        for (robot, arm) in lane_world.world.arms.iter_mut().enumerate() {
            let lane = lane_world.first_lane + robot;
            let constraints = &mut arm.constraints;
            if changed >> lane & 1 == 1 {
                arms.friction.store(lane, constraints);
                let mut found = row(acceleration, lane);
                search_bound_set(constraints, &dynamics.problem(lane), &mut found);
                set_row(acceleration, lane, &found);
                arms.friction.load_bound_set(lane, constraints);
            } else if scalar_lanes >> lane & 1 == 1 {
                arms.friction.load_bound_set(lane, constraints);
            }
        }
    }
}

/// Checks a world whose state is outside the ordinary range. If it has left its bounds, it returns to its previous
/// state and stops.
#[cold]
#[inline(never)]
fn check_world<T: Lanes, A>(
    arms: &mut ArmLanes<T>,
    lane_world: &mut LaneWorld<'_, A>,
    motion_before: &MotionLanes<T>,
    puck_before: Puck,
) {
    let world = &mut *lane_world.world;
    for (robot, arm) in world.arms.iter_mut().enumerate() {
        arms.store(lane_world.first_lane + robot, arm);
    }
    let Some(cause) = world.find_divergence_cause() else {
        return;
    };
    world.puck = puck_before;
    for (robot, arm) in world.arms.iter_mut().enumerate() {
        let lane = lane_world.first_lane + robot;
        arms.motion.replace(lane, motion_before);
        motion_before.store(lane, arm);
    }
    world.diverge(cause);
}
