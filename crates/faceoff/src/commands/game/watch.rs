//! A game as it is played.

use crate::client::{ApiError, Client, ServerEvent};
use anyhow::Context;
use faceoff_api::views::{
    game::GameView,
    live::{LiveEnd, LiveEndState},
};
use faceoff_types::{CONTROL_STEP_S, GameHappening, GameId, LiveGame, LiveHappening, Side};
use futures::StreamExt;
use reqwest::StatusCode;
use serde_json::Value;
use std::time::Duration;

/// Between two tries to go on after a cut.
const PAUSE: Duration = Duration::from_secs(1);
/// So many tries in a row that bring nothing: the server is gone.
const MOST_TRIES: u32 = 30;

/// Prints what happens until the game is over. A cut connection is taken up again after the last that was told.
pub(super) async fn follow(client: &Client, json: bool, id: GameId) -> anyhow::Result<()> {
    let game = client.game(id).await?;
    let mut told = Told::new(game, json);
    let mut tries = 0;
    while !told.is_over {
        match listen(client, id, &mut told).await {
            // The server ends streams after an hour, and when it ends.
            Ok(heard) if heard > 0 => tries = 0,
            Ok(_) => tries += 1,
            Err(error) if is_final(&error) || tries >= MOST_TRIES => return Err(error),
            Err(error) => {
                if tries == 0 {
                    eprintln!("the connection is cut ({error:#}); trying again");
                }
                tries += 1;
            }
        }
        anyhow::ensure!(
            told.is_over || tries <= MOST_TRIES,
            "the server tells nothing more of the game; faceoff game show {id} says how it stands"
        );
        if !told.is_over {
            tokio::time::sleep(PAUSE).await;
        }
    }
    Ok(())
}

/// Refused, and not because too many are watching or a server is about to be back.
fn is_final(error: &anyhow::Error) -> bool {
    error.downcast_ref::<ApiError>().is_some_and(|refused| {
        refused.status.is_client_error() && refused.status != StatusCode::TOO_MANY_REQUESTS
    })
}

/// Takes one stream to its end; how many events came.
async fn listen(client: &Client, id: GameId, told: &mut Told) -> anyhow::Result<u32> {
    let mut heard = 0;
    let mut events = Box::pin(client.watch_game(id, told.last.as_deref()).await?);
    while let Some(event) = events.next().await {
        let event = match event {
            Ok(event) => event,
            // What came before it stands.
            Err(_) if heard > 0 => break,
            Err(error) => return Err(error),
        };
        told.take(&event)?;
        heard += 1;
        if told.is_over {
            break;
        }
    }
    Ok(heard)
}

/// What was told so far.
struct Told {
    teams: [String; 2],
    json: bool,
    /// The id of the last happening.
    last: Option<String>,
    /// Of which a snapshot was printed.
    attempt: Option<u32>,
    waits: bool,
    is_over: bool,
}

impl Told {
    fn new(game: GameView, json: bool) -> Self {
        Self {
            teams: game.sides.map(|side| side.team_name.to_string()),
            json,
            last: None,
            attempt: None,
            waits: false,
            is_over: false,
        }
    }

    fn take(&mut self, event: &ServerEvent) -> anyhow::Result<()> {
        let line = self
            .line(event)
            .context("the server's answer is not understood; is it another version of Faceoff?")?;
        if self.json {
            let data: Value = serde_json::from_str(&event.data).context("an event")?;
            let whole = serde_json::json!({"event": event.name, "id": event.id, "data": data});
            println!("{whole}");
        } else if let Some(line) = line {
            println!("{line}");
        }
        if event.id.is_some() {
            self.last.clone_from(&event.id);
        }
        Ok(())
    }

    /// What is to be printed of an event, if anything.
    fn line(&mut self, event: &ServerEvent) -> serde_json::Result<Option<String>> {
        Ok(match event.name.as_str() {
            "snapshot" => {
                let stands: LiveGame = serde_json::from_str(&event.data)?;
                self.waits = false;
                // After a cut it is the same attempt, and what was missed follows.
                let is_new = self.attempt.replace(stands.attempt) != Some(stands.attempt);
                is_new.then(|| {
                    let [home, away] = &self.teams;
                    let [goals, conceded] = stands.score;
                    let minutes = f64::from(stands.steps) * CONTROL_STEP_S / 60.0;
                    format!(
                        "{home} - {away}, attempt {} of a game of {minutes:.1} minutes: {goals} : {conceded} so far",
                        stands.attempt
                    )
                })
            }
            "happening" => {
                let happening: LiveHappening = serde_json::from_str(&event.data)?;
                Some(self.happening(&happening))
            }
            "waiting" => {
                let is_new = !std::mem::replace(&mut self.waits, true);
                is_new
                    .then(|| "no slot plays it at the moment; it is told when one does".to_owned())
            }
            "over" => {
                let end: LiveEnd = serde_json::from_str(&event.data)?;
                self.is_over = true;
                let state = match end.state {
                    LiveEndState::Played => "over; it was played to its end",
                    LiveEndState::Broken => "over; it was broken by our fault, and has no result",
                    LiveEndState::Void => "over; its result counts no more",
                    LiveEndState::Cancelled => "it is not played",
                };
                Some(format!("{state}: faceoff game show {}", end.game))
            }
            // Where things are, and what a later server may tell.
            _ => None,
        })
    }

    fn happening(&self, happening: &LiveHappening) -> String {
        let team = |side: Side| &self.teams[side.index()];
        let scored = |[home, away]: [u32; 2]| format!("{home} : {away}");
        let what = match &happening.what {
            GameHappening::RallyBegun { rally, serves } => format!(
                "rally {} begins, the puck is on the side of {}",
                rally + 1,
                team(*serves)
            ),
            GameHappening::Restarted { side } => format!("{} is started anew", team(*side)),
            GameHappening::Goal { by, score } => {
                format!("goal by {}: {}", team(*by), scored(*score))
            }
            GameHappening::Foul { by, score } => {
                format!("foul by {}: {}", team(*by), scored(*score))
            }
            GameHappening::Stuck => "the puck is stuck in the middle; no foul".to_owned(),
            GameHappening::LeftTable => "the puck left the table".to_owned(),
            GameHappening::Diverged => "the world could not be simulated any further".to_owned(),
            GameHappening::Fault { side, count } => {
                format!("fault of {}, its number {count}", team(*side))
            }
            GameHappening::Ended {
                score,
                winner,
                forfeits,
            } => {
                let mut text = match winner {
                    Some(side) => format!("{} wins, {}", team(*side), scored(*score)),
                    None => format!("a draw, {}", scored(*score)),
                };
                for (side, cause) in Side::BOTH.into_iter().zip(forfeits) {
                    if let Some(cause) = cause {
                        text.push_str(&format!("; {} forfeited: {cause}", team(side)));
                    }
                }
                text
            }
            GameHappening::BrokenOff => "broken off; there is no result of this attempt".to_owned(),
        };
        let seconds = f64::from(happening.step) * CONTROL_STEP_S;
        format!(
            "{:>3}:{:04.1}  {what}",
            (seconds / 60.0) as u32,
            seconds % 60.0
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn told() -> Told {
        Told {
            teams: ["Ajax".to_owned(), "Zed".to_owned()],
            json: false,
            last: None,
            attempt: None,
            waits: false,
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
    fn happenings_are_told_by_name_and_by_the_games_clock() {
        let told = told();
        let line = |step: u32, what: Value| {
            let mut whole = json!({ "step": step });
            whole
                .as_object_mut()
                .unwrap()
                .extend(what.as_object().unwrap().clone());
            told.happening(&serde_json::from_value(whole).unwrap())
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
        let said = line(45_000, ended);
        assert!(
            said.starts_with(" 15:00.0  Zed wins, 0 : 10; Ajax forfeited: "),
            "{said}"
        );
    }

    #[test]
    fn a_snapshot_is_told_once_an_attempt_and_positions_not_at_all() {
        let mut told = told();
        let snapshot = |attempt: u32| {
            event(
                "snapshot",
                &json!({"game": GameId::new(), "attempt": attempt, "steps": 45_000, "score": [1, 0],
                                      "fouls": [0, 0], "position": null, "is_over": false}),
            )
        };
        let mut line = |event: &ServerEvent| told.line(event).unwrap();
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
        assert!(line(&over).unwrap().starts_with("over; "));
        assert!(told.is_over);
        assert!(told.line(&event("over", &json!({}))).is_err());
    }
}
