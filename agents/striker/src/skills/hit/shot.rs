//! Shots at the opponent's goal, straight or by a long rim, and their chance of a goal.

use crate::estimator::{FLOW_PER_SPEED, FLOW_TIME};
use crate::field::{Field, Vec2};
use crate::keeper::{Keeper, Rival};
use crate::opponent::Opponent;
use crate::puck::{DRAG, Puck, Rim};
use crate::skills::aim::{normal_cdf, strike_towards};

/// Standard deviation of a shot's direction without air flow, radians.
const AIM_ERROR: f64 = 0.012;
/// Mean factor of a bounce on the slope of a path against the rim.
const SLOPE_RESTITUTION: f64 = 0.855;
/// Standard deviation of that factor: the time of contact within the millisecond is random.
const SLOPE_ERROR: f64 = 0.08;
/// Goal-line points of straight shots against the pendulum of `hit`, metres.
const AIMS: [f64; 5] = [-0.05, -0.025, 0.0, 0.025, 0.05];
/// Goal-line points of straight shots in a game, where the opponent may stay in front of the centre, metres.
const GAME_AIMS: [f64; 9] = [
    -0.084, -0.063, -0.042, -0.021, 0.0, 0.021, 0.042, 0.063, 0.084,
];
/// Goal-line points of shots by a rim, metres.
const BANK_AIMS: [f64; 6] = [-0.09, -0.06, -0.03, 0.03, 0.06, 0.09];

/// Target of a shot on the goal line, and the way there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aim {
    /// y on the goal line, metres.
    pub y: f64,
    /// Sign of y of the long rim for a bank shot; 0 for a straight shot.
    pub via: f64,
}

/// The aims to compare.
pub fn candidate_aims(keeper: &Keeper) -> Vec<Aim> {
    let straight = |y: &f64| Aim { y: *y, via: 0.0 };
    match keeper {
        Keeper::Unseen | Keeper::Pendulum(_) => AIMS.iter().map(straight).collect(),
        Keeper::Rival(_) => {
            let bank = BANK_AIMS
                .iter()
                .flat_map(|y| [-1.0, 1.0].map(|via| Aim { y: *y, via }));
            GAME_AIMS.iter().map(straight).chain(bank).collect()
        }
    }
}

impl Aim {
    /// Initial direction (unit vector) of a puck without spin from `from`.
    pub fn direction(&self, field: &Field, from: Vec2) -> Vec2 {
        let way = field.half_length - from.x;
        if self.via == 0.0 {
            return Vec2::new(way, self.y - from.y).normalize();
        }
        let before = (field.puck_y() - self.via * from.y).max(0.0);
        let after = field.puck_y() - self.via * self.y;
        Vec2::new(way, self.via * (before + after / SLOPE_RESTITUTION)).normalize()
    }

    /// The contact normal with which a mallet of speed `speed` sends the puck to this aim, and the puck
    /// just after the strike.
    pub fn strike(&self, field: &Field, puck: &Puck, speed: f64) -> (Vec2, Puck) {
        let mut adjusted = *self;
        let mut result = strike_towards(
            puck,
            adjusted.direction(field, puck.pos),
            speed,
            field.contact(),
        );
        if self.via != 0.0 {
            // The struck puck spins, which the rim turns into a change of direction.
            for _ in 0..2 {
                let Some(y) = arrival(field, result.1) else {
                    break;
                };
                adjusted.y += (self.y - y).clamp(-0.2, 0.2);
                result = strike_towards(
                    puck,
                    adjusted.direction(field, puck.pos),
                    speed,
                    field.contact(),
                );
            }
        }
        result
    }
}

/// y at which a puck crosses the goal line after one bounce off a long rim.
fn arrival(field: &Field, mut puck: Puck) -> Option<f64> {
    let (time, rim) = puck.next_rim(field)?;
    if rim != Rim::Long {
        return None;
    }
    puck.advance(field, 0.9999 * time);
    puck.bounce(rim);
    let way = field.half_length - puck.pos.x;
    (puck.vel.x > 1e-3).then(|| puck.pos.y + way * puck.vel.y / puck.vel.x)
}

/// Probability that a puck struck at `time` passes the keeper and enters the goal.
pub fn goal_chance(field: &Field, keeper: &Keeper, time: f64, struck: &Puck, aim: Aim) -> f64 {
    match keeper {
        Keeper::Rival(rival) => chance_past_rival(field, rival, struck, aim),
        Keeper::Unseen => straight_chance(field, None, time, struck, aim.y),
        Keeper::Pendulum(opponent) => straight_chance(field, Some(opponent), time, struck, aim.y),
    }
}

/// Standard deviation across a path of `length` with duration `flight`. The air flow contributes the
/// double integral of its random, correlated acceleration, which is proportional to the speed; aiming
/// errors add to it.
fn spread_across(length: f64, flight: f64) -> f64 {
    let tau = FLOW_TIME;
    let integral = 2.0 * tau * flight.powi(3) / 3.0 - (tau * flight).powi(2) + 2.0 * tau.powi(4)
        - 2.0 * tau.powi(3) * (flight + tau) * (-flight / tau).exp();
    (FLOW_PER_SPEED * length / flight * integral.max(0.0).sqrt()).hypot(AIM_ERROR * length)
}

/// Duration of a path of `length` with initial `speed`; `None` if the puck would barely arrive.
fn flight(length: f64, speed: f64) -> Option<f64> {
    let share = DRAG * length / speed.max(1e-3);
    (share <= 0.9).then(|| -(1.0 - share).ln() / DRAG)
}

fn straight_chance(
    field: &Field,
    opponent: Option<&Opponent>,
    time: f64,
    struck: &Puck,
    aim: f64,
) -> f64 {
    let length = (Vec2::new(field.half_length, aim) - struck.pos).norm();
    let Some(flight) = flight(length, struck.vel.norm()) else {
        return 0.0;
    };
    let spread = spread_across(length, flight);
    let within = |lo: f64, hi: f64| probability_within(lo, hi, aim, spread);
    let half = field.half_goal - 0.7 * field.puck;
    let open = within(-half, half);
    let Some(opponent) = opponent else {
        return open;
    };
    let arrival = time + flight * (1.0 - (field.half_length - opponent.x()) / length);
    let y = opponent.y_at(arrival);
    let block = field.contact() + 0.005;
    open - within((y - block).max(-half), (y + block).min(half))
}

/// Probability of a value between `lo` and `hi`.
fn probability_within(lo: f64, hi: f64, mean: f64, deviation: f64) -> f64 {
    if hi <= lo {
        0.0
    } else {
        normal_cdf((hi - mean) / deviation) - normal_cdf((lo - mean) / deviation)
    }
}

fn chance_past_rival(field: &Field, rival: &Rival, struck: &Puck, aim: Aim) -> f64 {
    let goal = Vec2::new(field.half_length, aim.y);
    let from = struck.pos;
    // The last segment starts at the puck or where it leaves the rim.
    let (corner, first) = if aim.via == 0.0 {
        (from, 0.0)
    } else {
        let before = (field.puck_y() - aim.via * from.y).max(0.0);
        let after = (field.puck_y() - aim.via * aim.y) / SLOPE_RESTITUTION;
        let x = from.x + (field.half_length - from.x) * before / (before + after);
        let corner = Vec2::new(x, aim.via * field.puck_y());
        (corner, (corner - from).norm())
    };
    let last = (goal - corner).norm();
    let length = first + last;
    // A bounce costs about a fifth of the speed.
    let speed = struck.vel.norm()
        * if aim.via == 0.0 {
            1.0
        } else {
            1.0 - 0.2 * last / length
        };
    let Some(flight) = flight(length, speed) else {
        return 0.0;
    };
    let heading = (goal - corner) / last;
    let slope = (heading.y / heading.x).abs();
    let bounce = if aim.via == 0.0 {
        0.0
    } else {
        SLOPE_ERROR * slope * (field.half_length - corner.x)
    };
    let across = spread_across(length, flight) / heading.x.max(0.1);
    let spread = across.hypot(bounce);
    let half = field.half_goal - 0.7 * field.puck / heading.x.max(0.1);
    let open = probability_within(-half, half, aim.y, spread);
    // The keeper's shadow on the goal line, seen from the start of the last segment.
    let way = rival.pos - corner;
    let distance = way.norm();
    let radius = field.contact() + 0.004;
    if distance <= radius || way.x <= 0.0 {
        return 0.5 * open;
    }
    let middle = way.y.atan2(way.x);
    let half_angle = (radius / distance).asin();
    let on_line = |angle: f64| {
        let angle = angle.clamp(-1.5, 1.5);
        corner.y + (field.half_length - corner.x) * angle.tan()
    };
    let (lo, hi) = (on_line(middle - half_angle), on_line(middle + half_angle));
    let shadow_deviation = rival.deviation() * (last / distance).max(1.0);
    let blurred = spread.hypot(shadow_deviation);
    let stopped = probability_within(lo.max(-half), hi.min(half), aim.y, blurred);
    let first_hit = if first > 0.0 {
        let to_rival = rival.pos - from;
        let heading = (corner - from) / first;
        let along = to_rival.dot(&heading).clamp(0.0, first);
        let miss = (to_rival - along * heading).norm();
        let deviation = (AIM_ERROR * along).hypot(rival.deviation()).max(1e-3);
        probability_within(-radius, radius, miss, deviation)
    } else {
        0.0
    };
    (open - stopped).max(0.0) * (1.0 - first_hit)
}
