//! Live feed of a game for viewers: all events, and positions at intervals. A game consists of *rallies*, each from a
//! serve to a goal, a foul or another end.

use super::report::{GameObserver, GameReport};
use faceoff_airhockey::{GameStepRow, RallyEnding, RallyReadiness, RallyRow, RallyStart};
use faceoff_sim::{GameState, RallyEnd, table::frames::table_from_robot};
use faceoff_types::{GameEvent, LiveEvent, LivePosition, Side};
use std::time::{Duration, Instant};

/// Interval of positions: short enough to look like motion, long enough to cost little time.
pub const POSITION_INTERVAL: Duration = Duration::from_millis(100);

/// Receives the live feed of a running game, and can stop the game.
pub trait LiveFeedSink {
    /// Receives the events since the last call, immediately, and the current positions. Without events it is called
    /// at the interval [`POSITION_INTERVAL`]. The game waits for the call.
    fn receive(&mut self, events: Vec<LiveEvent>, position: LivePosition);
    /// Should the game stop? See [`GameObserver::cancelled`].
    fn cancelled(&self) -> bool;
}

/// Sends the events of a game to a sink.
pub struct LiveFeed<'a> {
    sink: &'a mut dyn LiveFeedSink,
    position_interval: Duration,
    last_sent_at: Option<Instant>,
    /// Control step of the game at which the rally began.
    rally_start_step: u32,
    /// Number of faults of each side so far.
    faults: [u32; 2],
    last_position: LivePosition,
}

impl<'a> LiveFeed<'a> {
    /// Starts before the game; `position_interval` is [`POSITION_INTERVAL`] except in tests.
    pub fn new(sink: &'a mut dyn LiveFeedSink, position_interval: Duration) -> Self {
        Self {
            sink,
            position_interval,
            last_sent_at: None,
            rally_start_step: 0,
            faults: [0; 2],
            last_position: LivePosition {
                step: 0,
                puck: [0.0; 3],
                mallets: [[0.0; 2]; 2],
            },
        }
    }

    /// Sends the result of the game.
    pub fn end(mut self, report: &GameReport) {
        let score = &report.archives.score;
        let [first, second] = &score.sides;
        let ended = GameEvent::Ended {
            score: [first.score, second.score],
            winner: score.winner.map(|side| Side::BOTH[side as usize]),
            forfeits: [first.forfeit, second.forfeit],
        };
        self.send(vec![LiveEvent {
            step: score.steps,
            event: ended,
        }]);
    }

    fn send(&mut self, events: Vec<LiveEvent>) {
        self.sink.receive(events, self.last_position);
        self.last_sent_at = Some(Instant::now());
    }
}

impl GameObserver for LiveFeed<'_> {
    fn on_rally_start(&mut self, start: &RallyStart<'_>) {
        self.rally_start_step = start.game_step;
        self.last_position = position(start.game_step, start.state);
        let restarted = Side::BOTH
            .into_iter()
            .zip(start.readiness)
            .filter(|(_, readiness)| start.rally > 0 && has_started(readiness))
            .map(|(side, _)| GameEvent::Restarted { side });
        let rally_begun = GameEvent::RallyBegun {
            rally: start.rally,
            serves: start.serving_side,
        };
        let step = start.game_step;
        let events = restarted.chain([rally_begun]);
        self.send(events.map(|event| LiveEvent { step, event }).collect());
    }

    fn on_step(&mut self, row: &GameStepRow<'_>) {
        self.last_position = position(row.game_step + 1, row.state);
        let is_due = self
            .last_sent_at
            .is_none_or(|last_sent_at| last_sent_at.elapsed() >= self.position_interval);
        if is_due {
            self.send(Vec::new());
        }
    }

    fn on_rally_end(&mut self, row: &RallyRow<'_>) {
        let step = self.rally_start_step + row.steps;
        let mut events = Vec::new();
        for (side, fault) in Side::BOTH.into_iter().zip(row.faults) {
            if let Some(fault) = fault {
                let count = &mut self.faults[side.index()];
                *count += 1;
                events.push(LiveEvent {
                    step: self.rally_start_step + fault.step.unwrap_or(0),
                    event: GameEvent::Fault {
                        side,
                        count: *count,
                    },
                });
            }
        }
        let event = ending_event(row);
        events.extend(event.map(|event| LiveEvent { step, event }));
        self.send(events);
    }

    fn cancelled(&self) -> bool {
        self.sink.cancelled()
    }
}

/// Was the agent's process started for this rally?
const fn has_started(readiness: &RallyReadiness) -> bool {
    matches!(
        readiness,
        RallyReadiness::Ready {
            startup_s: Some(_),
            ..
        } | RallyReadiness::ResetFailed {
            startup_s: Some(_),
            ..
        }
    )
}

/// The event of a rally's end; `None` if the end of the game ended it, which has its own event.
fn ending_event(row: &RallyRow<'_>) -> Option<GameEvent> {
    let score = row.score;
    Some(match row.ending {
        RallyEnding::Table(RallyEnd::Goal { by }) => GameEvent::Goal {
            by: Side::BOTH[by],
            score,
        },
        RallyEnding::Table(RallyEnd::Foul { by }) => GameEvent::Foul {
            by: Side::BOTH[by],
            score,
        },
        RallyEnding::Table(RallyEnd::Stuck) => GameEvent::Stuck,
        RallyEnding::Table(RallyEnd::LeftTable) => GameEvent::LeftTable,
        RallyEnding::Table(RallyEnd::Diverged { .. }) => GameEvent::Diverged,
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
