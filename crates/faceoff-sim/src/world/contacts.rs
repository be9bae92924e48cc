//! The contact forces of one substep, solved together through the bodies that they share.

use crate::{
    robot::model::DOFS,
    table::{
        contact_finder::Touch,
        contact_law::{MALLET_INVERSE_INERTIA, Material},
        geometry::PUCK,
        puck::INVERSE_INERTIA,
    },
};

/// Two rims, two mallets on the puck, mallet on mallet.
pub const MAX_CONTACTS: usize = 5;
/// Normal, horizontal tangent, vertical tangent.
const DIRECTIONS: usize = 3;
const MAX_ROWS: usize = DIRECTIONS * MAX_CONTACTS;

/// Rounds of the active-set search before falling back to Gauss–Seidel.
const ACTIVE_SET_ROUNDS: usize = 30;
/// Sweeps of the fallback, and the relative change at which it stops.
const SWEEPS: usize = 20_000;
const SWEEP_TOLERANCE: f64 = 1e-13;
/// Turn of the slip's direction, rad, at which it is found.
const SLIP_TOLERANCE: f64 = 1e-12;

/// How the motion of a mallet's cylinder depends on its arm's joints, table frame: rows for x, y and
/// z.
pub type MalletJacobian = [[f64; DOFS]; 3];

/// A mallet as a contact sees it.
#[derive(Debug, Clone, Copy)]
pub struct MalletMotion {
    /// Of the arm; `None` if the mallet's motion is imposed.
    pub jacobian: Option<MalletJacobian>,
    /// m/s, table frame.
    pub velocity: [f64; 3],
}

impl MalletMotion {
    /// How an imposed mallet yields in the contact's equations, 1/kg: the reference solves them with
    /// the arm beneath even where it overwrites its motion.
    fn inverse_inertia(&self) -> f64 {
        if self.jacobian.is_some() {
            0.0
        } else {
            MALLET_INVERSE_INERTIA
        }
    }
}

/// One scalar constraint: along a contact's normal or tangent.
#[derive(Debug, Clone, Copy)]
struct Row {
    puck: [f64; 3],
    arms: [Option<[f64; DOFS]>; 2],
    /// Desired relative acceleration, m/s².
    target: f64,
    regularisation: f64,
}

/// The contacts of one substep.
#[derive(Debug, Clone)]
pub struct Contacts {
    count: usize,
    rows: [Row; MAX_ROWS],
    friction: [f64; MAX_CONTACTS],
}

/// Who moves on the two sides of a contact.
#[derive(Debug, Clone, Copy)]
pub enum Pair<'a> {
    /// A rim and the puck.
    Rim {
        /// Puck's velocity.
        puck: &'a [f64; 3],
    },
    /// A mallet and the puck.
    Mallet {
        /// The mallet's robot, 0 or 1.
        robot: usize,
        /// The mallet.
        mallet: &'a MalletMotion,
        /// Puck's velocity.
        puck: &'a [f64; 3],
    },
    /// Robot 1's mallet and robot 2's.
    Mallets {
        /// Both mallets.
        mallets: [&'a MalletMotion; 2],
    },
}

impl Contacts {
    /// No contact.
    pub fn none() -> Self {
        let row = Row {
            puck: [0.0; 3],
            arms: [None; 2],
            target: 0.0,
            regularisation: 0.0,
        };
        Self {
            count: 0,
            rows: [row; MAX_ROWS],
            friction: [0.0; MAX_CONTACTS],
        }
    }

    /// Is nothing in contact?
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Does a contact push an arm?
    pub fn move_arms(&self) -> bool {
        self.rows[..DIRECTIONS * self.count]
            .iter()
            .any(|row| row.arms.iter().any(Option::is_some))
    }

    /// Force on the puck (N, N, N m) of contacts that push no arm, at a given acceleration without
    /// contact.
    pub fn solve_puck(&self, puck_acceleration: &[f64; 3]) -> [f64; 3] {
        self.solve(puck_acceleration, &[[0.0; DOFS]; 2], |_, torque| *torque)
            .puck
    }

    /// Adds a contact, the touch's normal pointing into the pair's second body.
    pub fn add(&mut self, touch: Touch, material: &Material, pair: Pair<'_>) {
        let n = touch.normal;
        let impedance = material.impedance(touch.depth_m);
        let regularisation = Material::softness(impedance) * material.inverse_inertia;
        let push = material.stiffness_per_s2 * impedance * touch.depth_m;
        // Where MODEL leaves a choice, the recordings decide: the contact point lies in the middle of the
        // overlap, which is millimetres deep (that halves the errors of spin and direction), and there is
        // a second, vertical tangent: the puck does not move along z, but its friction brakes a mallet
        // that does. Without it a struck arm's mallet recoils by a third more than recorded.
        let across = 1.0 / (n[0] * n[0] + n[1] * n[1]).sqrt();
        let horizontal = [-n[1] * across, n[0] * across, 0.0];
        let upward = [
            -n[2] * horizontal[1],
            n[2] * horizontal[0],
            n[0] * horizontal[1] - n[1] * horizontal[0],
        ];
        let spin_arm = 0.5 * touch.depth_m - PUCK.radius_m;
        for (k, (direction, spin_arm, push)) in [
            (n, 0.0, push),
            (horizontal, spin_arm, 0.0),
            (upward, 0.0, 0.0),
        ]
        .into_iter()
        .enumerate()
        {
            let along_joints = |sign: f64, mallet: &MalletMotion| {
                mallet.jacobian.map(|j| {
                    std::array::from_fn(|i| sign * dot(&direction, &[j[0][i], j[1][i], j[2][i]]))
                })
            };
            let mut row = Row {
                puck: [0.0; 3],
                arms: [None; 2],
                target: 0.0,
                regularisation,
            };
            let mut velocity = 0.0;
            if let Pair::Rim { puck } | Pair::Mallet { puck, .. } = pair {
                row.puck = [direction[0], direction[1], spin_arm];
                velocity += dot(&row.puck, puck);
            }
            match pair {
                Pair::Rim { .. } => {}
                Pair::Mallet { robot, mallet, .. } => {
                    row.arms[robot] = along_joints(-1.0, mallet);
                    row.regularisation += mallet.inverse_inertia();
                    velocity -= dot(&direction, &mallet.velocity);
                }
                Pair::Mallets { mallets } => {
                    for (robot, (mallet, sign)) in mallets.into_iter().zip([-1.0, 1.0]).enumerate()
                    {
                        row.arms[robot] = along_joints(sign, mallet);
                        velocity += sign * dot(&direction, &mallet.velocity);
                    }
                }
            }
            row.target = push - material.damping_per_s * velocity;
            self.rows[DIRECTIONS * self.count + k] = row;
        }
        self.friction[self.count] = material.friction;
        self.count += 1;
    }

    /// Contact forces at given accelerations without contact. `respond` solves an arm's equations of
    /// motion for a joint torque. Returns the torques on the arms and the force on the puck.
    pub fn solve(
        &self,
        puck_acceleration: &[f64; 3],
        arm_acceleration: &[[f64; DOFS]; 2],
        respond: impl Fn(usize, &[f64; DOFS]) -> [f64; DOFS],
    ) -> ContactForces {
        let n = DIRECTIONS * self.count;
        let rows = &self.rows[..n];
        let mut matrix = [[0.0; MAX_ROWS]; MAX_ROWS];
        let mut target = [0.0; MAX_ROWS];
        for (r, row) in rows.iter().enumerate() {
            let responses: [Option<[f64; DOFS]>; 2] =
                std::array::from_fn(|arm| row.arms[arm].map(|j| respond(arm, &j)));
            target[r] = row.target - dot(&row.puck, puck_acceleration);
            for arm in 0..2 {
                if let Some(jacobian) = &row.arms[arm] {
                    target[r] -= dot(jacobian, &arm_acceleration[arm]);
                }
            }
            for (s, other) in rows.iter().enumerate() {
                let mut a: f64 = (0..3)
                    .map(|i| row.puck[i] * INVERSE_INERTIA[i] * other.puck[i])
                    .sum();
                for arm in 0..2 {
                    if let (Some(response), Some(jacobian)) = (&responses[arm], &other.arms[arm]) {
                        a += dot(response, jacobian);
                    }
                }
                matrix[s][r] = a;
            }
            matrix[r][r] += row.regularisation;
        }
        let force = solve_cone(&matrix, &target, &self.friction[..self.count]);
        let mut forces = ContactForces {
            puck: [0.0; 3],
            arms: [[0.0; DOFS]; 2],
        };
        for (r, row) in rows.iter().enumerate() {
            for i in 0..3 {
                forces.puck[i] += row.puck[i] * force[r];
            }
            for arm in 0..2 {
                if let Some(jacobian) = &row.arms[arm] {
                    for i in 0..DOFS {
                        forces.arms[arm][i] += jacobian[i] * force[r];
                    }
                }
            }
        }
        forces
    }
}

/// What the contacts do to puck and arms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactForces {
    /// N, N, N m, table frame.
    pub puck: [f64; 3],
    /// Joint torques, N m.
    pub arms: [[f64; DOFS]; 2],
}

fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum State {
    Open,
    Sticks,
    /// With the unit direction of the tangential force.
    Slips([f64; 2]),
}

type Matrix = [[f64; MAX_ROWS]; MAX_ROWS];

/// Solves `matrix · f = target` where each contact's normal force is not negative and its tangential
/// force within friction times the normal force; rows alternate normal, tangent, vertical tangent.
fn solve_cone(matrix: &Matrix, target: &[f64; MAX_ROWS], friction: &[f64]) -> [f64; MAX_ROWS] {
    let mut states = [State::Sticks; MAX_CONTACTS];
    let mut force = [0.0; MAX_ROWS];
    for _ in 0..ACTIVE_SET_ROUNDS {
        force = solve_states(matrix, target, friction, &states);
        let mut changed = false;
        for (c, &mu) in friction.iter().enumerate() {
            let n = DIRECTIONS * c;
            let missing = |r: usize| target[r] - dot(&matrix[r], &force);
            let tangent = [force[n + 1], force[n + 2]];
            let limit = mu * force[n];
            let next = match states[c] {
                State::Open if missing(n) > 0.0 => State::Sticks,
                State::Open => State::Open,
                _ if force[n] < 0.0 => State::Open,
                State::Sticks if norm(tangent) > limit => direction(tangent),
                State::Sticks => State::Sticks,
                State::Slips(along) => {
                    // Towards where the slip would have the force: the fixed point has it along it.
                    let wanted: [f64; 2] = std::array::from_fn(|i| {
                        let r = n + 1 + i;
                        tangent[i] + missing(r) / matrix[r][r].max(f64::MIN_POSITIVE)
                    });
                    if norm(wanted) < limit {
                        State::Sticks
                    } else {
                        let State::Slips(turned) = direction(wanted) else {
                            continue;
                        };
                        let turn = norm([turned[0] - along[0], turned[1] - along[1]]);
                        if turn < SLIP_TOLERANCE {
                            states[c]
                        } else {
                            State::Slips(turned)
                        }
                    }
                }
            };
            changed |= next != states[c];
            states[c] = next;
        }
        if !changed {
            return force;
        }
    }
    sweep(matrix, target, friction, force)
}

/// Not `hypot`, which is the platform's.
fn norm(v: [f64; 2]) -> f64 {
    (v[0] * v[0] + v[1] * v[1]).sqrt()
}

fn direction(tangent: [f64; 2]) -> State {
    let size = norm(tangent);
    if size > 0.0 {
        State::Slips(tangent.map(|f| f / size))
    } else {
        State::Sticks
    }
}

/// Solves the linear system that a set of states leaves, by elimination with pivoting.
fn solve_states(
    matrix: &Matrix,
    target: &[f64; MAX_ROWS],
    friction: &[f64],
    states: &[State; MAX_CONTACTS],
) -> [f64; MAX_ROWS] {
    let n = DIRECTIONS * friction.len();
    let mut a = *matrix;
    let mut x = *target;
    for (c, &mu) in friction.iter().enumerate() {
        let first = DIRECTIONS * c;
        let mut fix = |k: usize, ratio: f64| {
            a[k] = [0.0; MAX_ROWS];
            a[k][first] = -ratio;
            a[k][k] = 1.0;
            x[k] = 0.0;
        };
        match states[c] {
            State::Open => (0..DIRECTIONS).for_each(|d| fix(first + d, 0.0)),
            State::Sticks => {}
            State::Slips(along) => {
                fix(first + 1, mu * along[0]);
                fix(first + 2, mu * along[1]);
                // The force lies on the edge of the cone; what is left of the three equations is
                // their sum along that edge.
                for (k, a) in a[first].iter_mut().enumerate() {
                    *a += mu * (along[0] * matrix[first + 1][k] + along[1] * matrix[first + 2][k]);
                }
                x[first] += mu * (along[0] * target[first + 1] + along[1] * target[first + 2]);
            }
        }
    }
    for k in 0..n {
        let mut pivot = k;
        for r in k + 1..n {
            if a[r][k].abs() > a[pivot][k].abs() {
                pivot = r;
            }
        }
        a.swap(k, pivot);
        x.swap(k, pivot);
        for r in k + 1..n {
            let factor = a[r][k] / a[k][k];
            for c in k..n {
                a[r][c] -= factor * a[k][c];
            }
            x[r] -= factor * x[k];
        }
    }
    for k in (0..n).rev() {
        for c in k + 1..n {
            x[k] -= a[k][c] * x[c];
        }
        x[k] /= a[k][k];
    }
    x
}

/// Gauss–Seidel over the contacts, one cone at a time: slow, but it converges where the search for the
/// set of states does not.
#[cold]
fn sweep(
    matrix: &Matrix,
    target: &[f64; MAX_ROWS],
    friction: &[f64],
    start: [f64; MAX_ROWS],
) -> [f64; MAX_ROWS] {
    let mut force = start;
    for _ in 0..SWEEPS {
        let before = force;
        for (c, &mu) in friction.iter().enumerate() {
            let n = DIRECTIONS * c;
            // A step along each row's own equation, then to the nearest point of the cone.
            let step: f64 = (n..n + DIRECTIONS)
                .map(|r| matrix[r][r])
                .fold(0.0, f64::max);
            let [f, a, b] = std::array::from_fn(|d| {
                force[n + d] + (target[n + d] - dot(&matrix[n + d], &force)) / step
            });
            let size = norm([a, b]);
            let projected = if size <= mu * f {
                [f, a, b]
            } else if mu * size <= -f {
                [0.0; 3]
            } else {
                let normal = (f + mu * size) / (1.0 + mu * mu);
                let ratio = mu * normal / size;
                [normal, ratio * a, ratio * b]
            };
            force[n..n + DIRECTIONS].copy_from_slice(&projected);
        }
        let change = force
            .iter()
            .zip(&before)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        let size = force.iter().map(|f| f.abs()).fold(0.0, f64::max);
        if change <= SWEEP_TOLERANCE * size {
            break;
        }
    }
    force
}
