//! The live view of a running game: score, clock, positions and events.

use crate::{format, table_drawing::Dot};
use faceoff_replay::model::CONTROL_STEP_S;
use faceoff_service::views::live_game::LiveGameView;
use faceoff_types::{GameEvent, Side};
use jiff::{SignedDuration, Timestamp};

pub(super) struct LiveGame {
    /// Of the home side, then of the away side, as all pairs here.
    pub(super) score: [u32; 2],
    pub(super) fouls: [u32; 2],
    pub(super) played_min: String,
    pub(super) total_min: String,
    /// Expected end at the current pace; `None` in the first seconds.
    pub(super) expected_at: Option<Timestamp>,
    pub(super) puck: Dot,
    pub(super) mallets: [Dot; 2],
    /// Game clock and text of each event, newest first.
    pub(super) events: Vec<(String, String)>,
}

/// Control steps before the pace can be estimated: 10 s of the game.
const MIN_STEPS_FOR_PACE: u32 = 500;

/// Positions of puck, home mallet and away mallet that are drawn before the first position is known.
const START_POSITIONS: [[f64; 2]; 3] = [[0.0, 0.0], [-0.8, 0.0], [0.8, 0.0]];

/// Control steps by which links open the replay before an event: two seconds.
const REPLAY_LEAD_STEPS: u32 = 100;

impl LiveGame {
    pub(super) fn new(
        live: &LiveGameView,
        teams: &[String; 2],
        since: Timestamp,
        now: Timestamp,
    ) -> Self {
        let state = &live.state;
        let total_steps = state.steps;
        let minutes = |steps: u32| format::one_decimal(f64::from(steps) * CONTROL_STEP_S / 60.0);
        let last_event_step = live.events.last().map_or(0, |last| last.step);
        // Positions are newer than events, but a game may have none yet.
        let step = state
            .position
            .map_or(last_event_step, |position| position.step);
        let positions = state.position.map_or(START_POSITIONS, |position| {
            let [x, y, _] = position.puck;
            [[x, y], position.mallets[0], position.mallets[1]]
        });
        let [puck, home, away] = positions.map(Dot::at);
        let events = live.events.iter().rev();
        Self {
            score: state.score,
            fouls: state.fouls,
            played_min: minutes(step),
            total_min: minutes(total_steps),
            expected_at: expected_at(since, now, step, total_steps),
            puck,
            mallets: [home, away],
            events: events
                .filter_map(|event| {
                    Some((game_clock(event.step), event_text(&event.event, teams)?))
                })
                .collect(),
        }
    }

    /// Text for screen readers after a live update.
    pub(super) fn live_text(&self) -> String {
        let [home, away] = self.score;
        match self.events.first() {
            Some((_, text)) => format!("{text}."),
            None => format!("{home} : {away}."),
        }
    }
}

fn expected_at(since: Timestamp, now: Timestamp, step: u32, total_steps: u32) -> Option<Timestamp> {
    if step < MIN_STEPS_FOR_PACE {
        return None;
    }
    let elapsed = now.duration_since(since).as_secs_f64();
    let remaining_s = elapsed * f64::from(total_steps.saturating_sub(step)) / f64::from(step);
    now.checked_add(SignedDuration::try_from_secs_f64(remaining_s).ok()?)
        .ok()
}

/// Minutes and seconds of the game.
pub(super) fn game_clock(step: u32) -> String {
    let seconds = f64::from(step) * CONTROL_STEP_S;
    let minutes = (seconds / 60.0).floor();
    format!("{minutes:.0}:{:04.1}", (seconds - 60.0 * minutes).min(59.9))
}

/// Address fragment that opens the replay two seconds before a control step.
pub(super) fn replay_link(step: u32) -> String {
    format!("#t={}", step.saturating_sub(REPLAY_LEAD_STEPS))
}

/// Text of an event; `None` for events that are not listed.
fn event_text(event: &GameEvent, teams: &[String; 2]) -> Option<String> {
    let name = |side: Side| &teams[side.index()];
    let score_text = |[home, away]: [u32; 2]| format!("{home} : {away}");
    Some(match event {
        GameEvent::RallyBegun { .. } | GameEvent::Aborted => return None,
        GameEvent::Restarted { side } => {
            format!("The agent of {} was restarted", name(*side))
        }
        GameEvent::Goal { by, score } => format!("Goal by {}: {}", name(*by), score_text(*score)),
        GameEvent::Foul { by, score } => format!("Foul by {}: {}", name(*by), score_text(*score)),
        GameEvent::Stuck => "Puck out of reach".to_owned(),
        GameEvent::LeftTable => "Puck left the table".to_owned(),
        GameEvent::Diverged => "Simulation diverged".to_owned(),
        GameEvent::Fault { side, count } => {
            format!("Fault {count} of {}", name(*side))
        }
        GameEvent::Ended { score, .. } => format!("End of the game: {}", score_text(*score)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn game_clock_has_minutes_and_seconds() {
        assert_eq!(
            [0, 50, 3000, 44_999].map(game_clock),
            ["0:00.0", "0:01.0", "1:00.0", "14:59.9"]
        );
    }

    #[test]
    fn expected_end_follows_the_pace() {
        let since: Timestamp = "2026-03-01T10:00:00Z".parse().unwrap();
        let now: Timestamp = "2026-03-01T10:01:00Z".parse().unwrap();
        let end: Timestamp = "2026-03-01T10:04:00Z".parse().unwrap();
        assert_eq!(expected_at(since, now, 1000, 4000), Some(end));
        assert_eq!(expected_at(since, now, 10, 4000), None);
    }
}
