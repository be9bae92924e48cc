//! Dry friction of the joints of several arms, without a joint at its *stop* (the end of its range): the ordinary case of `joints.rs`,
//! with the same operations in SIMD lanes, one arm in each.
//!
//! The torque of a dry friction (N m) is `stiffness · (target − acceleration)`, limited to ±bound. The *target* is the acceleration that
//! would stop the joint softly (rad/s²), the *stiffness* is in kg m². A *bound set* says which frictions are at a bound.

use super::joints::{FrictionState, JointConstraints};
use crate::{
    dynamics::lanes::{Lanes, gather, row},
    model::{DOFS, JOINTS},
    table::contact_law::JOINT,
};

/// Dry friction of several arms.
#[derive(Debug, Clone, Copy)]
pub struct FrictionLanes<T: Lanes> {
    /// kg m².
    stiffness: [T; JOINTS],
    /// Largest torque ±, N m.
    bound: [T; JOINTS],
    /// Desired acceleration, rad/s².
    target: [T; JOINTS],
    /// For each joint, masks of the arms whose friction is at its upper and at its lower bound.
    at_upper: [T::Mask; JOINTS],
    at_lower: [T::Mask; JOINTS],
}

/// The bound set of each arm: for each joint, masks of the arms whose friction is at its upper and at its lower bound.
pub struct BoundSets<T: Lanes> {
    at_upper: [T::Mask; JOINTS],
    at_lower: [T::Mask; JOINTS],
    /// The lanes of the arms whose set differs from the stored one, as [`Lanes::bits`].
    pub changed: u32,
}

impl<T: Lanes> FrictionLanes<T> {
    /// Collects the frictions of several arms.
    #[inline(always)]
    pub fn gather<'a>(constraints: impl Fn(usize) -> &'a JointConstraints) -> Self {
        let mask_of = |state: FrictionState| {
            std::array::from_fn(|i| {
                let bit = |lane: usize| u32::from(constraints(lane).friction[i] == state) << lane;
                T::mask((0..T::COUNT).map(bit).sum())
            })
        };
        Self {
            stiffness: gather(|lane| &constraints(lane).friction_stiffness),
            bound: gather(|lane| &constraints(lane).friction_bound),
            target: gather(|lane| &constraints(lane).friction_target),
            at_upper: mask_of(FrictionState::AtUpper),
            at_lower: mask_of(FrictionState::AtLower),
        }
    }

    /// Writes targets and bound set of one lane to its arm's constraints.
    pub fn store(&self, lane: usize, constraints: &mut JointConstraints) {
        let contains = |mask: T::Mask| T::bits(mask) >> lane & 1 == 1;
        constraints.friction = std::array::from_fn(|i| {
            if contains(self.at_upper[i]) {
                FrictionState::AtUpper
            } else if contains(self.at_lower[i]) {
                FrictionState::AtLower
            } else {
                FrictionState::Inside
            }
        });
        constraints.friction_target = row(&self.target, lane);
    }

    /// Reads the bound set of one lane from its arm's constraints.
    #[cold]
    pub fn load_bound_set(&mut self, lane: usize, constraints: &JointConstraints) {
        let replace = |mask: &mut T::Mask, yes: bool| {
            let others = T::bits(*mask) & !(1 << lane);
            *mask = T::mask(others | u32::from(yes) << lane);
        };
        for i in 0..JOINTS {
            replace(
                &mut self.at_upper[i],
                constraints.friction[i] == FrictionState::AtUpper,
            );
            replace(
                &mut self.at_lower[i],
                constraints.friction[i] == FrictionState::AtLower,
            );
        }
    }

    /// Sets the targets of a substep from joint velocities (rad/s).
    #[inline(always)]
    pub fn prepare(&mut self, dq: &[T; DOFS]) {
        for i in 0..JOINTS {
            self.target[i] = T::splat(-JOINT.damping_per_s) * dq[i];
        }
    }

    /// The contributions of the frictions to the equations `(M + diagonal) · acceleration = load`: those within their bounds to the
    /// diagonal (kg m²), and all to the load (N m). M is the joint-space inertia.
    #[inline(always)]
    pub fn assemble(&self) -> ([T; JOINTS], [T; JOINTS]) {
        let zero = T::splat(0.0);
        let (mut diagonal, mut load) = ([zero; JOINTS], [zero; JOINTS]);
        for i in 0..JOINTS {
            let (upper, lower) = (self.at_upper[i], self.at_lower[i]);
            diagonal[i] = T::select(T::mask_or(upper, lower), zero, self.stiffness[i]);
            let inside = self.stiffness[i] * self.target[i];
            let not_upper = T::select(lower, -self.bound[i], inside);
            load[i] = T::select(upper, self.bound[i], not_upper);
        }
        (diagonal, load)
    }

    /// The bound sets at these accelerations (rad/s²).
    #[inline(always)]
    pub fn classify(&self, acceleration: &[T; DOFS]) -> BoundSets<T> {
        let (mut at_upper, mut at_lower) = (self.at_upper, self.at_lower);
        let mut changed = T::mask_xor(at_upper[0], at_upper[0]);
        for i in 0..JOINTS {
            let torque = self.stiffness[i] * (self.target[i] - acceleration[i]);
            at_upper[i] = self.bound[i].less_than(torque);
            at_lower[i] = torque.less_than(-self.bound[i]);
            changed = T::mask_or(changed, T::mask_xor(at_upper[i], self.at_upper[i]));
            changed = T::mask_or(changed, T::mask_xor(at_lower[i], self.at_lower[i]));
        }
        BoundSets {
            at_upper,
            at_lower,
            changed: T::bits(changed),
        }
    }

    /// Stores the bound sets.
    #[inline(always)]
    pub fn store_bound_sets(&mut self, sets: &BoundSets<T>) {
        self.at_upper = sets.at_upper;
        self.at_lower = sets.at_lower;
    }

    /// The torques of the frictions at accelerations (rad/s²), N m.
    #[inline(always)]
    pub fn torques(&self, acceleration: &[T; DOFS]) -> [T; JOINTS] {
        std::array::from_fn(|i| {
            let torque = self.stiffness[i] * (self.target[i] - acceleration[i]);
            torque.at_least(-self.bound[i]).at_most(self.bound[i])
        })
    }
}
