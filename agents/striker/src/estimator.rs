//! Estimates the puck's state: a Kalman filter over noisy, sometimes missing observations.
//!
//! For each of the axes x and y the state is position, velocity and the acceleration that the air flow causes; the flow
//! decays with its own time constant, so past steps inform the next. Bounces off the rims are
//! part of the prediction, and so are contacts with the mallet. Those are much less certain, so they widen
//! the velocity's covariance, and the next observations determine the velocity.

use nalgebra::{Matrix3, Vector3};

use crate::field::{Field, Vec2};
use crate::puck::{DRAG, Puck, Rim};

/// Standard deviation of an observed coordinate, metres.
const POSITION_NOISE: f64 = 1e-3;
/// Standard deviation of an observed velocity component, m/s.
const VELOCITY_NOISE: f64 = 0.1;
/// Standard deviation of the observed yaw rate, rad/s.
const SPIN_NOISE: f64 = 0.1;
/// Correlation time of the air flow, seconds.
pub const FLOW_TIME: f64 = 0.2;
/// Stationary standard deviation of the flow's acceleration per speed, 1/s.
pub const FLOW_PER_SPEED: f64 = 0.4;
/// An observation that deviates from its prediction by more than this many standard deviations implies an unexpected contact.
const OUTLIER_DEVIATIONS: f64 = 5.0;
/// Longest loss of the puck's tracking according to the rules, control steps.
const LOST_STEPS_MAX: u32 = 20;

/// One coordinate: mean and covariance of (position, velocity, flow acceleration).
#[derive(Debug, Clone, Copy)]
struct Axis {
    mean: Vector3<f64>,
    cov: Matrix3<f64>,
}

impl Axis {
    /// `deviation`: standard deviation of the velocity, m/s.
    fn new(position: f64, velocity: f64, deviation: f64) -> Self {
        Self {
            mean: Vector3::new(position, velocity, 0.0),
            cov: Matrix3::from_diagonal(&Vector3::new(1e-6, deviation * deviation, 1e-4)),
        }
    }

    fn predict_covariance(&mut self, dt: f64, speed: f64) {
        let fade = (-dt / FLOW_TIME).exp();
        // The usual names of a Kalman filter: transition f, process noise q.
        let f = Matrix3::new(
            1.0,
            dt,
            0.5 * dt * dt,
            0.0,
            1.0 - DRAG * dt,
            dt,
            0.0,
            0.0,
            fade,
        );
        let sigma = FLOW_PER_SPEED * speed;
        let mut q = Matrix3::zeros();
        q[(0, 0)] = 1e-9;
        q[(1, 1)] = 1e-7 + (0.25 * sigma * dt).powi(2);
        q[(2, 2)] = sigma * sigma * (1.0 - fade * fade) + 1e-6;
        self.cov = f * self.cov * f.transpose() + q;
    }

    /// Kalman update with an observed `value` of the state's component `index`, whose standard deviation is `noise`.
    fn update(&mut self, index: usize, value: f64, noise: f64) {
        let column: Vector3<f64> = self.cov.column(index).into();
        let gain = column / (column[index] + noise * noise);
        self.mean += gain * (value - self.mean[index]);
        self.cov -= gain * column.transpose();
    }

    /// Makes the velocity less certain by a standard deviation of `deviation`, m/s.
    fn widen_velocity(&mut self, deviation: f64) {
        self.cov[(1, 1)] += deviation * deviation;
    }
}

/// State of the own mallet at the time of an observation.
#[derive(Debug, Clone, Copy)]
pub struct MalletState {
    /// Position, field frame, metres.
    pub pos: Vec2,
    /// Velocity, m/s.
    pub vel: Vec2,
}

/// An observation of the puck: pose and velocity in the field frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PuckObservation {
    /// x, y, metres; yaw, radians.
    pub pose: [f64; 3],
    /// Velocity in x and y, m/s; yaw rate, rad/s.
    pub velocity: [f64; 3],
}

#[derive(Debug, Clone)]
pub struct Estimator {
    field: Field,
    dt: f64,
    /// x and y; `None` before the first observation.
    axes: Option<[Axis; 2]>,
    /// Estimated yaw rate, rad/s, and its variance.
    spin: f64,
    spin_variance: f64,
    last_observation: Option<PuckObservation>,
    /// Control steps since tracking was lost.
    lost_steps: u32,
}

impl Estimator {
    /// A filter before the first observation.
    pub fn new(field: &Field, dt: f64) -> Self {
        Self {
            field: field.clone(),
            dt,
            axes: None,
            spin: 0.0,
            spin_variance: 1.0,
            last_observation: None,
            lost_steps: 0,
        }
    }

    pub fn reset(&mut self) {
        *self = Self::new(&self.field, self.dt);
    }

    /// Standard deviations of the estimated velocity's components, m/s.
    pub fn velocity_deviation(&self) -> Vec2 {
        self.axes.map_or(Vec2::zeros(), |[x, y]| {
            Vec2::new(x.cov[(1, 1)].max(0.0).sqrt(), y.cov[(1, 1)].max(0.0).sqrt())
        })
    }

    /// Updates the filter with the observation of this control step and returns the estimate.
    pub fn observe(&mut self, observed: &PuckObservation, mallet: MalletState) -> Puck {
        let is_lost = self.is_lost(observed);
        self.last_observation = Some(*observed);
        let [vx, vy, spin] = observed.velocity;
        let Some(mut axes) = self.axes else {
            self.axes = Some([
                Axis::new(observed.pose[0], vx, VELOCITY_NOISE),
                Axis::new(observed.pose[1], vy, VELOCITY_NOISE),
            ]);
            self.spin = spin;
            self.spin_variance = SPIN_NOISE * SPIN_NOISE;
            return self.estimate();
        };
        self.predict(&mut axes, mallet);
        self.lost_steps = if is_lost { self.lost_steps + 1 } else { 0 };
        if !is_lost {
            for (axis, (position, velocity)) in axes
                .iter_mut()
                .zip([(observed.pose[0], vx), (observed.pose[1], vy)])
            {
                let innovation = position - axis.mean[0];
                if innovation.abs()
                    > OUTLIER_DEVIATIONS
                        * (axis.cov[(0, 0)] + POSITION_NOISE * POSITION_NOISE).sqrt()
                {
                    // An unexpected contact: the wider covariance adopts the observed position at once and the velocity soon.
                    axis.cov[(0, 0)] += innovation * innovation;
                    axis.widen_velocity((innovation.abs() / self.dt).min(3.0));
                }
                axis.update(0, position, POSITION_NOISE);
                axis.update(1, velocity, VELOCITY_NOISE);
            }
            let gain = self.spin_variance / (self.spin_variance + SPIN_NOISE * SPIN_NOISE);
            self.spin += gain * (spin - self.spin);
            self.spin_variance *= 1.0 - gain;
        }
        self.axes = Some(axes);
        self.estimate()
    }

    fn estimate(&self) -> Puck {
        let [x, y] = self.axes.unwrap_or([Axis::new(0.0, 0.0, 1.0); 2]);
        Puck {
            pos: Vec2::new(x.mean[0], y.mean[0]),
            vel: Vec2::new(x.mean[1], y.mean[1]),
            spin: self.spin,
        }
    }

    /// A lost puck is reported at its last position, bit for bit, with zero velocity. A puck at rest
    /// without noise looks the same; it may be treated as seen.
    fn is_lost(&self, observed: &PuckObservation) -> bool {
        let repeated = self
            .last_observation
            .is_some_and(|last| last.pose == observed.pose)
            && observed.velocity == [0.0; 3];
        repeated && self.lost_steps < LOST_STEPS_MAX && self.estimate().vel.norm() > 0.005
    }

    fn predict(&mut self, axes: &mut [Axis; 2], mallet: MalletState) {
        let dt = self.dt;
        let before = self.estimate();
        let flow = Vec2::new(axes[0].mean[2], axes[1].mean[2]);
        let mut puck = before;
        puck.vel += 0.5 * dt * flow;
        let rim = puck
            .next_rim(&self.field)
            .filter(|(t, _)| *t <= dt)
            .map(|(_, rim)| rim);
        puck.advance(&self.field, dt);
        puck.vel += 0.5 * dt * flow;
        // Distance of the surfaces of puck and mallet, metres.
        let gap = (puck.pos - mallet.pos).norm() - self.field.contact_distance();
        let is_touched = gap < 0.0 && (puck.vel - mallet.vel).dot(&(puck.pos - mallet.pos)) < 0.0;
        let closing_speed = (before.vel - mallet.vel).norm();
        if is_touched {
            puck.strike(mallet.pos, mallet.vel);
        }
        let speed = before.vel.norm();
        let fade = (-dt / FLOW_TIME).exp();
        for (i, axis) in axes.iter_mut().enumerate() {
            axis.predict_covariance(dt, speed);
            axis.mean = Vector3::new(puck.pos[i], puck.vel[i], flow[i] * fade);
            let bounced = matches!((rim, i), (Some(Rim::Short), 0) | (Some(Rim::Long), 1));
            if bounced {
                // A bounce multiplies the speed by 0.69 to 1.03, depending on when within the simulator's millisecond the puck arrives.
                axis.widen_velocity(0.12 * before.vel[i].abs());
                axis.cov[(0, 0)] += (0.5 * dt * 0.12 * before.vel[i]).powi(2);
                axis.cov[(0, 1)] = 0.0;
                axis.cov[(1, 0)] = 0.0;
            } else if rim.is_some() {
                axis.widen_velocity(0.05 * speed);
            }
            if is_touched || gap < 0.01 {
                axis.widen_velocity(0.03 + 0.6 * closing_speed);
            }
        }
        self.spin = puck.spin;
        // A contact changes the spin by an unknown amount.
        self.spin_variance += 0.05
            + if rim.is_some() || is_touched {
                25.0
            } else {
                0.0
            };
    }
}

#[cfg(test)]
mod tests;
