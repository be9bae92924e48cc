//! Converts mallet motions to joint commands, within the joints' limits and with a correction of model errors. The *tip* is the point of
//! the arm that carries the mallet; its position leaves four of the seven joint angles free, the *posture*.
//!
//! The arm keeps a *reference*: joint angles and speeds that follow the desired mallet motion exactly
//! at constant height. The command sent is the reference plus a slowly learnt *correction*, because
//! the real arm's mass differs from its controller's model, so the arm sags by up to a centimetre.

use nalgebra::Vector3;

use crate::env::{Env, JOINTS, Joints, joint_angle_max, joint_speed_max};
use crate::field::Vec2;
use crate::kinematics::{FOREARM_M, HAND_M, Jacobian, SHOULDER_M, UPPER_ARM_M, forward};
use crate::redundancy::{even_speeds, least_change, least_peak};

/// Share of the evaluator's joint speed limits that references may use; the rest is for tracking
/// errors and the observation filter.
const REFERENCE_SPEED_SHARE: f64 = 0.955;
/// Rate at which a free posture approaches its preference, 1/s.
const POSTURE_RATE: f64 = 4.0;
/// Share of the speed limits that a posture change may take.
const POSTURE_SPEED_SHARE: f64 = 0.6;
/// Largest acceleration of a posture change, rad/s².
const POSTURE_ACCELERATION: f64 = 8.0;
/// Share of the possible speed for which strikes are planned: the posture is never exactly the best.
const STRIKE_SHARE: f64 = 0.98;
/// Largest correction of the tip's position per control step, in addition to its velocity, metres.
const TIP_CORRECTION_MAX_M: f64 = 0.004;
/// Time after a strike in which the distribution of the load over the joints returns to the usual one, seconds.
const STRIKE_FADE_TIME: f64 = 0.2;
/// Integral gain from observed joint errors to the correction, 1/s.
const JOINT_CORRECTION_RATE: f64 = 4.0;
/// Bound of the joints' correction; static errors of the plant stay well below it, radians.
const JOINT_CORRECTION_MAX: f64 = 0.04;

/// Preference for the arm's four free degrees of freedom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Posture {
    /// Ready to strike: as [`Arm::strike_posture`] at the mallet's position.
    Ready(Side),
    /// Striking: as `Ready`, and the joints share the motion so that the fastest is as slow as
    /// possible.
    Strike(Side),
    /// No preference.
    Any,
}

/// To which side of the vertical plane through base and mallet the elbow leans.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Joint 5 negative: fast for strikes that turn to the left (+y) of the line from base to mallet.
    Left,
    /// Joint 5 positive: fast for strikes that turn to the right.
    Right,
}

/// The reference of the arm, in its base frame.
#[derive(Debug, Clone)]
pub struct Arm {
    /// Height of the tip, metres.
    height: f64,
    /// Bounds of the reference's joint speeds, rad/s, and angles, radians.
    speed_max: Joints,
    angle_max: Joints,
    /// Control period, seconds.
    dt: f64,
    /// Reference joint angles, radians.
    pub q: Joints,
    /// Reference joint speeds, rad/s.
    pub dq: Joints,
    /// Joint speeds towards the preferred posture, rad/s.
    posture_speed: Joints,
    /// How a motion is distributed over the joints. 0: loads spread evenly; 1: least peak load. In between after a strike.
    least_peak_weight: f64,
    /// Weights of the joints in a strike, found by [`least_peak`]; a larger one gives the joint more of the motion.
    strike_compliance: Option<Joints>,
    /// Learnt addition to the reference's joint angles, radians.
    correction: Joints,
}

/// The reference of the mallet after a control step (base frame).
#[derive(Debug, Clone, Copy)]
pub struct ReferenceState {
    /// Mallet position, metres.
    pub position: Vec2,
    /// Mallet velocity, m/s.
    pub velocity: Vec2,
}

impl Arm {
    /// An arm at joint angle zero; call [`Arm::reset`] before use.
    pub fn new(env: &Env) -> Self {
        Self {
            height: env.robot.ee_desired_height,
            speed_max: REFERENCE_SPEED_SHARE * joint_speed_max(&env.robot),
            angle_max: joint_angle_max(&env.robot),
            dt: env.dt,
            q: Joints::zeros(),
            dq: Joints::zeros(),
            posture_speed: Joints::zeros(),
            least_peak_weight: 0.0,
            strike_compliance: None,
            correction: Joints::zeros(),
        }
    }

    /// Starts at rest at the observed joint angles, without a correction.
    pub fn reset(&mut self, q: &Joints) {
        self.q = *q;
        self.dq = Joints::zeros();
        self.posture_speed = Joints::zeros();
        self.least_peak_weight = 0.0;
        self.strike_compliance = None;
        self.correction = Joints::zeros();
    }

    /// Learns from the observed joint angles, which belong to the present reference.
    pub fn observe(&mut self, q: &Joints) {
        let error = self.q - q;
        self.correction += JOINT_CORRECTION_RATE * self.dt * error;
        for angle in self.correction.iter_mut() {
            *angle = angle.clamp(-JOINT_CORRECTION_MAX, JOINT_CORRECTION_MAX);
        }
    }

    /// Advances the reference by one control step towards a mallet at `position` with `velocity`
    /// (base frame, metres, m/s), within the joint speed limits.
    pub fn advance(&mut self, position: Vec2, velocity: Vec2, posture: Posture) -> ReferenceState {
        let preferred = self.update_posture_speed(posture, position);
        let velocity = Vector3::new(velocity.x, velocity.y, 0.0);
        // A strike begins at rest, where both distributions of the motion agree. After it the weight fades.
        self.least_peak_weight = match posture {
            Posture::Strike(_) => 1.0,
            Posture::Ready(_) | Posture::Any => {
                (self.least_peak_weight - self.dt / STRIKE_FADE_TIME).max(0.0)
            }
        };
        let expected = forward(&(self.q + self.dt * self.dq));
        let (dq, allowed_share) = self.resolve(&expected.jacobian, &velocity, &preferred);
        // Constant acceleration over the step, as in the cubic interpolation between its ends.
        let mut q = self.q + 0.5 * self.dt * (self.dq + dq);
        let end = forward(&q);
        // Where the limits slow the motion down, only the height is corrected: the mallet cannot be at `position` yet.
        let target_tip = if allowed_share < 1.0 {
            Vector3::new(end.tip.x, end.tip.y, self.height)
        } else {
            Vector3::new(position.x, position.y, self.height)
        };
        // The remaining error is small unless a reference jumped; a jump must not reach the joints.
        let error = target_tip - end.tip;
        let error = error * (TIP_CORRECTION_MAX_M / error.norm().max(TIP_CORRECTION_MAX_M));
        q += least_change(&end.jacobian, &error, &self.speed_max);
        for i in 0..JOINTS {
            q[i] = q[i].clamp(-self.angle_max[i], self.angle_max[i]);
        }
        self.q = q;
        self.dq = dq;
        let end = forward(&q);
        let velocity = end.jacobian * dq;
        ReferenceState {
            position: end.tip.xy(),
            velocity: velocity.xy(),
        }
    }

    /// Position and velocity command for the end of this control step.
    pub fn action(&self) -> [[f64; JOINTS]; 2] {
        [(self.q + self.correction).into(), self.dq.into()]
    }

    /// Joint speeds that move the tip with `velocity` and, as far as the limits leave room, the free
    /// posture with `preferred`. Also the share of `velocity` that the limits allow.
    fn resolve(
        &mut self,
        jacobian: &Jacobian,
        velocity: &Vector3<f64>,
        preferred: &Joints,
    ) -> (Joints, f64) {
        let mut base = Joints::zeros();
        if self.least_peak_weight < 1.0 {
            base +=
                (1.0 - self.least_peak_weight) * even_speeds(jacobian, velocity, &self.speed_max);
        }
        if self.least_peak_weight > 0.0 {
            // Few iterations from the last weights, so that they change smoothly over a swing.
            let iterations = if self.strike_compliance.is_some() {
                3
            } else {
                12
            };
            let strike_compliance = self
                .strike_compliance
                .get_or_insert(self.speed_max.component_mul(&self.speed_max));
            base += self.least_peak_weight
                * least_peak(
                    jacobian,
                    velocity,
                    &self.speed_max,
                    strike_compliance,
                    iterations,
                );
        } else {
            self.strike_compliance = None;
        }
        let peak = base.component_div(&self.speed_max).amax();
        if peak >= 1.0 {
            return (base / peak, 1.0 / peak);
        }
        // The part of `preferred` that does not move the tip.
        let posture_motion =
            preferred - least_change(jacobian, &(jacobian * preferred), &self.speed_max);
        let mut posture_share = 1.0_f64;
        for i in 0..JOINTS {
            let (base_speed, posture_speed, cap) = (base[i], posture_motion[i], self.speed_max[i]);
            if posture_speed.abs() > 1e-9 {
                posture_share =
                    posture_share.min((cap * posture_speed.signum() - base_speed) / posture_speed);
            }
        }
        (base + posture_share.max(0.0) * posture_motion, 1.0)
    }

    /// Changes the speeds towards the preferred posture, no faster than the acceleration bound, and returns them.
    fn update_posture_speed(&mut self, posture: Posture, position: Vec2) -> Joints {
        let desired = match posture {
            Posture::Any => Joints::zeros(),
            // A strike is over before the posture could follow.
            Posture::Strike(_) => Joints::zeros(),
            Posture::Ready(side) => POSTURE_RATE * (self.strike_posture(position, side) - self.q),
        };
        let step = POSTURE_ACCELERATION * self.dt;
        for i in 0..JOINTS {
            let cap = POSTURE_SPEED_SHARE * self.speed_max[i];
            self.posture_speed[i] +=
                (desired[i].clamp(-cap, cap) - self.posture_speed[i]).clamp(-step, step);
        }
        self.posture_speed
    }

    /// The posture for striking at `position` (base frame): elbow up and the hand turned out of the
    /// arm's plane, so that all six joints share a radial swing. Found by maximising the
    /// radial speed within the joint speed limits at each reach; joints 5 and 6 come out nearly
    /// linear in the reach and joint 3 near zero, and the other three follow from the position.
    fn strike_posture(&self, position: Vec2, side: Side) -> Joints {
        let reach = position.norm();
        // Joints 5 and 6, as linear functions of the reach.
        let lean_size = (0.6 + 0.6 * (reach - 0.65)).clamp(0.5, 1.0);
        let wrist = (1.78 - 1.45 * (reach - 0.65)).clamp(0.75, 1.85);
        let lean = match side {
            Side::Left => -lean_size,
            Side::Right => lean_size,
        };
        // With joints 5 and 6 given, forearm and hand are one rigid, bent link from elbow to tip …
        let (along, across) = (
            FOREARM_M + HAND_M * wrist.cos(),
            HAND_M * wrist.sin() * lean.cos(),
        );
        // How far the tip is outside of the vertical plane of upper arm and forearm.
        let outward = HAND_M * wrist.sin() * lean.sin();
        let (link_length, bend) = (along.hypot(across), across.atan2(along));
        // The tip's horizontal distance from the base within that plane.
        let reach_in_plane = (reach * reach - outward * outward).max(0.0).sqrt();
        // … and the rest is a triangle between shoulder, elbow and tip. Angles from the vertical.
        let rise = self.height - SHOULDER_M;
        let distance = reach_in_plane
            .hypot(rise)
            .min(0.999 * (UPPER_ARM_M + link_length));
        let triangle_angle = |opposite: f64, a: f64, b: f64| {
            ((a * a + b * b - opposite * opposite) / (2.0 * a * b))
                .clamp(-1.0, 1.0)
                .acos()
        };
        let shoulder =
            reach_in_plane.atan2(rise) - triangle_angle(link_length, UPPER_ARM_M, distance);
        let elbow = triangle_angle(distance, UPPER_ARM_M, link_length);
        // The bent link leaves the elbow at `shoulder + π − elbow`, the forearm `bend` before that.
        let forearm = shoulder + std::f64::consts::PI - elbow - bend;
        let azimuth = position.y.atan2(position.x) - (outward / reach).clamp(-1.0, 1.0).asin();
        Joints::from([azimuth, shoulder, 0.0, shoulder - forearm, lean, wrist, 0.0])
    }

    /// Minimum time in which the posture for a strike from `position` is reached, seconds.
    pub fn posture_time(&self, position: Vec2, side: Side) -> f64 {
        let change = self.strike_posture(position, side) - self.q;
        // Joints 5 and 6 determine the time. Most of the motion is at the posture's full speed, the last part slower.
        let times = change.component_div(&self.speed_max);
        let longest = times[4].abs().max(times[5].abs());
        longest / POSTURE_SPEED_SHARE + if longest > 0.05 { 0.15 } else { 0.0 }
    }

    /// Maximum speed of the mallet at `position` along `direction` (a unit vector, base frame) in the
    /// posture for striking, m/s.
    pub fn strike_speed(&self, position: Vec2, direction: Vec2, side: Side) -> f64 {
        let pose = forward(&self.strike_posture(position, side));
        let unit = Vector3::new(direction.x, direction.y, 0.0);
        let mut strike_compliance = self.speed_max.component_mul(&self.speed_max);
        let speeds = least_peak(
            &pose.jacobian,
            &unit,
            &self.speed_max,
            &mut strike_compliance,
            12,
        );
        let peak = speeds.component_div(&self.speed_max).amax();
        STRIKE_SHARE / peak.max(1e-6)
    }
}

#[cfg(test)]
mod tests;
