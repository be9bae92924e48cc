//! The events of a game: ends of rallies with their reasons, agent faults, forfeits.

use super::{clock, recording::RecordedGame};
use faceoff_dataset::game::ListedRally;
use faceoff_sim::game::referee::GAME_RULES;
use faceoff_types::{AgentFault, FOULS_PER_POINT, Side, escape_unprintable};
use serde::Serialize;

/// An event of a game.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GameEvent {
    pub time_s: f64,
    /// Control steps of the game before the event.
    pub game_step: u32,
    /// `goal`, `foul`, `stuck`, `left_table`, `diverged`, `game_over`, `fault` or `forfeit`.
    pub event: String,
    /// The side that scored, committed the foul, had the fault or forfeited: 1, 2 or absent.
    pub by: Option<u32>,
    /// The score after the end of a rally, with points for fouls.
    pub score: Option<[u32; 2]>,
    pub text: String,
}

impl GameEvent {
    fn new(game_step: u32, event: &str, by: Option<u32>, text: String) -> Self {
        Self {
            time_s: clock::seconds(game_step),
            game_step,
            event: event.to_owned(),
            by,
            score: None,
            text,
        }
    }
}

/// The events in the order of time.
pub fn list(game: &RecordedGame) -> Vec<GameEvent> {
    let mut fouls = [0; 2];
    let rallies = game.course.rallies.iter();
    let mut events: Vec<GameEvent> = rallies
        .map(|rally| rally_end(game, rally, &mut fouls))
        .collect();
    events.extend(faults(game));
    for (side, score) in Side::BOTH.into_iter().zip(&game.course.score.sides) {
        if let Some(cause) = &score.forfeit {
            let text = format!("{} forfeited: {cause}", game.agents[side.index()]);
            let step = game.course.score.steps;
            events.push(GameEvent::new(step, "forfeit", Some(side.number()), text));
        }
    }
    // A rally ends before the agent is started or reset for the next one.
    events.sort_by_key(|event| {
        (
            event.game_step,
            event.event == "game_over" || event.event == "forfeit",
        )
    });
    events
}

fn faults(game: &RecordedGame) -> Vec<GameEvent> {
    let mut events = Vec::new();
    for (side, course) in Side::BOTH.into_iter().zip(&game.course.sides) {
        let faults = course.iter().flat_map(|course| &course.outcome.faults);
        events.extend(faults.map(|fault| {
            let AgentFault {
                fault: kind,
                episode,
                step,
                line,
                ..
            } = &fault.fault;
            let place = match (episode, step) {
                (Some(rally), Some(step)) => format!("at step {step} of rally {rally}"),
                (Some(rally), None) => format!("at its reset for rally {rally}"),
                (None, _) => "at its start".to_owned(),
            };
            let line = line.as_ref().map(|line| format!(" (line: {line})"));
            let cause = format!("{kind}{}", line.unwrap_or_default());
            let text = format!(
                "fault of {} {place}: {}",
                game.agents[side.index()],
                escape_unprintable(&cause)
            );
            GameEvent::new(fault.game_step, "fault", Some(side.number()), text)
        }));
    }
    events
}

/// The event of a rally's end. `fouls` are the fouls of each side so far; a foul is added.
fn rally_end(game: &RecordedGame, rally: &ListedRally, fouls: &mut [u32; 2]) -> GameEvent {
    let [first, second] = rally.score;
    let text = match (rally.end.as_str(), rally.by) {
        ("goal", Some(by)) => format!("goal by {}: {first} : {second}", game.agent(by)),
        ("foul", Some(by)) => {
            let count = &mut fouls[usize::from(by == 2)];
            *count += 1;
            let point = if count.is_multiple_of(FOULS_PER_POINT) {
                format!("; a point for {}", game.agent(3 - by.clamp(1, 2)))
            } else {
                String::new()
            };
            format!(
                "foul {count} by {}: the puck stayed on its side for more than {} s{point}; {first} : {second}",
                game.agent(by),
                GAME_RULES.foul_after_s
            )
        }
        ("stuck", _) => {
            "the puck stopped in the middle, where no robot reaches it; no foul".to_owned()
        }
        // In a game a goal is another end; in an episode `left_table` includes goals.
        ("left_table", _) => "the puck left the table beside the goals".to_owned(),
        ("diverged", _) => "the simulation diverged, see the fault".to_owned(),
        ("game_over", _) => format!("end of the game: {first} : {second}"),
        (end, _) => escape_unprintable(end).into_owned(),
    };
    GameEvent {
        score: Some(rally.score),
        ..GameEvent::new(rally.end_step(), &rally.end, rally.by, text)
    }
}
