//! Counts the arithmetic operations of a substep (1 ms of physics of one arm): the dynamics are computed with numbers that count their
//! operations.

use faceoff_sim::{
    dynamics::{
        arm::{
            Bodies, Kinematics, controller_torques, damped_mass_matrix, mass_matrix, plant_bias,
        },
        lanes::Lanes,
        ldlt::Ldlt,
    },
    model::{DOFS, INITIAL_Q, JOINTS},
};
use std::{
    cell::Cell,
    ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign},
};

thread_local! {
    static OPERATIONS: Cell<u32> = const { Cell::new(0) };
}

/// A number that counts additions, subtractions, multiplications and divisions; signs are free.
#[derive(Debug, Clone, Copy)]
struct Counted(f64);

fn count(result: f64) -> Counted {
    OPERATIONS.set(OPERATIONS.get() + 1);
    Counted(result)
}

impl Add for Counted {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        count(self.0 + other.0)
    }
}

impl Sub for Counted {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        count(self.0 - other.0)
    }
}

impl Mul for Counted {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        count(self.0 * other.0)
    }
}

impl Div for Counted {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        count(self.0 / other.0)
    }
}

impl Neg for Counted {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl AddAssign for Counted {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Counted {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl Lanes for Counted {
    type Mask = bool;

    const COUNT: usize = 1;

    fn splat(value: f64) -> Self {
        Self(value)
    }

    fn from_fn(mut value: impl FnMut(usize) -> f64) -> Self {
        Self(value(0))
    }

    fn lane(self, _index: usize) -> f64 {
        self.0
    }

    fn nearest(self) -> Self {
        // An addition and a subtraction in the simulator's implementation.
        count(count(self.0.round_ties_even()).0)
    }

    fn abs(self) -> Self {
        Self(self.0.abs())
    }

    fn copysign(self, other: Self) -> Self {
        Self(self.0.copysign(other.0))
    }

    fn less_than(self, other: Self) -> bool {
        self.0 < other.0
    }

    fn less_or_equal(self, other: Self) -> bool {
        self.0 <= other.0
    }

    fn mask_and(a: bool, b: bool) -> bool {
        a && b
    }

    fn mask_or(a: bool, b: bool) -> bool {
        a || b
    }

    fn mask_xor(a: bool, b: bool) -> bool {
        a != b
    }

    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }

    fn bits(mask: bool) -> u32 {
        u32::from(mask)
    }
}

/// Runs a computation, prints its number of operations and adds it to `total`.
fn counted<R>(name: &str, total: &mut u32, compute: impl FnOnce() -> R) -> R {
    OPERATIONS.set(0);
    let result = compute();
    let operations = OPERATIONS.get();
    println!("{operations:5} {name}");
    *total += operations;
    result
}

/// The number of operations of one arm's substep in `docs/simulator.md`.
const DOCUMENTED_OPERATIONS: u32 = 6346;

#[test]
fn substep_takes_the_documented_number_of_operations() {
    let zero = [Counted(0.0); DOFS];
    let q: [Counted; DOFS] =
        std::array::from_fn(|i| Counted(INITIAL_Q.get(i).copied().unwrap_or_default()));
    // Arbitrary velocities and accelerations.
    let velocities = [Counted(0.1); DOFS];
    let joint_values = [Counted(0.1); JOINTS];
    let mut total = 0;
    let kinematics = counted("forward kinematics with sines", &mut total, || {
        Kinematics::new(&q)
    });
    let bodies = counted("inertias in the base frame", &mut total, || {
        Bodies::new(&kinematics)
    });
    counted(
        "controller: recursive Newton-Euler, 7 joints",
        &mut total,
        || {
            controller_torques(
                &kinematics,
                &bodies.controller(),
                &joint_values,
                &joint_values,
            )
        },
    );
    let bodies = counted("inertias of the plant", &mut total, || {
        bodies.plant(&[Counted(1.0); 9])
    });
    counted(
        "plant: recursive Newton-Euler, 9 joints",
        &mut total,
        || plant_bias(&kinematics, &bodies, &velocities),
    );
    let mass = counted("plant: composite rigid bodies", &mut total, || {
        mass_matrix(&kinematics, &bodies)
    });
    counted("dry friction: a Newton step", &mut total, || {
        Ldlt::new(&mass).solve(&zero)
    });
    counted("integration: implicit damping", &mut total, || {
        Ldlt::new(&damped_mass_matrix(&mass, &[Counted(0.1); JOINTS])).solve(&zero)
    });
    println!("{total:5} in total");
    assert_eq!(total, DOCUMENTED_OPERATIONS);
}
