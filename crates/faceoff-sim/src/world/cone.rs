//! The convex optimisation problem whose solution are the contact forces.
//!
//! Each contact has a normal and two tangential forces (N). They are within the *friction cone*: the tangential force is at most the
//! friction coefficient `mu` times the normal force. A contact *slips* if it is at the bound, and *sticks* otherwise. The forces minimise
//! one quadratic function over all cones, as in MuJoCo.

/// Number of directions of a contact: normal, horizontal tangent, upright tangent.
pub const DIRECTIONS: usize = 3;

/// If one of several contacts slips, they are solved one after the other in sweeps: the largest number of sweeps, and the relative change
/// of the forces that ends them.
const MAX_SWEEPS: usize = 20_000;
const SWEEP_TOLERANCE: f64 = 1e-13;
/// Number of directions of slip, spread over the full circle, that are tried before the search around the best one.
const SLIP_DIRECTIONS_TRIED: usize = 16;
/// Number of bisections in that search, which narrows the direction down to rounding.
const BISECTIONS: usize = 54;

/// One contact's force: normal, horizontal tangent, upright tangent.
type ContactForce = [f64; DIRECTIONS];

/// Minimises ½ f·matrix·f − target·f over forces f within their friction cones; rows are normal, horizontal and upright tangent of each
/// contact. `matrix` is relative acceleration per force (1/kg), `target` the desired relative acceleration (m/s²). This is the friction
/// model of MuJoCo: a convex problem, in which slipping increases the normal force.
///
/// The matrix is symmetric and positive definite in the rows of the contacts, one friction coefficient
/// each; later rows are ignored.
pub fn solve_cone<const N: usize>(
    matrix: &[[f64; N]; N],
    target: &[f64; N],
    friction: &[f64],
) -> [f64; N] {
    let rows = DIRECTIONS * friction.len();
    let mut force = eliminate(matrix, target, rows);
    let sticks = |(c, mu): (usize, &f64)| {
        let [normal, horizontal, upright] = block(&force, c);
        norm([horizontal, upright]) <= mu * normal
    };
    if friction.iter().enumerate().all(sticks) {
        return force;
    }
    // Solve one contact at a time with the other forces fixed: a single contact needs one sweep.
    for _ in 0..MAX_SWEEPS {
        let (mut change, mut size) = (0.0f64, 0.0f64);
        for (c, &mu) in friction.iter().enumerate() {
            let first = DIRECTIONS * c;
            let others = |r: usize| -> f64 {
                (0..rows)
                    .filter(|k| !(first..first + DIRECTIONS).contains(k))
                    .map(|k| matrix[r][k] * force[k])
                    .sum()
            };
            let target = std::array::from_fn(|d| target[first + d] - others(first + d));
            let matrix = std::array::from_fn(|d| block(&matrix[first + d], c));
            let next = solve_one_cone(&matrix, &target, mu);
            for d in 0..DIRECTIONS {
                change = change.max((next[d] - force[first + d]).abs());
                size = size.max(next[d].abs());
                force[first + d] = next[d];
            }
        }
        // Negated, so that NaN forces end the sweeps too.
        let continues = change > SWEEP_TOLERANCE * size;
        if friction.len() == 1 || !continues || !size.is_finite() {
            break;
        }
    }
    force
}

/// [`solve_cone`] for one contact.
fn solve_one_cone(
    matrix: &[ContactForce; DIRECTIONS],
    target: &ContactForce,
    mu: f64,
) -> ContactForce {
    let sticking = eliminate(matrix, target, DIRECTIONS);
    if norm([sticking[1], sticking[2]]) <= mu * sticking[0] {
        return sticking;
    }
    let pull = [target[1], target[2]];
    if target[0] + mu * norm(pull) <= 0.0 {
        return [0.0; DIRECTIONS];
    }
    // The contact slips, so the force is on the surface of the cone. On the edge (straight line from the tip) in the tangential direction
    // u, a unit vector, there is one unknown: the size. The best edge is found roughly first and then between its neighbours.
    let edge = |u: [f64; 2]| [1.0, mu * u[0], mu * u[1]];
    let response = |edge: &ContactForce| matrix.map(|row| dot(&row, edge));
    // Twice the decrease of the minimised function by the best force on an edge.
    let gain = |u: [f64; 2]| {
        let edge = edge(u);
        let push = dot(&edge, target).max(0.0);
        push * push / dot(&edge, &response(&edge))
    };
    // The best force on an edge.
    let best_force = |u: [f64; 2]| -> ContactForce {
        let edge = edge(u);
        let size = (dot(&edge, target) / dot(&edge, &response(&edge))).max(0.0);
        edge.map(|e| size * e)
    };
    // Rate at which the gain grows if the edge turns anticlockwise, up to a positive factor.
    let gain_slope = |u: [f64; 2]| {
        let force = best_force(u);
        let residual: ContactForce = std::array::from_fn(|d| target[d] - dot(&matrix[d], &force));
        residual[2] * u[0] - residual[1] * u[1]
    };
    let mut best = unit(pull);
    let mut direction = best;
    for _ in 1..SLIP_DIRECTIONS_TRIED {
        direction = rotate(direction, 1.0);
        if gain(direction) > gain(best) {
            best = direction;
        }
    }
    let (mut before, mut after) = (rotate(best, -1.0), rotate(best, 1.0));
    for _ in 0..BISECTIONS {
        let middle = unit([before[0] + after[0], before[1] + after[1]]);
        if gain_slope(middle) > 0.0 {
            before = middle;
        } else {
            after = middle;
        }
    }
    best_force(before)
}

/// Rotates by a full turn divided by [`SLIP_DIRECTIONS_TRIED`], anticlockwise (`sign` +1) or clockwise (−1).
fn rotate([x, y]: [f64; 2], sign: f64) -> [f64; 2] {
    const COS: f64 = 0.923_879_532_511_286_7;
    const SIN: f64 = 0.382_683_432_365_089_8;
    let sin = sign * SIN;
    [COS * x - sin * y, sin * x + COS * y]
}

fn dot(a: &ContactForce, b: &ContactForce) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The three numbers of one contact in a row of the matrix or in the forces.
fn block<const N: usize>(row: &[f64; N], contact: usize) -> ContactForce {
    std::array::from_fn(|d| row[DIRECTIONS * contact + d])
}

/// Length of a vector. Not by `hypot`, which depends on the platform.
fn norm(v: [f64; 2]) -> f64 {
    (v[0] * v[0] + v[1] * v[1]).sqrt()
}

/// A unit vector in a direction; an arbitrary one for the zero vector.
fn unit(v: [f64; 2]) -> [f64; 2] {
    let size = norm(v);
    if size > 0.0 {
        v.map(|x| x / size)
    } else {
        [1.0, 0.0]
    }
}

/// Solves the first `n` equations of `matrix · x = target` by Gaussian elimination with pivoting.
fn eliminate<const N: usize>(matrix: &[[f64; N]; N], target: &[f64; N], n: usize) -> [f64; N] {
    let mut a = *matrix;
    let mut x = *target;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::RandomStream;
    use faceoff_types::Seed;

    /// A random symmetric, positive definite matrix, and a target that pushes and pulls equally often. The constants are chosen so that
    /// contacts open, stick and slip.
    fn random_problem<const N: usize>(stream: &mut RandomStream) -> ([[f64; N]; N], [f64; N]) {
        let root: [[f64; N]; N] =
            std::array::from_fn(|_| std::array::from_fn(|_| stream.uniform(-1.0, 1.0)));
        let scale: [f64; N] = std::array::from_fn(|r| if r % DIRECTIONS == 2 { 0.2 } else { 3.0 });
        let matrix = std::array::from_fn(|r| {
            std::array::from_fn(|c| {
                let product: f64 = (0..N).map(|k| root[r][k] * root[c][k]).sum();
                scale[r] * scale[c] * product + if r == c { 0.3 } else { 0.0 }
            })
        });
        (matrix, std::array::from_fn(|_| stream.uniform(-20.0, 20.0)))
    }

    /// Checks the conditions of the optimum: forces in their cones, residuals in the polar cones, and no gain along
    /// the forces. Returns how many contacts are open (without force), stick and slip.
    fn check_optimum<const N: usize>(
        matrix: &[[f64; N]; N],
        target: &[f64; N],
        friction: &[f64],
    ) -> [usize; 3] {
        let force = solve_cone(matrix, target, friction);
        let mut kinds = [0; 3];
        for (c, &mu) in friction.iter().enumerate() {
            let contact_force = block(&force, c);
            let [normal, horizontal, upright] = contact_force;
            let residual: ContactForce = std::array::from_fn(|d| {
                let row = matrix[DIRECTIONS * c + d];
                let response: f64 = row.iter().zip(&force).map(|(m, f)| m * f).sum();
                target[DIRECTIONS * c + d] - response
            });
            let tolerance = 1e-9;
            assert!(
                norm([horizontal, upright]) <= mu * normal + tolerance,
                "outside its cone: {force:?}"
            );
            let outward = residual[0] + mu * norm([residual[1], residual[2]]);
            assert!(
                outward <= 1e-8 * (1.0 + mu),
                "not optimal: {residual:?} {force:?}"
            );
            assert!(
                dot(&residual, &contact_force).abs() <= tolerance * 1e3,
                "{residual:?} {force:?}"
            );
            let kind = if normal == 0.0 {
                0 // open
            } else if norm([horizontal, upright]) < mu * normal * (1.0 - 1e-9) {
                1 // sticks
            } else {
                2 // slips
            };
            kinds[kind] += 1;
        }
        kinds
    }

    #[test]
    fn single_contact_satisfies_the_optimality_conditions() {
        let mut stream = RandomStream::new(&Seed::from_number(1), "one contact");
        let mut kinds = [0; 3];
        for _ in 0..2000 {
            let (matrix, target) = random_problem::<3>(&mut stream);
            let found = check_optimum(&matrix, &target, &[stream.uniform(0.2, 2.0)]);
            kinds = std::array::from_fn(|k| kinds[k] + found[k]);
        }
        assert!(kinds.iter().all(|count| *count > 20), "{kinds:?}");
    }

    #[test]
    fn several_contacts_satisfy_the_optimality_conditions() {
        let mut stream = RandomStream::new(&Seed::from_number(2), "several contacts");
        let mut kinds = [0; 3];
        for _ in 0..300 {
            let (matrix, target) = random_problem::<9>(&mut stream);
            let found = check_optimum(&matrix, &target, &[1.0, 1e4, stream.uniform(0.2, 2.0)]);
            kinds = std::array::from_fn(|k| kinds[k] + found[k]);
        }
        assert!(kinds.iter().all(|count| *count > 50), "{kinds:?}");
    }
}
