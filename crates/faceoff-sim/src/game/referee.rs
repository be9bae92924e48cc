//! Goals, fouls and stuck pucks (RULES, "Tournament").

use crate::{
    model::CONTROL_STEP_S,
    table::{geometry::TABLE, puck::Puck},
};
use faceoff_types::FOULS_PER_POINT;

/// Numbers of the game's rules, table frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GameRules {
    /// Range of |x| at the start of a rally, m.
    pub start_x_m: [f64; 2],
    /// A puck that stays longer on one side is a foul, s.
    pub foul_after_s: f64,
    /// |x| of the middle, m: no fouls there, but a puck can be stuck.
    pub middle_x_m: f64,
    /// A puck in the middle is stuck below this |vx|, m/s.
    pub stuck_vx_m_s: f64,
    /// A faster puck counts as lost, m/s.
    pub lost_speed_m_s: f64,
}

pub const GAME_RULES: GameRules = GameRules {
    start_x_m: [0.2, 0.7],
    foul_after_s: 15.0,
    middle_x_m: 0.15,
    stuck_vx_m_s: 0.025,
    lost_speed_m_s: 100.0,
};

/// Control steps after which a puck on one side is a foul.
const FOUL_STEPS: u32 = (GAME_RULES.foul_after_s / CONTROL_STEP_S + 0.5) as u32;

/// Reason why a rally ended. Robots are 0 and 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RallyEnd {
    /// The puck passed the goal line of the other robot.
    Goal {
        /// The robot that scores.
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
    /// The world diverged: a fault, which changes no score. The rally is repeated on the same side.
    Diverged {
        /// The robots whose commands or states left their bounds first.
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
    pub serves: usize,
    /// The robot on whose side the puck is, and for how many control steps; `None` before a rally's first
    /// step.
    pub puck_side: Option<(usize, u32)>,
}

impl Referee {
    /// At the start of a game.
    #[must_use]
    pub fn new(serves: usize) -> Self {
        Self {
            goals: [0; 2],
            fouls: [0; 2],
            serves,
            puck_side: None,
        }
    }

    /// Goals plus the points for the opponent's fouls.
    #[must_use]
    pub fn score(&self) -> [u32; 2] {
        [0, 1].map(|robot| self.goals[robot] + self.fouls[1 - robot] / FOULS_PER_POINT)
    }

    /// Judges the true puck after a control step. An end sets the next serving side and resets the clock.
    pub fn judge(&mut self, puck: &Puck) -> Option<RallyEnd> {
        let end = self.rally_end(puck)?;
        self.record_end(end);
        Some(end)
    }

    /// Counts a rally's end.
    pub(super) fn record_end(&mut self, end: RallyEnd) {
        self.puck_side = None;
        match end {
            RallyEnd::Goal { by } => {
                self.goals[by] += 1;
                self.serves = 1 - by;
            }
            RallyEnd::Foul { by } => {
                self.fouls[by] += 1;
                self.serves = 1 - by;
            }
            RallyEnd::Stuck | RallyEnd::LeftTable | RallyEnd::Diverged { .. } => {}
        }
    }

    fn rally_end(&mut self, puck: &Puck) -> Option<RallyEnd> {
        let [x, y, _] = puck.pose;
        let side_of_puck = usize::from(x > 0.0);
        let steps = match self.puck_side {
            Some((side, steps)) if side == side_of_puck => steps + 1,
            _ => 0,
        };
        self.puck_side = Some((side_of_puck, steps));
        let in_middle = x.abs() < GAME_RULES.middle_x_m;
        if steps > FOUL_STEPS && !in_middle {
            return Some(RallyEnd::Foul { by: side_of_puck });
        }
        if x.abs() > TABLE.half_length_m() && y.abs() <= TABLE.goal_width_m / 2.0 {
            return Some(RallyEnd::Goal {
                by: 1 - side_of_puck,
            });
        }
        if in_middle && puck.velocity[0].abs() < GAME_RULES.stuck_vx_m_s {
            return Some(RallyEnd::Stuck);
        }
        // Negated, so that NaN ends the rally too.
        let on_table = x.abs() <= TABLE.half_length_m()
            && y.abs() <= TABLE.half_width_m()
            && puck.speed() <= GAME_RULES.lost_speed_m_s;
        (!on_table).then_some(RallyEnd::LeftTable)
    }
}
