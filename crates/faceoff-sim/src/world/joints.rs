//! Dry friction and stops of the joints: soft constraints, one unknown force each.
//!
//! A constraint's force is `stiffness · (target − acceleration)`, held within its bounds. Which
//! constraints are at a bound rarely changes between substeps, so the set is stored. Given the set, all forces
//! follow from one linear solve; the set is corrected until it agrees with them. This module handles one arm with
//! friction and stops; `friction.rs` handles the ordinary case, friction only, in lanes.

use crate::{
    model::{DOFS, JOINTS, LINKS},
    robot::plant::Plant,
    table::contact_law::{JOINT, Material},
};
use std::f64::consts::FRAC_PI_2;

/// Largest number of iterations of the line search, and the relative change that ends it.
const LINE_SEARCH_ROUNDS: usize = 60;
const LINE_SEARCH_TOLERANCE: f64 = 1e-14;

/// Position of a dry friction's force relative to its bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Friction {
    Inside,
    AtUpper,
    AtLower,
}

/// A joint beyond its range.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stop {
    joint: usize,
    /// +1 at the lower stop, −1 at the upper: the direction of the stop's torque.
    sign: f64,
    stiffness: f64,
    /// Desired acceleration along `sign`, rad/s².
    target: f64,
    pressing: bool,
}

/// The joint constraints of one arm in one substep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointConstraints {
    pub(super) friction: [Friction; JOINTS],
    pub(super) friction_stiffness: [f64; JOINTS],
    pub(super) friction_bound: [f64; JOINTS],
    /// Desired acceleration, rad/s².
    pub(super) friction_target: [f64; JOINTS],
    stops: [Option<Stop>; DOFS],
    any_stop: bool,
}

impl JointConstraints {
    /// For a plant at rest.
    pub fn new(plant: &Plant) -> Self {
        let softness = Material::softness(JOINT.impedance_0);
        Self {
            friction: [Friction::Inside; JOINTS],
            friction_stiffness: std::array::from_fn(|i| {
                1.0 / (plant.inverse_inertia[i] * softness)
            }),
            friction_bound: plant.friction,
            friction_target: [0.0; JOINTS],
            stops: [None; DOFS],
            any_stop: false,
        }
    }

    /// Was a joint beyond its stop in the last substep?
    pub fn any_stop(&self) -> bool {
        self.any_stop
    }

    /// Sets up a substep's stops from positions (rad) and velocities (rad/s).
    #[cold]
    pub fn prepare_stops(&mut self, plant: &Plant, q: &[f64; DOFS], dq: &[f64; DOFS]) {
        self.any_stop = false;
        for i in 0..DOFS {
            let range = if i < JOINTS {
                LINKS[i].range_rad
            } else {
                FRAC_PI_2
            };
            let depth = q[i].abs() - range;
            self.stops[i] = (depth > 0.0).then(|| {
                self.any_stop = true;
                let sign = -q[i].signum();
                let impedance = JOINT.impedance(depth);
                Stop {
                    joint: i,
                    sign,
                    stiffness: 1.0 / (plant.inverse_inertia[i] * Material::softness(impedance)),
                    target: JOINT.stiffness_per_s2 * impedance * depth
                        - JOINT.damping_per_s * sign * dq[i],
                    pressing: true,
                }
            });
        }
    }

    /// Contributions of the constraints within their bounds to the inertia's diagonal, and of all constraints to the
    /// load: `(M + diag) a = load`.
    pub fn assemble(&self) -> ([f64; DOFS], [f64; DOFS]) {
        let (mut diagonal, mut load) = ([0.0; DOFS], [0.0; DOFS]);
        for i in 0..JOINTS {
            match self.friction[i] {
                Friction::Inside => {
                    diagonal[i] = self.friction_stiffness[i];
                    load[i] = self.friction_stiffness[i] * self.friction_target[i];
                }
                Friction::AtUpper => load[i] = self.friction_bound[i],
                Friction::AtLower => load[i] = -self.friction_bound[i],
            }
        }
        if self.any_stop {
            for stop in self.stops.iter().flatten().filter(|stop| stop.pressing) {
                diagonal[stop.joint] += stop.stiffness;
                load[stop.joint] += stop.sign * stop.stiffness * stop.target;
            }
        }
        (diagonal, load)
    }

    /// Updates the set of constraints at their bounds from accelerations. Returns whether the set changed.
    pub fn classify(&mut self, acceleration: &[f64; DOFS]) -> bool {
        let mut changed = false;
        for i in 0..JOINTS {
            let force = self.friction_stiffness[i] * (self.friction_target[i] - acceleration[i]);
            let state = if force > self.friction_bound[i] {
                Friction::AtUpper
            } else if force < -self.friction_bound[i] {
                Friction::AtLower
            } else {
                Friction::Inside
            };
            changed |= state != self.friction[i];
            self.friction[i] = state;
        }
        if self.any_stop {
            for stop in self.stops.iter_mut().flatten() {
                let pressing = stop.target - stop.sign * acceleration[stop.joint] > 0.0;
                changed |= pressing != stop.pressing;
                stop.pressing = pressing;
            }
        }
        changed
    }

    /// The stiffness of the constraints that are not at a bound at these accelerations.
    fn active_stiffness(&self, acceleration: &[f64; DOFS]) -> [f64; DOFS] {
        let mut stiffness = [0.0; DOFS];
        for i in 0..JOINTS {
            let force = self.friction_stiffness[i] * (self.friction_target[i] - acceleration[i]);
            if force.abs() <= self.friction_bound[i] {
                stiffness[i] = self.friction_stiffness[i];
            }
        }
        for stop in self.stops.iter().flatten() {
            if stop.target - stop.sign * acceleration[stop.joint] > 0.0 {
                stiffness[stop.joint] += stop.stiffness;
            }
        }
        stiffness
    }

    /// Step length from accelerations `from` along `direction` to the minimum of the convex function
    /// whose gradient is `M a − load − torques(a)`: the point where its slope along the direction
    /// vanishes. `residual` is `M from − load`, `curvature` the direction's own `dᵀ M d`.
    pub fn line_search(
        &self,
        from: &[f64; DOFS],
        direction: &[f64; DOFS],
        residual: &[f64; DOFS],
        curvature: f64,
    ) -> f64 {
        let dot = |a: &[f64; DOFS]| -> f64 { (0..DOFS).map(|i| a[i] * direction[i]).sum() };
        let start = dot(residual);
        let (mut low, mut high) = (0.0, f64::INFINITY);
        let mut t = 1.0;
        // The slope rises and is linear between a few kinks: Newton's method ends on its root
        // exactly, kept between the bracket's ends.
        for _ in 0..LINE_SEARCH_ROUNDS {
            let at: [f64; DOFS] = std::array::from_fn(|i| from[i] + t * direction[i]);
            let slope = start + t * curvature - dot(&self.torques(&at));
            if slope > 0.0 {
                high = t;
            } else {
                low = t;
            }
            let stiffness = self.active_stiffness(&at);
            let rise: f64 = curvature
                + (0..DOFS)
                    .map(|i| stiffness[i] * direction[i] * direction[i])
                    .sum::<f64>();
            let mut next = t - slope / rise;
            if next <= low || next >= high {
                next = if high.is_finite() {
                    0.5 * (low + high)
                } else {
                    2.0 * t
                };
            }
            if (next - t).abs() <= LINE_SEARCH_TOLERANCE * t {
                return next;
            }
            t = next;
        }
        t
    }

    /// The constraints' torques at the solution's accelerations, N m.
    pub fn torques(&self, acceleration: &[f64; DOFS]) -> [f64; DOFS] {
        let mut torques = [0.0; DOFS];
        for i in 0..JOINTS {
            let force = self.friction_stiffness[i] * (self.friction_target[i] - acceleration[i]);
            torques[i] = force.clamp(-self.friction_bound[i], self.friction_bound[i]);
        }
        if self.any_stop {
            for stop in self.stops.iter().flatten() {
                let force = stop.stiffness * (stop.target - stop.sign * acceleration[stop.joint]);
                torques[stop.joint] += stop.sign * force.max(0.0);
            }
        }
        torques
    }
}
