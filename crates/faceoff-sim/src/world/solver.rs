//! Solves for the joint accelerations of one arm, the torques of its joint constraints (dry friction and stops) and the contact forces.
//!
//! Each joint constraint stores whether its torque is at a bound; together these are the *bound set*. Without contacts, the accelerations
//! minimise a convex, piecewise quadratic function, as in MuJoCo. Newton's method with the stored set is exact if the set is right. It
//! almost always is, and `substep.rs` checks that for several arms at once. This module handles the other cases by an exact line search
//! for the right set.

use super::{
    arm::Arm,
    contacts::{ContactForces, Contacts},
    joints::JointConstraints,
};
use crate::{dynamics::ldlt::Ldlt, model::DOFS};

/// Largest number of Newton steps. If one is not enough, two or three usually are.
const MAX_NEWTON_STEPS: usize = 50;

/// Largest number of alternations between the solution of the joint constraints and that of the contacts.
const MAX_CONTACT_ROUNDS: usize = 20;

/// A joint-space inertia matrix; only the lower triangle is used.
pub type Mass<T> = [[T; DOFS]; DOFS];

/// Equations of one arm, `mass · acceleration = load`.
#[derive(Debug, Clone, Copy)]
pub struct Problem {
    /// The plant's inertia, kg m².
    pub mass: Mass<f64>,
    /// Torques without constraints and contacts, N m.
    pub load: [f64; DOFS],
}

/// Accelerations without contacts, rad/s². Updates the bound set in `constraints`.
#[cold]
pub fn accelerations(constraints: &mut JointConstraints, problem: &Problem) -> [f64; DOFS] {
    let (_, mut acceleration) = newton_step(constraints, problem);
    if constraints.classify(&acceleration) {
        search_bound_set(constraints, problem, &mut acceleration);
    }
    acceleration
}

/// The accelerations (rad/s²) for the current bound set, and the factorisation of its matrix.
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

/// Searches the right bound set and its accelerations by Newton's method with line search. It starts from accelerations that match the
/// current set.
#[cold]
pub fn search_bound_set(
    constraints: &mut JointConstraints,
    problem: &Problem,
    acceleration: &mut [f64; DOFS],
) {
    for _ in 0..MAX_NEWTON_STEPS {
        let (_, newton) = newton_step(constraints, problem);
        if !constraints.classify(&newton) {
            *acceleration = newton;
            break;
        }
        let start = *acceleration;
        let direction: [f64; DOFS] = std::array::from_fn(|i| newton[i] - start[i]);
        let mut residual = multiply(&problem.mass, &start);
        for i in 0..DOFS {
            residual[i] -= problem.load[i];
        }
        let mass_times_direction = multiply(&problem.mass, &direction);
        let curvature = (0..DOFS)
            .map(|i| mass_times_direction[i] * direction[i])
            .sum();
        let t = constraints.line_search(&start, &direction, &residual, curvature);
        *acceleration = std::array::from_fn(|i| start[i] + t * direction[i]);
        constraints.classify(acceleration);
    }
}

/// Accelerations (rad/s²) of one or two arms together with the contact forces. In the contact equations the arms' inertia
/// includes the joint constraints that are within their bounds. `puck_acceleration` is the puck's without contacts (m/s², m/s², rad/s²).
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
        arm_torques: [[0.0; DOFS]; 2],
    };
    for _ in 0..MAX_CONTACT_ROUNDS {
        let factors: [Ldlt<f64>; 2] = std::array::from_fn(|a| {
            let arm = &arms[a.min(arms.len() - 1)];
            let (factor, without_contacts) = newton_step(&arm.constraints, &problems[a]);
            acceleration[a] = without_contacts;
            factor
        });
        forces = contacts.solve(puck_acceleration, &acceleration, |arm, torque| {
            factors[arm].solve(torque)
        });
        let mut changed = false;
        for (a, arm) in arms.iter_mut().enumerate() {
            add(
                &mut acceleration[a],
                &factors[a].solve(&forces.arm_torques[a]),
            );
            if arm.constraints.classify(&acceleration[a]) {
                changed = true;
                let mut with_contacts = problems[a];
                add(&mut with_contacts.load, &forces.arm_torques[a]);
                search_bound_set(&mut arm.constraints, &with_contacts, &mut acceleration[a]);
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
