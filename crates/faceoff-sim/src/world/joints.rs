//! Dry friction and *stops* (the ends of the range) of the joints of one arm: soft constraints, as in MuJoCo, with one unknown torque each.
//! The seven driven joints have friction and stops, the two hinges of the mallet's universal joint only stops.
//!
//! A constraint's torque (N m) is `stiffness · (target − acceleration)`, limited to its bounds: the *target* is the joint acceleration that
//! the constraint wants (rad/s²), the *stiffness* its torque per difference from it (kg m²). Dry friction is bounded in both directions, a
//! stop only pushes. The *bound set* says which constraints are at a bound. It rarely changes between substeps, so it is stored. Given the
//! set, all torques follow from one linear solve; the set is corrected until it agrees with them. This module handles one arm with
//! friction and stops; `friction.rs` handles the ordinary case, friction only, for several arms in SIMD lanes.

use crate::{
    model::{DOFS, HINGE_RANGE_RAD, JOINTS, LINKS},
    robot::plant::Plant,
    table::contact_law::{JOINT, Material},
};

/// Largest number of iterations of the line search, and the relative change of the step length that ends it.
const MAX_LINE_SEARCH_ITERATIONS: usize = 60;
const LINE_SEARCH_TOLERANCE: f64 = 1e-14;

/// Position of a dry friction's torque relative to its bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FrictionState {
    Inside,
    AtUpper,
    AtLower,
}

/// A joint beyond its stop.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ActiveStop {
    joint: usize,
    /// +1 at the lower stop, −1 at the upper: the direction of the stop's torque.
    sign: f64,
    /// kg m².
    stiffness: f64,
    /// Desired acceleration along `sign`, rad/s².
    target: f64,
    /// Does the stop push? Otherwise the joint leaves it without its help.
    is_pushing: bool,
}

/// The joint constraints of one arm in one substep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointConstraints {
    pub(super) friction: [FrictionState; JOINTS],
    /// kg m².
    pub(super) friction_stiffness: [f64; JOINTS],
    /// Largest torque ± of the dry friction, N m.
    pub(super) friction_bound: [f64; JOINTS],
    /// Desired acceleration, rad/s².
    pub(super) friction_target: [f64; JOINTS],
    /// The stops beyond which joints are, by joint.
    stops: [Option<ActiveStop>; DOFS],
    /// Is any joint beyond its stop?
    is_at_stop: bool,
}

impl JointConstraints {
    /// The constraints of an arm at rest.
    pub fn new(plant: &Plant) -> Self {
        let regularisation_per_inverse_inertia =
            Material::regularisation_per_inverse_inertia(JOINT.impedance_0);
        Self {
            friction: [FrictionState::Inside; JOINTS],
            friction_stiffness: std::array::from_fn(|i| {
                1.0 / (plant.inverse_inertia[i] * regularisation_per_inverse_inertia)
            }),
            friction_bound: plant.friction,
            friction_target: [0.0; JOINTS],
            stops: [None; DOFS],
            is_at_stop: false,
        }
    }

    /// Was a joint beyond its stop in the last substep?
    pub fn was_at_stop(&self) -> bool {
        self.is_at_stop
    }

    /// Sets up a substep's stops from positions (rad) and velocities (rad/s).
    #[cold]
    pub fn prepare_stops(&mut self, plant: &Plant, q: &[f64; DOFS], dq: &[f64; DOFS]) {
        self.is_at_stop = false;
        for i in 0..DOFS {
            let range = if i < JOINTS {
                LINKS[i].range_rad
            } else {
                HINGE_RANGE_RAD
            };
            let depth = q[i].abs() - range;
            self.stops[i] = (depth > 0.0).then(|| {
                self.is_at_stop = true;
                let sign = -q[i].signum();
                let impedance = JOINT.impedance(depth);
                ActiveStop {
                    joint: i,
                    sign,
                    stiffness: 1.0
                        / (plant.inverse_inertia[i]
                            * Material::regularisation_per_inverse_inertia(impedance)),
                    target: JOINT.stiffness_per_s2 * impedance * depth
                        - JOINT.damping_per_s * sign * dq[i],
                    is_pushing: true,
                }
            });
        }
    }

    /// The contributions of the constraints to the equations `(M + diagonal) · acceleration = load`: those within their bounds to the
    /// diagonal (kg m²), and all to the load (N m). M is the joint-space inertia.
    pub fn assemble(&self) -> ([f64; DOFS], [f64; DOFS]) {
        let (mut diagonal, mut load) = ([0.0; DOFS], [0.0; DOFS]);
        for i in 0..JOINTS {
            match self.friction[i] {
                FrictionState::Inside => {
                    diagonal[i] = self.friction_stiffness[i];
                    load[i] = self.friction_stiffness[i] * self.friction_target[i];
                }
                FrictionState::AtUpper => load[i] = self.friction_bound[i],
                FrictionState::AtLower => load[i] = -self.friction_bound[i],
            }
        }
        if self.is_at_stop {
            for stop in self.stops.iter().flatten().filter(|stop| stop.is_pushing) {
                diagonal[stop.joint] += stop.stiffness;
                load[stop.joint] += stop.sign * stop.stiffness * stop.target;
            }
        }
        (diagonal, load)
    }

    /// Updates the bound set from accelerations (rad/s²). Returns whether the set changed.
    pub fn classify(&mut self, acceleration: &[f64; DOFS]) -> bool {
        let mut changed = false;
        for i in 0..JOINTS {
            let torque = self.friction_stiffness[i] * (self.friction_target[i] - acceleration[i]);
            let state = if torque > self.friction_bound[i] {
                FrictionState::AtUpper
            } else if torque < -self.friction_bound[i] {
                FrictionState::AtLower
            } else {
                FrictionState::Inside
            };
            changed |= state != self.friction[i];
            self.friction[i] = state;
        }
        if self.is_at_stop {
            for stop in self.stops.iter_mut().flatten() {
                let is_pushing = stop.target - stop.sign * acceleration[stop.joint] > 0.0;
                changed |= is_pushing != stop.is_pushing;
                stop.is_pushing = is_pushing;
            }
        }
        changed
    }

    /// The sum of the stiffnesses of each joint's constraints that are not at a bound at these accelerations, kg m².
    fn active_stiffness(&self, acceleration: &[f64; DOFS]) -> [f64; DOFS] {
        let mut stiffness = [0.0; DOFS];
        for i in 0..JOINTS {
            let torque = self.friction_stiffness[i] * (self.friction_target[i] - acceleration[i]);
            if torque.abs() <= self.friction_bound[i] {
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

    /// The factor of `direction` that leads from the accelerations `start` to the minimum of the convex function
    /// whose gradient is `M a − load − torques(a)`: the point where its slope along the direction
    /// vanishes. `residual` is `M start − load`, `curvature` is `dᵀ M d` for the direction d.
    pub fn line_search(
        &self,
        start: &[f64; DOFS],
        direction: &[f64; DOFS],
        residual: &[f64; DOFS],
        curvature: f64,
    ) -> f64 {
        let dot =
            |vector: &[f64; DOFS]| -> f64 { (0..DOFS).map(|i| vector[i] * direction[i]).sum() };
        let slope_of_residual = dot(residual);
        let (mut low, mut high) = (0.0, f64::INFINITY);
        let mut t = 1.0;
        // The slope increases and is piecewise linear, with few kinks, so Newton's method ends exactly at its root. A bracket (low, high)
        // keeps it from jumping away.
        for _ in 0..MAX_LINE_SEARCH_ITERATIONS {
            let acceleration: [f64; DOFS] = std::array::from_fn(|i| start[i] + t * direction[i]);
            let slope = slope_of_residual + t * curvature - dot(&self.torques(&acceleration));
            if slope > 0.0 {
                high = t;
            } else {
                low = t;
            }
            let stiffness = self.active_stiffness(&acceleration);
            let slope_derivative: f64 = curvature
                + (0..DOFS)
                    .map(|i| stiffness[i] * direction[i] * direction[i])
                    .sum::<f64>();
            let mut next = t - slope / slope_derivative;
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
            let torque = self.friction_stiffness[i] * (self.friction_target[i] - acceleration[i]);
            torques[i] = torque.clamp(-self.friction_bound[i], self.friction_bound[i]);
        }
        if self.is_at_stop {
            for stop in self.stops.iter().flatten() {
                let torque = stop.stiffness * (stop.target - stop.sign * acceleration[stop.joint]);
                torques[stop.joint] += stop.sign * torque.max(0.0);
            }
        }
        torques
    }
}
