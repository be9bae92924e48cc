//! A game as it is told to those who watch: everything that happens, and where things are, now and then.

use super::report::{GameObserver, GameReport};
use faceoff_episode::{Entry, GameStepRow, RallyEnding, RallyRow, RallyStart};
use faceoff_sim::{GameState, RallyEnd, table::frames::table_from_robot};
use faceoff_types::{GameHappening, LiveHappening, LivePosition, Side};
use std::time::{Duration, Instant};

/// How often positions are told: what an eye still takes for a motion, and not so often that telling costs time.
pub const POSITION_EVERY: Duration = Duration::from_millis(100);

/// Who hears of a game as it is played, and can stop it.
pub trait GameAudience {
    /// What happened since the last call, at once; where things are by now, when something happened and otherwise
    /// as often as [`POSITION_EVERY`] says. The game waits meanwhile.
    fn hear(&mut self, happenings: Vec<LiveHappening>, position: LivePosition);
    /// As [`GameObserver::cancelled`].
    fn cancelled(&self) -> bool;
}

/// Tells an audience of a game.
pub struct Commentary<'a> {
    audience: &'a mut dyn GameAudience,
    position_every: Duration,
    told_at: Option<Instant>,
    /// Control steps that the game had played when the rally began.
    rally_begun_at: u32,
    faults: [u32; 2],
    last: LivePosition,
}

impl<'a> Commentary<'a> {
    /// Before the game; `position_every` is [`POSITION_EVERY`] but for tests.
    pub fn new(audience: &'a mut dyn GameAudience, position_every: Duration) -> Self {
        Self {
            audience,
            position_every,
            told_at: None,
            rally_begun_at: 0,
            faults: [0; 2],
            last: LivePosition {
                step: 0,
                puck: [0.0; 3],
                mallets: [[0.0; 2]; 2],
            },
        }
    }

    /// Tells how the game ended.
    pub fn end(mut self, report: &GameReport) {
        let score = &report.archives.score;
        let [first, second] = &score.sides;
        let ended = GameHappening::Ended {
            score: [first.score, second.score],
            winner: score.winner.map(|side| Side::BOTH[side as usize]),
            forfeits: [first.forfeit, second.forfeit],
        };
        self.tell(vec![LiveHappening {
            step: score.steps,
            what: ended,
        }]);
    }

    fn tell(&mut self, happenings: Vec<LiveHappening>) {
        self.audience.hear(happenings, self.last);
        self.told_at = Some(Instant::now());
    }
}

impl GameObserver for Commentary<'_> {
    fn rally_begun(&mut self, start: &RallyStart<'_>) {
        self.rally_begun_at = start.game_step;
        self.last = position(start.game_step, start.state);
        let restarted = Side::BOTH
            .into_iter()
            .zip(start.entries)
            .filter(|(_, entry)| start.rally > 0 && has_started(entry))
            .map(|(side, _)| GameHappening::Restarted { side });
        let begun = GameHappening::RallyBegun {
            rally: start.rally,
            serves: start.serves,
        };
        let step = start.game_step;
        let all = restarted.chain([begun]);
        self.tell(all.map(|what| LiveHappening { step, what }).collect());
    }

    fn stepped(&mut self, row: &GameStepRow<'_>) {
        self.last = position(row.game_step + 1, row.state);
        let is_due = self
            .told_at
            .is_none_or(|told_at| told_at.elapsed() >= self.position_every);
        if is_due {
            self.tell(Vec::new());
        }
    }

    fn rally_over(&mut self, row: &RallyRow<'_>) {
        let step = self.rally_begun_at + row.steps;
        let mut all = Vec::new();
        for (side, fault) in Side::BOTH.into_iter().zip(row.faults) {
            if let Some(fault) = fault {
                let count = &mut self.faults[side.index()];
                *count += 1;
                all.push(LiveHappening {
                    step: self.rally_begun_at + fault.step.unwrap_or(0),
                    what: GameHappening::Fault {
                        side,
                        count: *count,
                    },
                });
            }
        }
        let what = what_ended(row);
        all.extend(what.map(|what| LiveHappening { step, what }));
        self.tell(all);
    }

    fn cancelled(&self) -> bool {
        self.audience.cancelled()
    }
}

/// Did the agent start for this rally?
const fn has_started(entry: &Entry) -> bool {
    matches!(
        entry,
        Entry::Plays {
            startup_s: Some(_),
            ..
        } | Entry::FailedToReset {
            startup_s: Some(_),
            ..
        }
    )
}

/// None of a rally that the game's end ended: that is told by itself.
fn what_ended(row: &RallyRow<'_>) -> Option<GameHappening> {
    let score = row.score;
    Some(match row.ending {
        RallyEnding::Table(RallyEnd::Goal { by }) => GameHappening::Goal {
            by: Side::BOTH[by],
            score,
        },
        RallyEnding::Table(RallyEnd::Foul { by }) => GameHappening::Foul {
            by: Side::BOTH[by],
            score,
        },
        RallyEnding::Table(RallyEnd::Stuck) => GameHappening::Stuck,
        RallyEnding::Table(RallyEnd::LeftTable) => GameHappening::LeftTable,
        RallyEnding::Table(RallyEnd::Diverged { .. }) => GameHappening::Diverged,
        RallyEnding::GameOver => return None,
    })
}

fn position(step: u32, state: &GameState) -> LivePosition {
    let [x, y, yaw, ..] = state.puck;
    LivePosition {
        step,
        puck: [x, y, yaw],
        mallets: [0, 1].map(|robot| {
            let [x, y, _] = table_from_robot(robot, state.ee[robot]);
            [x, y]
        }),
    }
}
