//! Shots at the opponent's goal and their chance of a goal: straight shots, and *bank shots*, which bounce off a long rim of the table.

use crate::estimator::{FLOW_PER_SPEED, FLOW_TIME};
use crate::field::{Field, Vec2};
use crate::keeper::{Keeper, RecentPositions};
use crate::pendulum::Pendulum;
use crate::puck::{DRAG, Puck, Rim};
use crate::skills::aim::{normal_cdf, strike_towards};

/// Standard deviation of a shot's direction without air flow, radians.
const AIM_ERROR: f64 = 0.012;
/// Mean factor of a bounce on the slope of a path against the rim.
const SLOPE_RESTITUTION: f64 = 0.855;
/// Standard deviation of [`SLOPE_RESTITUTION`]: the time of contact within the millisecond is random.
const SLOPE_ERROR: f64 = 0.08;
/// Goal-line points (y) of straight shots in the task `hit`, where the opponent swings like a pendulum, metres.
const STRAIGHT_AIMS: [f64; 5] = [-0.05, -0.025, 0.0, 0.025, 0.05];
/// Goal-line points of straight shots in a game, where the opponent may stay in front of the centre, metres.
const GAME_STRAIGHT_AIMS: [f64; 9] = [
    -0.084, -0.063, -0.042, -0.021, 0.0, 0.021, 0.042, 0.063, 0.084,
];
/// Goal-line points of bank shots, metres.
const BANK_AIMS: [f64; 6] = [-0.09, -0.06, -0.03, 0.03, 0.06, 0.09];

/// Target of a shot on the goal line, and the path to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aim {
    /// y on the goal line, metres.
    pub y: f64,
    /// Long rim off which a bank shot bounces: the sign of the rim's y. 0 for a straight shot.
    pub rim_side: f64,
}

/// The aims to compare.
pub fn candidate_aims(keeper: &Keeper) -> Vec<Aim> {
    let straight = |y: &f64| Aim {
        y: *y,
        rim_side: 0.0,
    };
    match keeper {
        Keeper::Unseen | Keeper::Pendulum(_) => STRAIGHT_AIMS.iter().map(straight).collect(),
        Keeper::Opponent(_) => {
            let bank = BANK_AIMS
                .iter()
                .flat_map(|y| [-1.0, 1.0].map(|rim_side| Aim { y: *y, rim_side }));
            GAME_STRAIGHT_AIMS
                .iter()
                .map(straight)
                .chain(bank)
                .collect()
        }
    }
}

impl Aim {
    /// Initial direction (unit vector) of a puck without spin from `from`.
    pub fn direction(&self, field: &Field, from: Vec2) -> Vec2 {
        let distance_x = field.half_length - from.x;
        if self.rim_side == 0.0 {
            return Vec2::new(distance_x, self.y - from.y).normalize();
        }
        let before = (field.puck_y_max() - self.rim_side * from.y).max(0.0);
        let after = field.puck_y_max() - self.rim_side * self.y;
        Vec2::new(
            distance_x,
            self.rim_side * (before + after / SLOPE_RESTITUTION),
        )
        .normalize()
    }

    /// The contact normal with which a mallet of speed `speed` sends the puck to this aim, and the puck
    /// just after the strike.
    pub fn strike(&self, field: &Field, puck: &Puck, speed: f64) -> (Vec2, Puck) {
        let mut adjusted = *self;
        let mut result = strike_towards(
            puck,
            adjusted.direction(field, puck.pos),
            speed,
            field.contact_distance(),
        );
        if self.rim_side != 0.0 {
            // The struck puck spins, which the rim turns into a change of direction.
            for _ in 0..2 {
                let Some(y) = goal_line_y_after_bounce(field, result.1) else {
                    break;
                };
                adjusted.y += (self.y - y).clamp(-0.2, 0.2);
                result = strike_towards(
                    puck,
                    adjusted.direction(field, puck.pos),
                    speed,
                    field.contact_distance(),
                );
            }
        }
        result
    }
}

/// y at which a puck crosses the goal line after one bounce off a long rim.
fn goal_line_y_after_bounce(field: &Field, mut puck: Puck) -> Option<f64> {
    let (time, rim) = puck.next_rim(field)?;
    if rim != Rim::Long {
        return None;
    }
    puck.advance(field, 0.9999 * time);
    puck.bounce(rim);
    let distance_x = field.half_length - puck.pos.x;
    (puck.vel.x > 1e-3).then(|| puck.pos.y + distance_x * puck.vel.y / puck.vel.x)
}

/// Probability that a puck, struck at `time` seconds after the start, passes the keeper and enters the goal.
pub fn goal_chance(field: &Field, keeper: &Keeper, time: f64, struck: &Puck, aim: Aim) -> f64 {
    match keeper {
        Keeper::Opponent(recent) => chance_past_opponent(field, recent, struck, aim),
        Keeper::Unseen => straight_chance(field, None, time, struck, aim.y),
        Keeper::Pendulum(pendulum) => straight_chance(field, Some(pendulum), time, struck, aim.y),
    }
}

/// Standard deviation, metres, across a path of `length` metres that takes `flight` seconds. The air flow contributes the
/// double integral of its random, correlated acceleration, which is proportional to the speed; aiming
/// errors add to it.
fn spread_across(length: f64, flight: f64) -> f64 {
    let tau = FLOW_TIME;
    // The variance of the double integral at time `flight`, for an acceleration of unit variance and correlation time `tau`.
    let integral = 2.0 * tau * flight.powi(3) / 3.0 - (tau * flight).powi(2) + 2.0 * tau.powi(4)
        - 2.0 * tau.powi(3) * (flight + tau) * (-flight / tau).exp();
    (FLOW_PER_SPEED * length / flight * integral.max(0.0).sqrt()).hypot(AIM_ERROR * length)
}

/// Duration, seconds, of a path of `length` metres with an initial `speed` in m/s; `None` if the puck would barely arrive.
fn flight_time(length: f64, speed: f64) -> Option<f64> {
    let speed_loss = DRAG * length / speed.max(1e-3);
    (speed_loss <= 0.9).then(|| -(1.0 - speed_loss).ln() / DRAG)
}

/// Probability that a straight shot at `goal_y` enters the goal, past the swinging opponent if there is one.
fn straight_chance(
    field: &Field,
    pendulum: Option<&Pendulum>,
    time: f64,
    struck: &Puck,
    goal_y: f64,
) -> f64 {
    let length = (Vec2::new(field.half_length, goal_y) - struck.pos).norm();
    let Some(flight) = flight_time(length, struck.vel.norm()) else {
        return 0.0;
    };
    let spread = spread_across(length, flight);
    let chance_within = |low: f64, high: f64| probability_within(low, high, goal_y, spread);
    let half_opening = field.half_goal - 0.7 * field.puck_radius;
    let reaches_goal = chance_within(-half_opening, half_opening);
    let Some(pendulum) = pendulum else {
        return reaches_goal;
    };
    let passing_time = time + flight * (1.0 - (field.half_length - pendulum.x()) / length);
    let y = pendulum.y_at(passing_time);
    let blocked_half_width = field.contact_distance() + 0.005;
    reaches_goal
        - chance_within(
            (y - blocked_half_width).max(-half_opening),
            (y + blocked_half_width).min(half_opening),
        )
}

/// Probability that a normally distributed value is between `low` and `high`.
fn probability_within(low: f64, high: f64, mean: f64, deviation: f64) -> f64 {
    if high <= low {
        0.0
    } else {
        normal_cdf((high - mean) / deviation) - normal_cdf((low - mean) / deviation)
    }
}

/// Probability that a shot enters the goal past the opponent of a game.
fn chance_past_opponent(field: &Field, recent: &RecentPositions, struck: &Puck, aim: Aim) -> f64 {
    let goal = Vec2::new(field.half_length, aim.y);
    let from = struck.pos;
    // The path has one segment, or two that meet where the puck bounces off the rim. The last segment ends in the goal.
    let (bounce_point, first_length) = if aim.rim_side == 0.0 {
        (from, 0.0)
    } else {
        let before = (field.puck_y_max() - aim.rim_side * from.y).max(0.0);
        let after = (field.puck_y_max() - aim.rim_side * aim.y) / SLOPE_RESTITUTION;
        let x = from.x + (field.half_length - from.x) * before / (before + after);
        let bounce_point = Vec2::new(x, aim.rim_side * field.puck_y_max());
        (bounce_point, (bounce_point - from).norm())
    };
    let last_length = (goal - bounce_point).norm();
    let length = first_length + last_length;
    // A bounce costs about a fifth of the speed.
    let speed = struck.vel.norm()
        * if aim.rim_side == 0.0 {
            1.0
        } else {
            1.0 - 0.2 * last_length / length
        };
    let Some(flight) = flight_time(length, speed) else {
        return 0.0;
    };
    let heading = (goal - bounce_point) / last_length;
    let slope = (heading.y / heading.x).abs();
    let bounce_deviation = if aim.rim_side == 0.0 {
        0.0
    } else {
        SLOPE_ERROR * slope * (field.half_length - bounce_point.x)
    };
    let across = spread_across(length, flight) / heading.x.max(0.1);
    let spread = across.hypot(bounce_deviation);
    let half_opening = field.half_goal - 0.7 * field.puck_radius / heading.x.max(0.1);
    let reaches_goal = probability_within(-half_opening, half_opening, aim.y, spread);
    // The part of the goal line that the keeper covers, seen from the start of the last segment.
    let to_keeper = recent.pos - bounce_point;
    let distance = to_keeper.norm();
    let radius = field.contact_distance() + 0.004;
    // A keeper at the bounce point or behind it covers an unknown part: a rough guess.
    if distance <= radius || to_keeper.x <= 0.0 {
        return 0.5 * reaches_goal;
    }
    let middle = to_keeper.y.atan2(to_keeper.x);
    let half_angle = (radius / distance).asin();
    let on_line = |angle: f64| {
        let angle = angle.clamp(-1.5, 1.5);
        bounce_point.y + (field.half_length - bounce_point.x) * angle.tan()
    };
    let (low, high) = (on_line(middle - half_angle), on_line(middle + half_angle));
    let cover_deviation = recent.deviation() * (last_length / distance).max(1.0);
    let combined_deviation = spread.hypot(cover_deviation);
    let covered = probability_within(
        low.max(-half_opening),
        high.min(half_opening),
        aim.y,
        combined_deviation,
    );
    let first_segment_blocked = if first_length > 0.0 {
        let to_opponent = recent.pos - from;
        let heading = (bounce_point - from) / first_length;
        let along = to_opponent.dot(&heading).clamp(0.0, first_length);
        let miss = (to_opponent - along * heading).norm();
        let deviation = (AIM_ERROR * along).hypot(recent.deviation()).max(1e-3);
        probability_within(-radius, radius, miss, deviation)
    } else {
        0.0
    };
    (reaches_goal - covered).max(0.0) * (1.0 - first_segment_blocked)
}
