//! Converts mallet motions to joint commands: redundancy, limits and correction of model errors.
//!
//! The arm keeps a *reference*: joint angles and speeds that follow the desired mallet motion exactly
//! at constant height. The command sent is the reference plus a slowly learnt *correction*, because
//! the real arm's mass differs from its controller's model: it sags by up to a centimetre.

use nalgebra::Vector3;

use crate::env::{Env, JOINTS, Joints, joint_angle_max, joint_speed_max};
use crate::field::Vec2;
use crate::kinematics::{FOREARM_M, HAND_M, Jacobian, SHOULDER_M, UPPER_ARM_M, forward};
use crate::redundancy::{even_speeds, least_change, least_peak};

/// Share of the evaluator's joint speed limits that references may use; the rest is for tracking
/// errors and the observation filter.
const CRUISE_SHARE: f64 = 0.955;
/// Rate at which a free posture approaches its preference, 1/s.
const POSTURE_RATE: f64 = 4.0;
/// Share of the speed limits that a posture change may take.
const POSTURE_SHARE: f64 = 0.6;
/// Largest acceleration of a posture change, rad/s².
const POSTURE_ACCELERATION: f64 = 8.0;
/// Share of the possible speed that strikes are planned with: the posture is never exactly the best.
const STRIKE_SHARE: f64 = 0.98;
/// Largest correction of the tip per control step that does not come from the velocity, metres.
const NUDGE_MAX_M: f64 = 0.004;
/// Time in which the strike's way to share the load between joints fades, seconds.
const FADE_TIME: f64 = 0.2;
/// Integral gain from observed joint errors to the correction, 1/s.
const CORRECTION_RATE: f64 = 4.0;
/// Bound of the correction; static errors of the plant stay well below it, radians.
const CORRECTION_MAX: f64 = 0.04;

/// Preference for the arm's four free degrees of freedom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Posture {
    /// Ready to strike: the family of [`Arm::strike_posture`].
    Ready(Side),
    /// Striking: as `Ready`, and the joints share the motion so that the fastest is as slow as
    /// possible.
    Strike(Side),
    /// No preference.
    Free,
}

/// To which side of the vertical plane through base and mallet the elbow leans.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Joint 5 negative: fast for strikes that turn to the left (+y) of the radius.
    Left,
    /// Joint 5 positive: fast for strikes that turn to the right.
    Right,
}

/// The reference of the arm, in its base frame.
#[derive(Debug, Clone)]
pub struct Arm {
    height: f64,
    speed_max: Joints,
    angle_max: Joints,
    dt: f64,
    /// Reference joint angles, radians.
    pub q: Joints,
    /// Reference joint speeds, rad/s.
    pub dq: Joints,
    drift: Joints,
    /// 0: loads spread evenly; 1: least peak load. In between while a strike fades out.
    sharpness: f64,
    /// Compliances of the joints in a strike.
    balance: Option<Joints>,
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
            speed_max: CRUISE_SHARE * joint_speed_max(&env.robot),
            angle_max: joint_angle_max(&env.robot),
            dt: env.dt,
            q: Joints::zeros(),
            dq: Joints::zeros(),
            drift: Joints::zeros(),
            sharpness: 0.0,
            balance: None,
            correction: Joints::zeros(),
        }
    }

    /// Starts at rest at the observed joint angles, without a correction.
    pub fn reset(&mut self, q: &Joints) {
        self.q = *q;
        self.dq = Joints::zeros();
        self.drift = Joints::zeros();
        self.sharpness = 0.0;
        self.balance = None;
        self.correction = Joints::zeros();
    }

    /// Learns from the observed joint angles, which belong to the present reference.
    pub fn observe(&mut self, q: &Joints) {
        let error = self.q - q;
        self.correction += CORRECTION_RATE * self.dt * error;
        for c in self.correction.iter_mut() {
            *c = c.clamp(-CORRECTION_MAX, CORRECTION_MAX);
        }
    }

    /// Advances the reference by one control step towards a mallet at `position` with `velocity`
    /// (base frame, metres, m/s), within the joint speed limits.
    pub fn advance(&mut self, position: Vec2, velocity: Vec2, posture: Posture) -> ReferenceState {
        let preferred = self.posture_rate(posture, position);
        let velocity = Vector3::new(velocity.x, velocity.y, 0.0);
        // Striking begins at rest, where the two ways to share a motion agree, and fades out after it.
        self.sharpness = match posture {
            Posture::Strike(_) => 1.0,
            Posture::Ready(_) | Posture::Free => (self.sharpness - self.dt / FADE_TIME).max(0.0),
        };
        let expected = forward(&(self.q + self.dt * self.dq));
        let (dq, share) = self.resolve(&expected.jacobian, &velocity, &preferred);
        // Constant acceleration over the step, as in the cubic interpolation between its ends.
        let mut q = self.q + 0.5 * self.dt * (self.dq + dq);
        let end = forward(&q);
        let goal = if share < 1.0 {
            Vector3::new(end.tip.x, end.tip.y, self.height)
        } else {
            Vector3::new(position.x, position.y, self.height)
        };
        // The remaining error is small unless a reference jumped; a jump must not reach the joints.
        let error = goal - end.tip;
        let error = error * (NUDGE_MAX_M / error.norm().max(NUDGE_MAX_M));
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
        if self.sharpness < 1.0 {
            base += (1.0 - self.sharpness) * even_speeds(jacobian, velocity, &self.speed_max);
        }
        if self.sharpness > 0.0 {
            // Few steps from the last balance, so that it changes smoothly over a swing.
            let rounds = if self.balance.is_some() { 3 } else { 12 };
            let balance = self
                .balance
                .get_or_insert(self.speed_max.component_mul(&self.speed_max));
            base +=
                self.sharpness * least_peak(jacobian, velocity, &self.speed_max, balance, rounds);
        } else {
            self.balance = None;
        }
        let peak = base.component_div(&self.speed_max).amax();
        if peak >= 1.0 {
            return (base / peak, 1.0 / peak);
        }
        let null = preferred - least_change(jacobian, &(jacobian * preferred), &self.speed_max);
        let mut room = 1.0_f64;
        for i in 0..JOINTS {
            let (b, n, cap) = (base[i], null[i], self.speed_max[i]);
            if n.abs() > 1e-9 {
                room = room.min((cap * n.signum() - b) / n);
            }
        }
        (base + room.max(0.0) * null, 1.0)
    }

    /// Speed towards the preferred posture, changing no faster than the acceleration bound.
    fn posture_rate(&mut self, posture: Posture, position: Vec2) -> Joints {
        let desired = match posture {
            Posture::Free => Joints::zeros(),
            // A strike is over before the posture could follow.
            Posture::Strike(_) => Joints::zeros(),
            Posture::Ready(side) => POSTURE_RATE * (self.strike_posture(position, side) - self.q),
        };
        let step = POSTURE_ACCELERATION * self.dt;
        for i in 0..JOINTS {
            let cap = POSTURE_SHARE * self.speed_max[i];
            self.drift[i] += (desired[i].clamp(-cap, cap) - self.drift[i]).clamp(-step, step);
        }
        self.drift
    }

    /// The posture for striking at `position` (base frame): elbow up and the hand turned out of the
    /// arm's plane, so that all six joints share a radial swing. Found by maximising the
    /// radial speed within the joint speed limits at each reach; joints 5 and 6 come out nearly
    /// linear in the reach and joint 3 near zero, and the other three follow from the position.
    fn strike_posture(&self, position: Vec2, side: Side) -> Joints {
        let reach = position.norm();
        let lean = (0.6 + 0.6 * (reach - 0.65)).clamp(0.5, 1.0);
        let wrist = (1.78 - 1.45 * (reach - 0.65)).clamp(0.75, 1.85);
        let lean = match side {
            Side::Left => -lean,
            Side::Right => lean,
        };
        // With joints 5 and 6 given, forearm and hand are one rigid, bent link …
        let (along, across) = (
            FOREARM_M + HAND_M * wrist.cos(),
            HAND_M * wrist.sin() * lean.cos(),
        );
        let outward = HAND_M * wrist.sin() * lean.sin();
        let (lower, bend) = (along.hypot(across), across.atan2(along));
        let ahead = (reach * reach - outward * outward).max(0.0).sqrt();
        // … and the rest is a triangle between shoulder, elbow and tip. Angles from the vertical.
        let rise = self.height - SHOULDER_M;
        let distance = ahead.hypot(rise).min(0.999 * (UPPER_ARM_M + lower));
        let corner = |opposite: f64, a: f64, b: f64| {
            ((a * a + b * b - opposite * opposite) / (2.0 * a * b))
                .clamp(-1.0, 1.0)
                .acos()
        };
        let shoulder = ahead.atan2(rise) - corner(lower, UPPER_ARM_M, distance);
        let elbow = corner(distance, UPPER_ARM_M, lower);
        // The bent link leaves the elbow at `shoulder + π − elbow`, the forearm `bend` before that.
        let forearm = shoulder + std::f64::consts::PI - elbow - bend;
        let azimuth = position.y.atan2(position.x) - (outward / reach).clamp(-1.0, 1.0).asin();
        Joints::from([azimuth, shoulder, 0.0, shoulder - forearm, lean, wrist, 0.0])
    }

    /// Minimum time in which the free joints reach the posture for a strike from `position`, seconds.
    pub fn ready_time(&self, position: Vec2, side: Side) -> f64 {
        let change = self.strike_posture(position, side) - self.q;
        // Most of the motion is at full rate, the last part slower.
        let share = change.component_div(&self.speed_max);
        let longest = share[4].abs().max(share[5].abs());
        longest / POSTURE_SHARE + if longest > 0.05 { 0.15 } else { 0.0 }
    }

    /// Maximum speed of the mallet at `position` along `direction` (a unit vector, base frame) in the
    /// posture for striking, m/s.
    pub fn strike_speed(&self, position: Vec2, direction: Vec2, side: Side) -> f64 {
        let pose = forward(&self.strike_posture(position, side));
        let unit = Vector3::new(direction.x, direction.y, 0.0);
        let mut balance = self.speed_max.component_mul(&self.speed_max);
        let speeds = least_peak(&pose.jacobian, &unit, &self.speed_max, &mut balance, 12);
        let peak = speeds.component_div(&self.speed_max).amax();
        STRIKE_SHARE / peak.max(1e-6)
    }
}

#[cfg(test)]
mod tests;
