//! Chooses the skill for each control step.

use striker::Task;
use striker::scene::{MalletCommand, Scene};

use crate::defend::Defend;
use crate::guard::guard;
use crate::hit::Hit;
use crate::prepare::Prepare;

/// A puck approaching faster than this is stopped, m/s.
const INCOMING: f64 = 0.35;
/// A puck slower than this can be struck, m/s.
const SLOW: f64 = 0.3;
/// Beyond this |y| a puck is too close to the rim for a shot, metres.
const NEAR_RIM: f64 = 0.38;
/// Beyond this x a puck is out of reach, metres.
const OUT_OF_REACH: f64 = -0.16;
/// Behind this x a run-up does not fit, metres.
const NEAR_END: f64 = -0.78;

/// The active skill.
#[derive(Debug, Clone)]
enum Skill {
    Wait,
    Defend(Defend),
    Hit(Hit),
    Prepare(Prepare),
}

/// State of an episode or rally.
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
        let cornered = puck.pos.y.abs() > NEAR_RIM || puck.pos.x < NEAR_END;
        let strikeable = puck.vel.norm() < SLOW && puck.pos.x < OUT_OF_REACH;
        match self.task {
            Task::Defend => self.begin_defend(),
            Task::Prepare => self.begin_prepare(),
            Task::Hit | Task::Tournament if puck.vel.x < -INCOMING => self.begin_defend(),
            Task::Hit | Task::Tournament if strikeable && cornered => self.begin_prepare(),
            Task::Hit | Task::Tournament if strikeable => {
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
