//! A game while it is played.

use crate::{figures, table_drawing::Dot};
use faceoff_replay::model::CONTROL_STEP_S;
use faceoff_service::views::game_live::GameLive;
use faceoff_types::{GameHappening, Side};
use jiff::{SignedDuration, Timestamp};

pub(super) struct Live {
    pub(super) score: [u32; 2],
    pub(super) fouls: [u32; 2],
    /// Minutes that were played, and of the whole game.
    pub(super) played_min: String,
    pub(super) whole_min: String,
    /// When it is over, as fast as it has gone so far; none in its first seconds.
    pub(super) expected_at: Option<Timestamp>,
    pub(super) puck: Dot,
    pub(super) mallets: [Dot; 2],
    /// What happened, the newest first: minutes and seconds of the game, and words.
    pub(super) happened: Vec<(String, String)>,
}

/// Before as many control steps nobody can tell how fast it goes.
const FIRST_STEPS: u32 = 500;

impl Live {
    pub(super) fn of(
        live: &GameLive,
        teams: &[String; 2],
        since: Timestamp,
        now: Timestamp,
    ) -> Self {
        let stands = &live.stands;
        let minutes = |steps: u32| figures::one(f64::from(steps) * CONTROL_STEP_S / 60.0);
        let last = live.happenings.last().map_or(0, |last| last.step);
        let step = stands.position.map_or(last, |position| position.step);
        let places = stands
            .position
            .map_or([[0.0; 2], [-0.8, 0.0], [0.8, 0.0]], |position| {
                let [x, y, _] = position.puck;
                [[x, y], position.mallets[0], position.mallets[1]]
            });
        let [puck, home, away] = places.map(Dot::at);
        let happened = live.happenings.iter().rev();
        Self {
            score: stands.score,
            fouls: stands.fouls,
            played_min: minutes(step),
            whole_min: minutes(stands.steps),
            expected_at: expected_at(since, now, step, stands.steps),
            puck,
            mallets: [home, away],
            happened: happened
                .filter_map(|one| Some((at(one.step), in_words(&one.what, teams)?)))
                .collect(),
        }
    }

    /// In a sentence, for who listens.
    pub(super) fn told(&self) -> String {
        let [home, away] = self.score;
        match self.happened.first() {
            Some((_, words)) => format!("{words}."),
            None => format!("{home} : {away}."),
        }
    }
}

fn expected_at(since: Timestamp, now: Timestamp, step: u32, steps: u32) -> Option<Timestamp> {
    if step < FIRST_STEPS {
        return None;
    }
    let so_far = now.duration_since(since).as_secs_f64();
    let left = so_far * f64::from(steps.saturating_sub(step)) / f64::from(step);
    now.checked_add(SignedDuration::try_from_secs_f64(left).ok()?)
        .ok()
}

/// Minutes and seconds of the game.
pub(super) fn at(step: u32) -> String {
    let seconds = f64::from(step) * CONTROL_STEP_S;
    let minutes = (seconds / 60.0).floor();
    format!("{minutes:.0}:{:04.1}", (seconds - 60.0 * minutes).min(59.9))
}

/// Where the replay is two seconds before a control step, as its script reads it from the address.
pub(super) fn before(step: u32) -> String {
    format!("#t={}", step.saturating_sub(100))
}

/// None of what is no news.
fn in_words(what: &GameHappening, teams: &[String; 2]) -> Option<String> {
    let name = |side: Side| &teams[side.index()];
    let stands = |[home, away]: [u32; 2]| format!("{home} : {away}");
    Some(match what {
        GameHappening::RallyBegun { .. } | GameHappening::BrokenOff => return None,
        GameHappening::Restarted { side } => {
            format!("The agent of {} was started anew", name(*side))
        }
        GameHappening::Goal { by, score } => format!("Goal by {}: {}", name(*by), stands(*score)),
        GameHappening::Foul { by, score } => format!("Foul by {}: {}", name(*by), stands(*score)),
        GameHappening::Stuck => "The puck lay where nobody reaches it".to_owned(),
        GameHappening::LeftTable => "The puck left the table".to_owned(),
        GameHappening::Diverged => "The simulated world diverged".to_owned(),
        GameHappening::Fault { side, count } => {
            format!("Fault of {}, its number {count}", name(*side))
        }
        GameHappening::Ended { score, .. } => format!("The end: {}", stands(*score)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moment_of_a_game_is_told_in_minutes_and_seconds() {
        assert_eq!(
            [0, 50, 3000, 44_999].map(at),
            ["0:00.0", "0:01.0", "1:00.0", "14:59.9"]
        );
    }

    #[test]
    fn the_end_is_expected_by_the_pace_so_far() {
        let since: Timestamp = "2026-03-01T10:00:00Z".parse().unwrap();
        let now: Timestamp = "2026-03-01T10:01:00Z".parse().unwrap();
        let at: Timestamp = "2026-03-01T10:04:00Z".parse().unwrap();
        assert_eq!(expected_at(since, now, 1000, 4000), Some(at));
        assert_eq!(expected_at(since, now, 10, 4000), None);
    }
}
