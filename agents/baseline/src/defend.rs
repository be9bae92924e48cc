//! Stops an incoming puck: the mallet waits at the point where the puck crosses a line in front of the goal.

use striker::arm::Posture;
use striker::field::Vec2;
use striker::motion::Target;
use striker::scene::{MalletCommand, Scene};

use crate::guard::guard;

/// x of the line at which the puck is intercepted, metres.
const INTERCEPTION_X: f64 = -0.56;
/// Prediction horizon for the crossing, seconds.
const HORIZON: f64 = 2.0;
/// A plan whose contact is nearer than this is not changed any more, seconds.
const LAST_CORRECTION: f64 = 0.6;
/// Speed of the mallet's retreat as a share of the puck's speed. 0: this agent does not cushion the contact, unlike `striker`.
const RETREAT_SHARE: f64 = 0.0;

#[derive(Debug, Clone, Copy)]
struct Interception {
    /// Time of the contact, seconds since the episode's start.
    time: f64,
    /// Position of the mallet at contact.
    mallet: Vec2,
    /// Velocity of the mallet at contact.
    velocity: Vec2,
}

#[derive(Debug, Clone)]
pub struct Defend {
    interception: Option<Interception>,
}

impl Defend {
    pub fn new() -> Self {
        Self { interception: None }
    }

    /// The command for this control step.
    pub fn decide(&mut self, scene: &Scene<'_>) -> MalletCommand {
        // From the last correction until shortly after the contact the plan is fixed.
        let fixed_plan = self.interception.filter(|plan| {
            plan.time - scene.time < LAST_CORRECTION && plan.time - scene.time > -0.06
        });
        self.interception = fixed_plan.or_else(|| find_crossing(scene));
        let Some(plan) = self.interception else {
            return guard(scene);
        };
        let time_left = plan.time - scene.time;
        if time_left < 0.5 * scene.dt {
            return MalletCommand::coast(scene, plan.velocity, Posture::Any);
        }
        MalletCommand::new(
            Target {
                pos: plan.mallet,
                vel: plan.velocity,
                time: time_left,
            },
            Posture::Any,
        )
    }
}

/// The interception where the puck will cross the line at [`INTERCEPTION_X`]; `None` if it does not.
fn find_crossing(scene: &Scene<'_>) -> Option<Interception> {
    let mut puck = scene.puck;
    let mut time_left = 0.0;
    while time_left < HORIZON {
        if !puck.advance(scene.field, scene.dt) {
            return None;
        }
        time_left += scene.dt;
        if puck.pos.x < INTERCEPTION_X + scene.field.contact_distance() {
            let speed = puck.vel.norm();
            let mallet = puck.pos + scene.field.contact_distance() * puck.vel / speed.max(1e-3);
            return Some(Interception {
                time: scene.time + time_left,
                mallet: scene.field.clamp_mallet(mallet),
                velocity: RETREAT_SHARE * puck.vel,
            });
        }
    }
    None
}
