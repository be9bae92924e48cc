//! Solves for one arm's accelerations, joint constraint torques and contact forces.
//!
//! Without contacts, the joint constraints minimise a convex, piecewise quadratic function (as in the
//! reference engine). Newton's method with the stored set of bounds is exact if the set is right. It almost always
//! is, and the check is done in lanes. This module handles the other cases by an exact line search for the right
//! set.

use super::{
    arm::Arm,
    contacts::{ContactForces, Contacts},
    joints::JointConstraints,
};
use crate::{dynamics::ldlt::Ldlt, model::DOFS};

/// Largest number of Newton steps. If one is not enough, two or three usually are.
const NEWTON_ROUNDS: usize = 50;

/// Largest number of iterations between joint constraints and contacts.
const CONTACT_ROUNDS: usize = 20;

/// A matrix, lower triangle.
pub type Mass<T> = [[T; DOFS]; DOFS];

/// Equations of one arm, `mass · acceleration = load`.
#[derive(Debug, Clone, Copy)]
pub struct Problem {
    /// The plant's inertia, kg m².
    pub mass: Mass<f64>,
    /// Torques without constraints and contacts, N m.
    pub load: [f64; DOFS],
}

/// Accelerations without contacts. The constraints store which of them are at their bounds.
#[cold]
pub fn accelerations(constraints: &mut JointConstraints, problem: &Problem) -> [f64; DOFS] {
    let (_, mut acceleration) = newton_step(constraints, problem);
    if constraints.classify(&acceleration) {
        search(constraints, problem, &mut acceleration);
    }
    acceleration
}

/// The accelerations for the current set of bounds.
fn newton_step(constraints: &JointConstraints, problem: &Problem) -> (Ldlt<f64>, [f64; DOFS]) {
    let mut matrix = problem.mass;
    let mut rhs = problem.load;
    let (stiffness, torque) = constraints.assemble();
    add(&mut rhs, &torque);
    for i in 0..DOFS {
        matrix[i][i] += stiffness[i];
    }
    let factor = Ldlt::new(&matrix);
    (factor, factor.solve(&rhs))
}

/// Newton's method with line search, from accelerations that match the current set of bounds.
#[cold]
pub fn search(
    constraints: &mut JointConstraints,
    problem: &Problem,
    acceleration: &mut [f64; DOFS],
) {
    for _ in 0..NEWTON_ROUNDS {
        let (_, full) = newton_step(constraints, problem);
        if !constraints.classify(&full) {
            *acceleration = full;
            break;
        }
        let from = *acceleration;
        let direction: [f64; DOFS] = std::array::from_fn(|i| full[i] - from[i]);
        let mut residual = multiply(&problem.mass, &from);
        for i in 0..DOFS {
            residual[i] -= problem.load[i];
        }
        let along = multiply(&problem.mass, &direction);
        let curvature = (0..DOFS).map(|i| along[i] * direction[i]).sum();
        let t = constraints.line_search(&from, &direction, &residual, curvature);
        *acceleration = std::array::from_fn(|i| from[i] + t * direction[i]);
        constraints.classify(acceleration);
    }
}

/// Accelerations of one or two arms together with contact forces. In the contact equations the arms' inertia
/// includes the joint constraints that are within their bounds.
#[cold]
pub fn accelerations_in_contact(
    arms: &mut [Arm],
    problems: &[Problem; 2],
    contacts: &Contacts,
    puck_acceleration: &[f64; 3],
) -> ([[f64; DOFS]; 2], ContactForces) {
    let mut acceleration = [[0.0; DOFS]; 2];
    let mut forces = ContactForces {
        puck: [0.0; 3],
        arms: [[0.0; DOFS]; 2],
    };
    for _ in 0..CONTACT_ROUNDS {
        let factors: [Ldlt<f64>; 2] = std::array::from_fn(|a| {
            let arm = &arms[a.min(arms.len() - 1)];
            let (factor, free) = newton_step(&arm.constraints, &problems[a]);
            acceleration[a] = free;
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
                let mut pushed = problems[a];
                add(&mut pushed.load, &forces.arms[a]);
                search(&mut arm.constraints, &pushed, &mut acceleration[a]);
            }
        }
        if !changed {
            break;
        }
    }
    (acceleration, forces)
}

/// A matrix, given by its lower triangle, times a vector.
fn multiply(matrix: &Mass<f64>, v: &[f64; DOFS]) -> [f64; DOFS] {
    std::array::from_fn(|i| (0..DOFS).map(|j| matrix[i.max(j)][i.min(j)] * v[j]).sum())
}

fn add(a: &mut [f64; DOFS], b: &[f64; DOFS]) {
    for i in 0..DOFS {
        a[i] += b[i];
    }
}
