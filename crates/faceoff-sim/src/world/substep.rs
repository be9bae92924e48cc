//! One millisecond of the arms of one world, or of several worlds in lanes.
//!
//! What every arm goes through in every substep is computed in lanes, with masks for what only some of them
//! do. What is rare is done arm by arm or world by world: contacts, joints at their stops, frictions whose
//! set of bounds has changed, states that are no ordinary ones.

use super::{
    apart::{Apart, Prepared, stop_apart, touch_apart},
    arm::Arm,
    arm_lanes::{ArmLanes, MotionLanes},
    bounds::{is_ordinary, is_ordinary_puck},
    seats::{Seat, seat_of},
    solver::search,
    touching::may_touch,
};
use crate::{
    dynamics::{
        arm::{Bodies, Kinematics, controller_torques, damped, mass_matrix, plant_bias},
        lanes::{Lanes, row, set_row},
        ldlt::Ldlt,
    },
    model::{DOFS, JOINTS, LINKS, SUBSTEP_S},
    robot::{
        controller::{filter_velocity, torque},
        trajectory::Setpoint,
    },
    table::puck::Puck,
};
use std::f64::consts::FRAC_PI_2;

/// One substep of all arms in the lanes, and of their pucks.
#[inline(always)]
pub fn substep<T: Lanes, A>(arms: &mut ArmLanes<T>, seats: &mut [Seat<'_, A>], apart: &mut Apart) {
    let before = arms.motion;
    let prepared = prepare(arms, seats);
    apart.clear();
    meet(arms, seats, &prepared, apart);

    let mut acceleration = ordinary_accelerations(arms, seats, &prepared, apart);
    let mut constraint = [T::splat(0.0); DOFS];
    constraint[..JOINTS].copy_from_slice(&arms.friction.torques(&acceleration));
    let mut load = prepared.load;
    if apart.lanes != 0 {
        apart.insert(&mut acceleration, &mut constraint, &mut load);
    }
    for i in 0..DOFS {
        load[i] += constraint[i];
    }

    // Semi-implicit Euler, joint damping implicit.
    let acceleration = Ldlt::new(&damped(&prepared.mass, &arms.plant.damping)).solve(&load);
    let motion = &mut arms.motion;
    let step = T::splat(SUBSTEP_S);
    for i in 0..DOFS {
        motion.dq[i] += step * acceleration[i];
        motion.q[i] += step * motion.dq[i];
    }
    filter_velocity(&mut motion.dq_filtered, &motion.dq);
    let ordinary = T::bits(is_ordinary(motion));
    for seat in seats.iter_mut().filter(|seat| seat.moves) {
        let puck = seat.world.puck;
        seat.world.advance_puck(seat.puck_force.take());
        if ordinary & seat.lanes() != seat.lanes() || !is_ordinary_puck(&seat.world.puck) {
            look_closer(arms, seat, &before, puck);
        }
    }
}

#[inline(always)]
fn prepare<T: Lanes, A>(arms: &mut ArmLanes<T>, seats: &[Seat<'_, A>]) -> Prepared<T> {
    let desired = Setpoint::gather(|lane| {
        let (seat, arm) = seat_of(seats, lane);
        &seat.world.arms[arm].trajectory[seat.world.substep]
    });
    let MotionLanes { q, dq, dq_filtered } = &arms.motion;
    let plant = &arms.plant;

    // One forward pass serves controller and plant.
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
    let universal = arms
        .universal
        .torque(ee.x, ee.y, [q[7], q[8]], [dq[7], dq[8]]);
    let mut load = [T::splat(0.0); DOFS];
    for i in 0..JOINTS {
        load[i] = arms.torque[i] - bias[i] - plant.damping[i] * dq[i];
    }
    for i in 0..2 {
        load[7 + i] = universal[i] - bias[7 + i];
    }
    arms.friction.prepare(dq);
    arms.ee_before = ee.origin;
    Prepared {
        kinematics,
        mass,
        load,
    }
}

/// Solves contacts and joints at their stops, apart from the ordinary arms.
#[inline(always)]
fn meet<T: Lanes, A>(
    arms: &ArmLanes<T>,
    seats: &mut [Seat<'_, A>],
    prepared: &Prepared<T>,
    apart: &mut Apart,
) {
    let centre = prepared.kinematics.cylinder_centre();
    let beyond = T::bits(is_beyond(&arms.motion.q));
    for seat in seats.iter_mut().filter(|seat| seat.moves) {
        let lanes = [seat.first, (seat.first + 1).min(T::COUNT - 1)];
        let centres = lanes.map(|lane| centre.lane(lane));
        let robots = seat.world.arms.len();
        if may_touch(&centres[..robots], &seat.world.puck) {
            touch_apart(arms, seat, prepared, &centres, apart);
        } else {
            seat.world.impacts.part();
        }
        let stopped = |arm: &Arm| arm.constraints.any_stop();
        if beyond & seat.lanes() != 0 || seat.world.arms.iter().any(stopped) {
            stop_apart(arms, seat, prepared, beyond, apart);
        }
    }
}

/// Is a joint beyond its stop?
#[inline(always)]
fn is_beyond<T: Lanes>(q: &[T; DOFS]) -> T::Mask {
    let joint = |i: usize| {
        let range = LINKS.get(i).map_or(FRAC_PI_2, |link| link.range_rad);
        T::splat(range).below(q[i].abs())
    };
    let mut beyond = joint(0);
    for i in 1..DOFS {
        beyond = T::either(beyond, joint(i));
    }
    beyond
}

/// Accelerations under the load and dry friction: by the remembered set of bounds, and where that has
/// changed by a search for the right one. Lanes that were solved apart are left as they are.
#[inline(always)]
fn ordinary_accelerations<T: Lanes, A>(
    arms: &mut ArmLanes<T>,
    seats: &mut [Seat<'_, A>],
    prepared: &Prepared<T>,
    apart: &Apart,
) -> [T; DOFS] {
    let mut matrix = prepared.mass;
    let mut rhs = prepared.load;
    let (diagonal, torque) = arms.friction.assemble();
    for i in 0..DOFS {
        rhs[i] += torque.get(i).copied().unwrap_or(T::splat(0.0));
    }
    for i in 0..JOINTS {
        matrix[i][i] += diagonal[i];
    }
    let mut acceleration = Ldlt::new(&matrix).solve(&rhs);
    let set = arms.friction.classify(&acceleration);
    if set.changed | apart.lanes != 0 {
        arms.friction.accept(&set);
        let changed = set.changed & !apart.lanes;
        correct(
            arms,
            seats,
            prepared,
            changed,
            apart.lanes,
            &mut acceleration,
        );
    }
    acceleration
}

/// Searches for the sets of bounds of some arms, and takes over those of arms that were solved apart.
#[cold]
#[inline(never)]
fn correct<T: Lanes, A>(
    arms: &mut ArmLanes<T>,
    seats: &mut [Seat<'_, A>],
    prepared: &Prepared<T>,
    changed: u32,
    apart: u32,
    acceleration: &mut [T; DOFS],
) {
    for seat in seats.iter_mut().filter(|seat| seat.moves) {
        for (a, arm) in seat.world.arms.iter_mut().enumerate() {
            let lane = seat.first + a;
            let constraints = &mut arm.constraints;
            if changed >> lane & 1 == 1 {
                arms.friction.store(lane, constraints);
                let mut found = row(acceleration, lane);
                search(constraints, &prepared.problem(lane), &mut found);
                set_row(acceleration, lane, &found);
                arms.friction.load(lane, constraints);
            } else if apart >> lane & 1 == 1 {
                arms.friction.load(lane, constraints);
            }
        }
    }
}

/// Looks closer at a world whose state is not an ordinary one; it goes back to where all was inside of its
/// bounds, and stands still, if it has left them.
#[cold]
#[inline(never)]
fn look_closer<T: Lanes, A>(
    arms: &mut ArmLanes<T>,
    seat: &mut Seat<'_, A>,
    before: &MotionLanes<T>,
    puck: Puck,
) {
    let world = &mut *seat.world;
    for (a, arm) in world.arms.iter_mut().enumerate() {
        arms.store(seat.first + a, arm);
    }
    let Some(what) = world.extraordinary() else {
        return;
    };
    world.puck = puck;
    for (a, arm) in world.arms.iter_mut().enumerate() {
        let lane = seat.first + a;
        arms.motion.replace(lane, before);
        before.store(lane, arm);
    }
    world.diverge(what);
}
