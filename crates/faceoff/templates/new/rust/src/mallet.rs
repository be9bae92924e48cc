//! Moves the mallet: turns a desired velocity in the table plane into joint motions within the limits.
//!
//! Joints 3, 5 and 7 stay at zero. Joint 1 then turns the whole arm towards a point, and joints 2, 4 and 6 move it in
//! a vertical plane with three links: upper arm, forearm and hand. The angle of the hand is a free choice.

use faceoff_agent::{Action, Env};

/// Height of joint 2, m.
const SHOULDER: f64 = 0.36;
/// Distance from joint 2 to joint 4, m.
const UPPER_ARM: f64 = 0.42;
/// Distance from joint 4 to joint 6, m.
const FOREARM: f64 = 0.40;
/// Distance from joint 6 to the mallet's joint, m.
const HAND: f64 = 0.666;
/// Acceleration of the mallet, m/s².
const ACCELERATION: f64 = 8.0;
/// Used fraction of the allowed joint speeds; the rest is a margin for control errors.
const SPEED_SHARE: f64 = 0.85;
/// Largest distance of the mallet from the robot's base, m.
const REACH: f64 = 1.25;
/// Distance to the edge of the mallet's area, m.
const MARGIN: f64 = 0.015;

/// The commanded mallet. It starts at the arm's pose, and the arm follows it. All in the robot's base frame.
pub struct Mallet {
    /// Length of a control step, s.
    dt: f64,
    /// Height of the end effector, m.
    height: f64,
    /// x of our goal line, m.
    pub goal: f64,
    /// The mallet's area: smallest x and largest |y|, m.
    x_min: f64,
    y_max: f64,
    /// Largest used joint speeds, rad/s.
    max_speeds: [f64; 7],
    /// Joint positions, rad.
    q: [f64; 7],
    /// Position (m) and velocity (m/s).
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
            x_min: goal + env.mallet.radius + MARGIN,
            y_max: env.table.width / 2.0 - env.mallet.radius - MARGIN,
            // The rules allow 95 % of a joint's speed limit.
            max_speeds: env.robot.joint_vel_limit[1].map(|limit| SPEED_SHARE * 0.95 * limit),
            q: [0.0; 7],
            x: 0.0,
            y: 0.0,
            vx: 0.0,
            vy: 0.0,
        }
    }

    /// Starts an episode at rest, at the observed joint positions.
    pub fn reset(&mut self, q: [f64; 7]) {
        self.q = q;
        [self.x, self.y] = forward(&q);
        (self.vx, self.vy) = (0.0, 0.0);
    }

    /// The nearest point that the mallet may reach.
    pub fn nearest_allowed(&self, x: f64, y: f64) -> [f64; 2] {
        let y = y.clamp(-self.y_max, self.y_max);
        [x.max(self.x_min).min((REACH * REACH - y * y).sqrt()), y]
    }

    /// One step towards a point (m), at most at `speed` (m/s) and slow enough to brake.
    pub fn move_to(&mut self, [x, y]: [f64; 2], speed: f64) -> Action {
        let [x, y] = self.nearest_allowed(x, y);
        let distance = (x - self.x).hypot(y - self.y);
        let scale = speed
            .min((ACCELERATION * distance).sqrt())
            .min(0.5 * distance / self.dt)
            / distance.max(1e-6);
        self.move_at_velocity(scale * (x - self.x), scale * (y - self.y))
    }

    /// One step at a desired velocity (m/s), as far as acceleration and joints allow.
    pub fn move_at_velocity(&mut self, vx: f64, vy: f64) -> Action {
        let change = (vx - self.vx).hypot(vy - self.vy);
        // The part of the change that the acceleration allows in one step.
        let share = (ACCELERATION * self.dt / change.max(1e-9)).min(1.0);
        let (mut vx, mut vy) = (
            self.vx + share * (vx - self.vx),
            self.vy + share * (vy - self.vy),
        );
        for _ in 0..5 {
            let target = [
                self.x + 0.5 * self.dt * (self.vx + vx),
                self.y + 0.5 * self.dt * (self.vy + vy),
            ];
            let [x, y] = self.nearest_allowed(target[0], target[1]);
            vx = if x == target[0] { vx } else { 0.0 };
            vy = if y == target[1] { vy } else { 0.0 };
            let q = inverse(x, y, self.height);
            // The joint speeds at the end of the step, from the joint positions one millisecond later.
            let next = inverse(x + 0.001 * vx, y + 0.001 * vy, self.height);
            let speeds: [f64; 7] = std::array::from_fn(|i| (next[i] - q[i]) / 0.001);
            // The largest joint speed of the step, as a fraction of its limit.
            let max_share = (0..7).fold(0.0_f64, |max_share, i| {
                let mean_speed = (q[i] - self.q[i]) / self.dt;
                max_share.max(speeds[i].abs().max(mean_speed.abs()) / self.max_speeds[i])
            });
            if max_share <= 1.0 {
                (self.q, self.x, self.y, self.vx, self.vy) = (q, x, y, vx, vy);
                return Action::PositionVelocity([q, speeds]);
            }
            // A joint would be too fast: try a slower motion.
            (vx, vy) = (vx / max_share.max(1.2), vy / max_share.max(1.2));
        }
        // No slower motion is allowed either: stop.
        (self.vx, self.vy) = (0.0, 0.0);
        Action::PositionVelocity([self.q, [0.0; 7]])
    }
}

/// The joint angles that bring the mallet to a point in the robot's base frame.
pub fn inverse(x: f64, y: f64, z: f64) -> [f64; 7] {
    let reach = x.hypot(y);
    // The hand's angle from the vertical: it hangs down near the base and is stretched out far from it.
    let hand = 2.618 - 0.85 * (reach - 0.65);
    let forward = reach - HAND * hand.sin();
    let up = z - HAND * hand.cos() - SHOULDER;
    // Shoulder, elbow and wrist form a triangle. `side` is its side from shoulder to wrist, opposite the elbow.
    let side = forward.hypot(up).clamp(0.05, 0.999 * (UPPER_ARM + FOREARM));
    let elbow = corner(side, UPPER_ARM, FOREARM);
    let upper = forward.atan2(up) - corner(FOREARM, UPPER_ARM, side);
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

/// x and y of the mallet, for joints 3, 5 and 7 near zero.
pub fn forward(q: &[f64; 7]) -> [f64; 2] {
    let forearm = q[1] - q[3];
    let hand = forearm + q[5];
    let reach = UPPER_ARM * q[1].sin() + FOREARM * forearm.sin() + HAND * hand.sin();
    [reach * q[0].cos(), reach * q[0].sin()]
}

/// The angle between the sides `a` and `b` of a triangle.
fn corner(opposite: f64, a: f64, b: f64) -> f64 {
    ((a * a + b * b - opposite * opposite) / (2.0 * a * b))
        .clamp(-1.0, 1.0)
        .acos()
}
