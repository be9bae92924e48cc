//! `faceoff game watch`: prints the live events of a game. A *snapshot* describes the current state when a stream begins, a
//! *happening* is e.g. a goal or a foul. An *attempt* is one run of the game, repeated after a platform fault.

use crate::client::{ApiError, Client, ServerEvent};
use anyhow::Context;
use faceoff_api::views::{
    game::GameView,
    live::{LiveEnd, LiveEndState},
};
use faceoff_types::{CONTROL_STEP_S, GameEvent, GameId, LiveEvent, LiveGame, Side};
use futures::StreamExt;
use reqwest::StatusCode;
use serde_json::Value;
use std::time::Duration;

/// Delay before a new attempt to connect.
const RETRY_DELAY: Duration = Duration::from_secs(1);
/// After this many attempts in a row without an event, the server is considered unreachable.
const MAX_ATTEMPTS: u32 = 30;

/// Prints events until the game is over. An interrupted stream is resumed after the last printed event.
pub(super) async fn watch(client: &Client, json: bool, id: GameId) -> anyhow::Result<()> {
    let game = client.game(id).await?;
    let mut printer = EventPrinter::new(game, json);
    let mut attempts = 0;
    while !printer.is_over {
        match read_stream(client, id, &mut printer).await {
            // The server ends a stream after an hour, and when it shuts down.
            Ok(received) if received > 0 => attempts = 0,
            Ok(_) => attempts += 1,
            Err(error) if is_final(&error) || attempts >= MAX_ATTEMPTS => return Err(error),
            Err(error) => {
                if attempts == 0 {
                    eprintln!("connection lost ({error:#}); reconnecting");
                }
                attempts += 1;
            }
        }
        anyhow::ensure!(
            printer.is_over || attempts <= MAX_ATTEMPTS,
            "the server sends no further events of the game; for its state, run: faceoff game show {id}"
        );
        if !printer.is_over {
            tokio::time::sleep(RETRY_DELAY).await;
        }
    }
    Ok(())
}

/// Has the server refused the request for a lasting reason, not because of too many watchers or a restart?
fn is_final(error: &anyhow::Error) -> bool {
    error.downcast_ref::<ApiError>().is_some_and(|refused| {
        refused.status.is_client_error() && refused.status != StatusCode::TOO_MANY_REQUESTS
    })
}

/// Reads one stream to its end and returns the number of events.
async fn read_stream(
    client: &Client,
    id: GameId,
    printer: &mut EventPrinter,
) -> anyhow::Result<u32> {
    let mut received = 0;
    let mut events = Box::pin(
        client
            .watch_game(id, printer.last_event_id.as_deref())
            .await?,
    );
    while let Some(event) = events.next().await {
        let event = match event {
            Ok(event) => event,
            // The events before the error are complete, so the stream is resumed after them.
            Err(_) if received > 0 => break,
            Err(error) => return Err(error),
        };
        printer.print(&event)?;
        received += 1;
        if printer.is_over {
            break;
        }
    }
    Ok(received)
}

/// Prints the events of a game and remembers which have been printed.
struct EventPrinter {
    teams: [String; 2],
    json: bool,
    last_event_id: Option<String>,
    /// Number of the attempt whose snapshot was printed.
    attempt: Option<u32>,
    /// Was it printed that the game waits for a slot?
    is_waiting: bool,
    is_over: bool,
}

impl EventPrinter {
    fn new(game: GameView, json: bool) -> Self {
        Self {
            teams: game.sides.map(|side| side.team_name.to_string()),
            json,
            last_event_id: None,
            attempt: None,
            is_waiting: false,
            is_over: false,
        }
    }

    fn print(&mut self, event: &ServerEvent) -> anyhow::Result<()> {
        let line = self
            .event_line(event)
            .context("the server's answer cannot be read; is it another version of Faceoff?")?;
        if self.json {
            let data: Value = serde_json::from_str(&event.data).context("an event")?;
            let json = serde_json::json!({"event": event.name, "id": event.id, "data": data});
            println!("{json}");
        } else if let Some(line) = line {
            println!("{line}");
        }
        if event.id.is_some() {
            self.last_event_id.clone_from(&event.id);
        }
        Ok(())
    }

    /// The line to print for an event, if any.
    fn event_line(&mut self, event: &ServerEvent) -> serde_json::Result<Option<String>> {
        Ok(match event.name.as_str() {
            "snapshot" => {
                let snapshot: LiveGame = serde_json::from_str(&event.data)?;
                self.is_waiting = false;
                // After a reconnection, the same attempt continues and the missed events follow.
                let is_new = self.attempt.replace(snapshot.attempt) != Some(snapshot.attempt);
                is_new.then(|| {
                    let [home, away] = &self.teams;
                    let [home_goals, away_goals] = snapshot.score;
                    let minutes = f64::from(snapshot.steps) * CONTROL_STEP_S / 60.0;
                    format!(
                        "{home} - {away}, attempt {} of a game of {minutes:.1} minutes: {home_goals} : {away_goals} so far",
                        snapshot.attempt
                    )
                })
            }
            "happening" => {
                let happening: LiveEvent = serde_json::from_str(&event.data)?;
                Some(self.happening_line(&happening))
            }
            "waiting" => {
                let is_new = !std::mem::replace(&mut self.is_waiting, true);
                is_new.then(|| "waiting for a free slot".to_owned())
            }
            "over" => {
                let end: LiveEnd = serde_json::from_str(&event.data)?;
                self.is_over = true;
                let state = match end.state {
                    LiveEndState::Played => "over",
                    LiveEndState::PlatformFailed => {
                        "over without a result, because of a platform fault"
                    }
                    LiveEndState::Void => "over, result voided",
                    LiveEndState::Cancelled => "cancelled",
                };
                Some(format!("{state}: faceoff game show {}", end.game))
            }
            // Positions are not printed, and a later server may send other events.
            _ => None,
        })
    }

    fn happening_line(&self, happening: &LiveEvent) -> String {
        let team = |side: Side| &self.teams[side.index()];
        let score_text = |[home, away]: [u32; 2]| format!("{home} : {away}");
        let text = match &happening.event {
            GameEvent::RallyBegun { rally, serves } => format!(
                "rally {} begins, the puck is on the side of {}",
                rally + 1,
                team(*serves)
            ),
            GameEvent::Restarted { side } => format!("{} is restarted", team(*side)),
            GameEvent::Goal { by, score } => {
                format!("goal by {}: {}", team(*by), score_text(*score))
            }
            GameEvent::Foul { by, score } => {
                format!("foul by {}: {}", team(*by), score_text(*score))
            }
            GameEvent::Stuck => "the puck is stuck in the middle; no foul".to_owned(),
            GameEvent::LeftTable => "the puck left the table".to_owned(),
            GameEvent::Diverged => "the simulation diverged".to_owned(),
            GameEvent::Fault { side, count } => {
                format!("fault {count} of {}", team(*side))
            }
            GameEvent::Ended {
                score,
                winner,
                forfeits,
            } => {
                let mut text = match winner {
                    Some(side) => format!("{} wins, {}", team(*side), score_text(*score)),
                    None => format!("a draw, {}", score_text(*score)),
                };
                for (side, cause) in Side::BOTH.into_iter().zip(forfeits) {
                    if let Some(cause) = cause {
                        text.push_str(&format!("; {} forfeited: {cause}", team(side)));
                    }
                }
                text
            }
            GameEvent::Aborted => "aborted; this attempt has no result".to_owned(),
        };
        let seconds = f64::from(happening.step) * CONTROL_STEP_S;
        format!(
            "{:>3}:{:04.1}  {text}",
            (seconds / 60.0) as u32,
            seconds % 60.0
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn printer() -> EventPrinter {
        EventPrinter {
            teams: ["Ajax".to_owned(), "Zed".to_owned()],
            json: false,
            last_event_id: None,
            attempt: None,
            is_waiting: false,
            is_over: false,
        }
    }

    fn event(name: &str, data: &Value) -> ServerEvent {
        ServerEvent {
            name: name.to_owned(),
            data: data.to_string(),
            id: None,
        }
    }

    #[test]
    fn events_are_printed_with_team_name_and_game_clock() {
        let printer = printer();
        let line = |step: u32, fields: Value| {
            let mut json = json!({ "step": step });
            json.as_object_mut()
                .unwrap()
                .extend(fields.as_object().unwrap().clone());
            printer.happening_line(&serde_json::from_value(json).unwrap())
        };
        assert_eq!(
            line(3605, json!({"kind": "goal", "by": 2, "score": [0, 1]})),
            "  1:12.1  goal by Zed: 0 : 1"
        );
        assert_eq!(
            line(0, json!({"kind": "rally_begun", "rally": 0, "serves": 1})),
            "  0:00.0  rally 1 begins, the puck is on the side of Ajax"
        );
        let ended = json!({"kind": "ended", "score": [0, 10], "winner": 2,
                           "forfeits": [{"kind": "faults", "count": 11, "allowed": 10}, null]});
        let text = line(45_000, ended);
        assert!(
            text.starts_with(" 15:00.0  Zed wins, 0 : 10; Ajax forfeited: "),
            "{text}"
        );
    }

    #[test]
    fn snapshot_is_printed_once_per_attempt() {
        let mut printer = printer();
        let snapshot = |attempt: u32| {
            event(
                "snapshot",
                &json!({"game": GameId::new(), "attempt": attempt, "steps": 45_000, "score": [1, 0],
                                      "fouls": [0, 0], "position": null, "is_over": false}),
            )
        };
        let mut line = |event: &ServerEvent| printer.event_line(event).unwrap();
        let waiting = event("waiting", &json!({"game": GameId::new()}));
        assert!(line(&waiting).is_some());
        assert_eq!(line(&waiting), None);
        let first = line(&snapshot(1)).unwrap();
        assert_eq!(
            first,
            "Ajax - Zed, attempt 1 of a game of 15.0 minutes: 1 : 0 so far"
        );
        assert_eq!(line(&snapshot(1)), None);
        assert_eq!(line(&event("position", &json!({}))), None);
        assert!(line(&snapshot(2)).is_some());
        let over = event("over", &json!({"game": GameId::new(), "state": "played"}));
        assert!(line(&over).unwrap().starts_with("over: "));
        assert!(printer.is_over);
        assert!(printer.event_line(&event("over", &json!({}))).is_err());
    }
}
