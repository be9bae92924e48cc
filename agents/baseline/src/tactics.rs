//! Chooses the skill for each control step: wait, defend the goal, hit the puck, or *prepare* it, which is to move it off the table's rim.

use striker::Task;
use striker::scene::{MalletCommand, Scene};

use crate::defend::Defend;
use crate::guard::guard;
use crate::hit::Hit;
use crate::prepare::Prepare;

/// A puck approaching faster than this is stopped, m/s.
const INCOMING_SPEED: f64 = 0.35;
/// A puck slower than this can be struck, m/s.
const STRIKEABLE_SPEED: f64 = 0.3;
/// Beyond this |y| a puck is too close to the rim for a shot, metres.
const SHOT_Y_MAX: f64 = 0.38;
/// Beyond this x a puck is out of reach, metres.
const REACH_X_MAX: f64 = -0.16;
/// Below this x, near the own goal, a run-up does not fit behind the puck, metres.
const SHOT_X_MIN: f64 = -0.78;

/// The active skill.
#[derive(Debug, Clone)]
enum Skill {
    /// No skill: the mallet waits in front of the goal.
    Wait,
    Defend(Defend),
    Hit(Hit),
    Prepare(Prepare),
}

/// State of the decisions in an episode or rally.
#[derive(Debug, Clone)]
pub struct Tactics {
    task: Task,
    skill: Skill,
}

impl Tactics {
    pub fn new(task: Task) -> Self {
        Self {
            task,
            skill: Skill::Wait,
        }
    }

    /// The command for this control step.
    pub fn decide(&mut self, scene: &Scene<'_>) -> MalletCommand {
        let is_busy = match &self.skill {
            Skill::Hit(hit) => hit.is_committed(),
            Skill::Prepare(prepare) => prepare.is_committed(),
            Skill::Wait | Skill::Defend(_) => false,
        };
        if !is_busy {
            self.choose(scene);
        }
        match &mut self.skill {
            Skill::Wait => guard(scene),
            Skill::Defend(defend) => defend.decide(scene),
            Skill::Hit(hit) => hit.decide(scene),
            Skill::Prepare(prepare) => prepare.decide(scene),
        }
    }

    /// Continues with the present skill if it is still suitable, or begins another.
    fn choose(&mut self, scene: &Scene<'_>) {
        let puck = &scene.puck;
        let is_near_rim = puck.pos.y.abs() > SHOT_Y_MAX || puck.pos.x < SHOT_X_MIN;
        let is_strikeable = puck.vel.norm() < STRIKEABLE_SPEED && puck.pos.x < REACH_X_MAX;
        match self.task {
            Task::Defend => self.begin_defend(),
            Task::Prepare => self.begin_prepare(),
            Task::Hit | Task::Tournament if puck.vel.x < -INCOMING_SPEED => self.begin_defend(),
            Task::Hit | Task::Tournament if is_strikeable && is_near_rim => self.begin_prepare(),
            Task::Hit | Task::Tournament if is_strikeable => {
                if !matches!(self.skill, Skill::Hit(_)) {
                    self.skill = Skill::Hit(Hit::new());
                }
            }
            Task::Hit | Task::Tournament => self.skill = Skill::Wait,
        }
    }

    fn begin_defend(&mut self) {
        if !matches!(self.skill, Skill::Defend(_)) {
            self.skill = Skill::Defend(Defend::new());
        }
    }

    fn begin_prepare(&mut self) {
        if !matches!(self.skill, Skill::Prepare(_)) {
            self.skill = Skill::Prepare(Prepare::new());
        }
    }
}
