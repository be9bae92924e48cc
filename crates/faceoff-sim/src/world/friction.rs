//! Dry friction of the joints of several arms, where no joint is at its stop: the ordinary case of
//! `joints.rs`, with the same operations lane by lane.

use super::joints::{Friction, JointConstraints};
use crate::{
    dynamics::lanes::{Lanes, gather, row},
    model::{DOFS, JOINTS},
    table::contact_law::JOINT,
};

/// The frictions of several arms.
#[derive(Debug, Clone, Copy)]
pub struct FrictionLanes<T: Lanes> {
    stiffness: [T; JOINTS],
    bound: [T; JOINTS],
    target: [T; JOINTS],
    /// Whose force is at its upper, and lower, bound.
    at_upper: [T::Mask; JOINTS],
    at_lower: [T::Mask; JOINTS],
}

/// Frictions whose set is looked for.
pub struct Classified<T: Lanes> {
    at_upper: [T::Mask; JOINTS],
    at_lower: [T::Mask; JOINTS],
    /// The arms whose set is another one than before, as [`Lanes::bits`].
    pub changed: u32,
}

impl<T: Lanes> FrictionLanes<T> {
    /// Of several arms.
    #[inline(always)]
    pub fn gather<'a>(of: impl Fn(usize) -> &'a JointConstraints) -> Self {
        let whose = |state: Friction| {
            std::array::from_fn(|i| {
                let is_so = |lane: usize| u32::from(of(lane).friction[i] == state) << lane;
                T::mask((0..T::COUNT).map(is_so).sum())
            })
        };
        Self {
            stiffness: gather(|lane| &of(lane).friction_stiffness),
            bound: gather(|lane| &of(lane).friction_bound),
            target: gather(|lane| &of(lane).friction_target),
            at_upper: whose(Friction::AtUpper),
            at_lower: whose(Friction::AtLower),
        }
    }

    /// Tells one arm's constraints of its frictions.
    pub fn store(&self, lane: usize, constraints: &mut JointConstraints) {
        let is_so = |mask: T::Mask| T::bits(mask) >> lane & 1 == 1;
        constraints.friction = std::array::from_fn(|i| {
            if is_so(self.at_upper[i]) {
                Friction::AtUpper
            } else if is_so(self.at_lower[i]) {
                Friction::AtLower
            } else {
                Friction::Inside
            }
        });
        constraints.friction_target = row(&self.target, lane);
    }

    /// Takes the set of bounds that was found for one arm.
    #[cold]
    pub fn load(&mut self, lane: usize, constraints: &JointConstraints) {
        let replace = |mask: &mut T::Mask, yes: bool| {
            let others = T::bits(*mask) & !(1 << lane);
            *mask = T::mask(others | u32::from(yes) << lane);
        };
        for i in 0..JOINTS {
            replace(
                &mut self.at_upper[i],
                constraints.friction[i] == Friction::AtUpper,
            );
            replace(
                &mut self.at_lower[i],
                constraints.friction[i] == Friction::AtLower,
            );
        }
    }

    /// Sets up a substep from velocities (rad/s).
    #[inline(always)]
    pub fn prepare(&mut self, dq: &[T; DOFS]) {
        for i in 0..JOINTS {
            self.target[i] = T::splat(-JOINT.damping_per_s) * dq[i];
        }
    }

    /// What the frictions inside their bounds add to the inertia's diagonal, and all of them to the load:
    /// `(M + diag) a = load`.
    #[inline(always)]
    pub fn assemble(&self) -> ([T; JOINTS], [T; JOINTS]) {
        let zero = T::splat(0.0);
        let (mut diagonal, mut load) = ([zero; JOINTS], [zero; JOINTS]);
        for i in 0..JOINTS {
            let (upper, lower) = (self.at_upper[i], self.at_lower[i]);
            diagonal[i] = T::choose(T::either(upper, lower), zero, self.stiffness[i]);
            let inside = self.stiffness[i] * self.target[i];
            let not_upper = T::choose(lower, -self.bound[i], inside);
            load[i] = T::choose(upper, self.bound[i], not_upper);
        }
        (diagonal, load)
    }

    /// Which frictions are at their bounds at these accelerations.
    #[inline(always)]
    pub fn classify(&self, acceleration: &[T; DOFS]) -> Classified<T> {
        let (mut at_upper, mut at_lower) = (self.at_upper, self.at_lower);
        let mut changed = T::unequal(at_upper[0], at_upper[0]);
        for i in 0..JOINTS {
            let force = self.stiffness[i] * (self.target[i] - acceleration[i]);
            at_upper[i] = self.bound[i].below(force);
            at_lower[i] = force.below(-self.bound[i]);
            changed = T::either(changed, T::unequal(at_upper[i], self.at_upper[i]));
            changed = T::either(changed, T::unequal(at_lower[i], self.at_lower[i]));
        }
        Classified {
            at_upper,
            at_lower,
            changed: T::bits(changed),
        }
    }

    /// Takes a set over.
    #[inline(always)]
    pub fn accept(&mut self, set: &Classified<T>) {
        self.at_upper = set.at_upper;
        self.at_lower = set.at_lower;
    }

    /// The torques at the solution's accelerations, N m.
    #[inline(always)]
    pub fn torques(&self, acceleration: &[T; DOFS]) -> [T; JOINTS] {
        std::array::from_fn(|i| {
            let force = self.stiffness[i] * (self.target[i] - acceleration[i]);
            force.at_least(-self.bound[i]).at_most(self.bound[i])
        })
    }
}
