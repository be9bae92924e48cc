//! Finds accelerations, joint constraint torques and contact forces that agree with each other.
//!
//! Without contacts, the joint constraints minimise a convex, piecewise quadratic function (as in the
//! reference engine). Newton's method with the remembered set of bounds is exact when the set is
//! right, which it nearly always is; otherwise an exact line search leads to the right one.

use super::{
    arm::Arm,
    contacts::{ContactForces, Contacts},
};
use crate::{
    dynamics::{lanes::Lanes, ldlt::Ldlt},
    model::DOFS,
};

/// Newton steps before the last one is taken as it is; two or three are usual where one is not
/// enough.
const NEWTON_ROUNDS: usize = 50;

/// Rounds between joint constraints and contacts.
const CONTACT_ROUNDS: usize = 20;

/// A matrix per lane, lower triangle.
pub type Mass<T> = [[T; DOFS]; DOFS];

/// Accelerations under `load` and the joint constraints, where nothing touches. The arms remember
/// which constraints are at their bounds.
#[inline(always)]
pub fn joint_accelerations<T: Lanes>(
    arms: &mut [Arm],
    mass: &Mass<T>,
    load: &[[f64; DOFS]; 2],
) -> [[f64; DOFS]; 2] {
    let solution = newton_step(arms, mass, load);
    let mut changed = false;
    let mut acceleration = [[0.0; DOFS]; 2];
    for (a, arm) in arms.iter_mut().enumerate() {
        acceleration[a] = std::array::from_fn(|i| solution[i].lane(a));
        changed |= arm.constraints.classify(&acceleration[a]);
    }
    if changed {
        search(arms, mass, load, &mut acceleration);
    }
    acceleration
}

/// The accelerations that the present sets of bounds lead to.
#[inline(always)]
fn newton_step<T: Lanes>(arms: &[Arm], mass: &Mass<T>, load: &[[f64; DOFS]; 2]) -> [T; DOFS] {
    let mut matrix = *mass;
    let mut rhs = *load;
    let mut diagonal = [[0.0; DOFS]; 2];
    for (a, arm) in arms.iter().enumerate() {
        let (stiffness, torque) = arm.constraints.assemble();
        diagonal[a] = stiffness;
        add(&mut rhs[a], &torque);
    }
    for i in 0..DOFS {
        matrix[i][i] += T::from_fn(|a| diagonal[a][i]);
    }
    let rhs: [T; DOFS] = std::array::from_fn(|i| T::from_fn(|a| rhs[a][i]));
    Ldlt::new(&matrix).solve(&rhs)
}

/// Newton's method with line search from accelerations whose sets of bounds are set.
#[cold]
fn search<T: Lanes>(
    arms: &mut [Arm],
    mass: &Mass<T>,
    load: &[[f64; DOFS]; 2],
    acceleration: &mut [[f64; DOFS]; 2],
) {
    for _ in 0..NEWTON_ROUNDS {
        let solution = newton_step(arms, mass, load);
        let mut changed = false;
        for (a, arm) in arms.iter_mut().enumerate() {
            let full: [f64; DOFS] = std::array::from_fn(|i| solution[i].lane(a));
            if !arm.constraints.classify(&full) {
                acceleration[a] = full;
                continue;
            }
            changed = true;
            let from = acceleration[a];
            let direction: [f64; DOFS] = std::array::from_fn(|i| full[i] - from[i]);
            let mut residual = multiply(mass, a, &from);
            for i in 0..DOFS {
                residual[i] -= load[a][i];
            }
            let along = multiply(mass, a, &direction);
            let curvature = (0..DOFS).map(|i| along[i] * direction[i]).sum();
            let t = arm
                .constraints
                .line_search(&from, &direction, &residual, curvature);
            acceleration[a] = std::array::from_fn(|i| from[i] + t * direction[i]);
            arm.constraints.classify(&acceleration[a]);
        }
        if !changed {
            break;
        }
    }
}

/// Accelerations and contact forces together: with the set of joint constraints at their bounds, the
/// contacts see arms whose inertia includes the other ones.
#[cold]
pub fn accelerations_in_contact<T: Lanes>(
    arms: &mut [Arm],
    mass: &Mass<T>,
    load: &[[f64; DOFS]; 2],
    contacts: &Contacts,
    puck_acceleration: &[f64; 3],
) -> ([[f64; DOFS]; 2], ContactForces) {
    let masses: [Mass<f64>; 2] = std::array::from_fn(|a| {
        let lane = a.min(T::COUNT - 1);
        std::array::from_fn(|i| std::array::from_fn(|j| mass[i][j].lane(lane)))
    });
    let mut acceleration = [[0.0; DOFS]; 2];
    let mut forces = ContactForces {
        puck: [0.0; 3],
        arms: [[0.0; DOFS]; 2],
    };
    for _ in 0..CONTACT_ROUNDS {
        let factors: [Ldlt<f64>; 2] = std::array::from_fn(|a| {
            let arm = &arms[a.min(T::COUNT - 1)];
            let mut matrix = masses[a];
            let (stiffness, torque) = arm.constraints.assemble();
            for i in 0..DOFS {
                matrix[i][i] += stiffness[i];
            }
            let factor = Ldlt::new(&matrix);
            let mut rhs = load[a];
            add(&mut rhs, &torque);
            acceleration[a] = factor.solve(&rhs);
            factor
        });
        forces = contacts.solve(puck_acceleration, &acceleration, |arm, torque| {
            factors[arm].solve(torque)
        });
        let mut changed = false;
        for (a, arm) in arms.iter_mut().enumerate() {
            add(&mut acceleration[a], &factors[a].solve(&forces.arms[a]));
            if arm.constraints.classify(&acceleration[a]) {
                changed = true;
                let mut load = load[a];
                add(&mut load, &forces.arms[a]);
                let single = std::slice::from_mut(arm);
                let mut from = [acceleration[a], [0.0; DOFS]];
                search(single, &masses[a], &[load, [0.0; DOFS]], &mut from);
                acceleration[a] = from[0];
            }
        }
        if !changed {
            break;
        }
    }
    (acceleration, forces)
}

/// One lane's matrix, given by its lower triangle, times a vector.
fn multiply<T: Lanes>(matrix: &Mass<T>, lane: usize, v: &[f64; DOFS]) -> [f64; DOFS] {
    std::array::from_fn(|i| {
        (0..DOFS)
            .map(|j| matrix[i.max(j)][i.min(j)].lane(lane) * v[j])
            .sum()
    })
}

#[inline(always)]
pub fn add(a: &mut [f64; DOFS], b: &[f64; DOFS]) {
    for i in 0..DOFS {
        a[i] += b[i];
    }
}
