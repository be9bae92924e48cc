//! Moves the mallet: a wanted velocity in the table's plane becomes joint angles and speeds within the limits.
//!
//! Joints 3, 5 and 7 stay at zero. Joint 1 then turns the whole arm towards a point, and joints 2, 4 and 6 move it in
//! a vertical plane: upper arm, forearm and hand, three sticks. How the hand leans is a free choice.

use faceoff_agent::{Action, Env};

/// Height of joint 2, m.
const SHOULDER: f64 = 0.36;
const UPPER_ARM: f64 = 0.42;
const FOREARM: f64 = 0.40;
/// From joint 6 to the mallet's joint, m.
const HAND: f64 = 0.666;
/// Of the mallet, m/s².
const ACCELERATION: f64 = 8.0;
/// Of the joint speeds that the rules allow; the rest is for the controller's errors.
const SPEED_SHARE: f64 = 0.85;
/// How far from its base the arm goes, m.
const REACH: f64 = 1.25;
/// Kept to the edge of the mallet's area, m.
const ROOM: f64 = 0.015;

/// A reference that starts where the arm is, and that the arm follows. All in the robot's own base frame.
pub struct Mallet {
    dt: f64,
    height: f64,
    /// x of our goal line, m.
    pub goal: f64,
    x_min: f64,
    y_max: f64,
    fastest: [f64; 7],
    q: [f64; 7],
    pub x: f64,
    pub y: f64,
    pub vx: f64,
    pub vy: f64,
}

impl Mallet {
    pub fn new(env: &Env) -> Self {
        let middle = env.robot.base_distance_m().unwrap_or(1.51);
        let goal = middle - env.table.length / 2.0;
        Self {
            dt: env.dt,
            height: env.robot.ee_desired_height,
            goal,
            x_min: goal + env.mallet.radius + ROOM,
            y_max: env.table.width / 2.0 - env.mallet.radius - ROOM,
            // The rules count more than 95 % of a limit as broken.
            fastest: env.robot.joint_vel_limit[1].map(|limit| SPEED_SHARE * 0.95 * limit),
            q: [0.0; 7],
            x: 0.0,
            y: 0.0,
            vx: 0.0,
            vy: 0.0,
        }
    }

    /// Begins an episode at rest, at the joint angles that were seen.
    pub fn reset(&mut self, q: [f64; 7]) {
        self.q = q;
        [self.x, self.y] = forward(&q);
        (self.vx, self.vy) = (0.0, 0.0);
    }

    /// The nearest point that the mallet may go to.
    pub fn inside(&self, x: f64, y: f64) -> [f64; 2] {
        let y = y.clamp(-self.y_max, self.y_max);
        [x.max(self.x_min).min((REACH * REACH - y * y).sqrt()), y]
    }

    /// One step towards a point (m), at most at `speed` (m/s), and no faster than it can still brake.
    pub fn go(&mut self, [x, y]: [f64; 2], speed: f64) -> Action {
        let [x, y] = self.inside(x, y);
        let away = (x - self.x).hypot(y - self.y);
        let wish = speed
            .min((ACCELERATION * away).sqrt())
            .min(0.5 * away / self.dt)
            / away.max(1e-6);
        self.r#move(wish * (x - self.x), wish * (y - self.y))
    }

    /// One step at a wanted velocity (m/s), as far as acceleration and joints allow.
    pub fn r#move(&mut self, vx: f64, vy: f64) -> Action {
        let change = (vx - self.vx).hypot(vy - self.vy);
        let share = (ACCELERATION * self.dt / change.max(1e-9)).min(1.0);
        let (mut vx, mut vy) = (
            self.vx + share * (vx - self.vx),
            self.vy + share * (vy - self.vy),
        );
        for _ in 0..5 {
            let aimed = [
                self.x + 0.5 * self.dt * (self.vx + vx),
                self.y + 0.5 * self.dt * (self.vy + vy),
            ];
            let [x, y] = self.inside(aimed[0], aimed[1]);
            vx = if x == aimed[0] { vx } else { 0.0 };
            vy = if y == aimed[1] { vy } else { 0.0 };
            let q = inverse(x, y, self.height);
            let ahead = inverse(x + 0.001 * vx, y + 0.001 * vy, self.height);
            let speeds: [f64; 7] = std::array::from_fn(|i| (ahead[i] - q[i]) / 0.001);
            let load = (0..7).fold(0.0_f64, |load, i| {
                let step = (q[i] - self.q[i]) / self.dt;
                load.max(speeds[i].abs().max(step.abs()) / self.fastest[i])
            });
            if load <= 1.0 {
                (self.q, self.x, self.y, self.vx, self.vy) = (q, x, y, vx, vy);
                return Action::PositionVelocity([q, speeds]);
            }
            // Too fast for a joint: more slowly.
            (vx, vy) = (vx / load.max(1.2), vy / load.max(1.2));
        }
        (self.vx, self.vy) = (0.0, 0.0);
        Action::PositionVelocity([self.q, [0.0; 7]])
    }
}

/// The seven angles with which the mallet is at a point of the robot's base frame.
pub fn inverse(x: f64, y: f64, z: f64) -> [f64; 7] {
    let reach = x.hypot(y);
    // The hand's angle from straight up: hanging down near the base, stretched out far from it.
    let hand = 2.618 - 0.85 * (reach - 0.65);
    let ahead = reach - HAND * hand.sin();
    let above = z - HAND * hand.cos() - SHOULDER;
    // Shoulder, elbow and wrist are a triangle whose sides are known.
    let side = ahead
        .hypot(above)
        .clamp(0.05, 0.999 * (UPPER_ARM + FOREARM));
    let elbow = corner(side, UPPER_ARM, FOREARM);
    let upper = ahead.atan2(above) - corner(FOREARM, UPPER_ARM, side);
    let forearm = upper + std::f64::consts::PI - elbow;
    [
        y.atan2(x),
        upper,
        0.0,
        upper - forearm,
        0.0,
        hand - forearm,
        0.0,
    ]
}

/// x and y of the mallet for angles whose joints 3, 5 and 7 are about zero.
pub fn forward(q: &[f64; 7]) -> [f64; 2] {
    let forearm = q[1] - q[3];
    let hand = forearm + q[5];
    let reach = UPPER_ARM * q[1].sin() + FOREARM * forearm.sin() + HAND * hand.sin();
    [reach * q[0].cos(), reach * q[0].sin()]
}

/// The angle of a triangle between sides a and b.
fn corner(opposite: f64, a: f64, b: f64) -> f64 {
    ((a * a + b * b - opposite * opposite) / (2.0 * a * b))
        .clamp(-1.0, 1.0)
        .acos()
}
