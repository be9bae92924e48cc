//! The referee of a game: it decides how a rally ends, and counts goals and fouls (`docs/rules.md`, "Tournament"). A *rally* lasts from a
//! serve to a goal, a foul or another end.

use crate::{
    model::CONTROL_STEP_S,
    table::{geometry::TABLE, puck::Puck},
};
use faceoff_types::FOULS_PER_POINT;

/// Numbers of the game's rules, table frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GameRules {
    /// Range of the puck's |x| at the start of a rally, m.
    pub start_x_m: [f64; 2],
    /// A puck that stays longer than this on one side is a foul, s.
    pub foul_after_s: f64,
    /// Half the width of the middle strip, m: a puck with a smaller |x| is no foul, but can be stuck.
    pub middle_x_m: f64,
    /// A puck in the middle strip is stuck below this |vx|, m/s.
    pub stuck_vx_m_s: f64,
    /// A faster puck counts as having left the table, m/s.
    pub lost_speed_m_s: f64,
}

/// The rules of the current ruleset.
pub const GAME_RULES: GameRules = GameRules {
    start_x_m: [0.2, 0.7],
    foul_after_s: 15.0,
    middle_x_m: 0.15,
    stuck_vx_m_s: 0.025,
    lost_speed_m_s: 100.0,
};

/// `GAME_RULES.foul_after_s` in control steps.
const FOUL_STEPS: u32 = (GAME_RULES.foul_after_s / CONTROL_STEP_S + 0.5) as u32;

/// Reason why a rally ended. Robots are 0 and 1. The `Debug` text is part of the golden hashes, so names cannot change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RallyEnd {
    /// The puck passed a goal line.
    Goal {
        /// The robot that scores, on the other side.
        by: usize,
    },
    /// The puck stayed too long on a robot's side.
    Foul {
        /// The robot on whose side it stayed.
        by: usize,
    },
    /// The puck stopped in the middle, where no robot reaches it.
    Stuck,
    /// The puck left the table beside the goals.
    LeftTable,
    /// The world diverged: its state would have left the bounds of the simulation. That is a fault of a robot's agent and changes no score.
    /// The next rally starts on the same side.
    Diverged {
        /// For each robot: was its command or state the first to leave the bounds?
        by: [bool; 2],
    },
}

/// Counts goals and fouls of a game, and decides on which side the next rally starts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Referee {
    /// Goals scored by each robot, without points for fouls.
    pub goals: [u32; 2],
    /// Fouls of each robot.
    pub fouls: [u32; 2],
    /// The robot on whose side the next rally starts.
    pub serving_robot: usize,
    /// The robot on whose side the puck is, and for how many control steps; `None` before a rally's first
    /// step.
    pub puck_side: Option<(usize, u32)>,
}

impl Referee {
    /// The referee at the start of a game, whose first rally starts on the side of the robot `serving_robot`.
    #[must_use]
    pub fn new(serving_robot: usize) -> Self {
        Self {
            goals: [0; 2],
            fouls: [0; 2],
            serving_robot,
            puck_side: None,
        }
    }

    /// Each robot's goals plus its points for the opponent's fouls.
    #[must_use]
    pub fn score(&self) -> [u32; 2] {
        [0, 1].map(|robot| self.goals[robot] + self.fouls[1 - robot] / FOULS_PER_POINT)
    }

    /// Decides whether the true state of the puck after a control step ends the rally, and counts the end.
    pub fn judge(&mut self, puck: &Puck) -> Option<RallyEnd> {
        let end = self.rally_end(puck)?;
        self.record_end(end);
        Some(end)
    }

    /// Counts the end of a rally, sets the side of the next one, and resets the time that the puck has been on a side.
    pub(super) fn record_end(&mut self, end: RallyEnd) {
        self.puck_side = None;
        match end {
            RallyEnd::Goal { by } => {
                self.goals[by] += 1;
                self.serving_robot = 1 - by;
            }
            RallyEnd::Foul { by } => {
                self.fouls[by] += 1;
                self.serving_robot = 1 - by;
            }
            RallyEnd::Stuck | RallyEnd::LeftTable | RallyEnd::Diverged { .. } => {}
        }
    }

    /// How the rally ends, if the puck's state ends it. Also counts how long the puck has been on its side.
    fn rally_end(&mut self, puck: &Puck) -> Option<RallyEnd> {
        let [x, y, _] = puck.pose;
        let side_of_puck = usize::from(x > 0.0);
        let steps = match self.puck_side {
            Some((side, steps)) if side == side_of_puck => steps + 1,
            _ => 0,
        };
        self.puck_side = Some((side_of_puck, steps));
        let is_in_middle = x.abs() < GAME_RULES.middle_x_m;
        if steps > FOUL_STEPS && !is_in_middle {
            return Some(RallyEnd::Foul { by: side_of_puck });
        }
        if x.abs() > TABLE.half_length_m() && y.abs() <= TABLE.goal_width_m / 2.0 {
            return Some(RallyEnd::Goal {
                by: 1 - side_of_puck,
            });
        }
        if is_in_middle && puck.velocity[0].abs() < GAME_RULES.stuck_vx_m_s {
            return Some(RallyEnd::Stuck);
        }
        // Negated, so that NaN ends the rally too.
        let is_on_table = x.abs() <= TABLE.half_length_m()
            && y.abs() <= TABLE.half_width_m()
            && puck.speed() <= GAME_RULES.lost_speed_m_s;
        (!is_on_table).then_some(RallyEnd::LeftTable)
    }
}
