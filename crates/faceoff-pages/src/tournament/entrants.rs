//! Who is in a tournament, and with what each plays.

use super::{schedule::is_withheld, standings};
use crate::{figures::minute, spoilers::Spoilers};
use faceoff_api::views::tournament::TournamentView;
use faceoff_service::{app::AppState, problem::Problem};
use faceoff_types::{RoundNumber, SubmissionId, TeamId, TeamName};
use std::collections::BTreeMap;

pub(super) struct Entrant {
    pub(super) team: TeamName,
    pub(super) team_id: TeamId,
    pub(super) entered_at: String,
    /// How and why it left.
    pub(super) left: Option<String>,
    pub(super) plays: Vec<Plays>,
}

/// What it plays some rounds with.
pub(super) struct Plays {
    pub(super) rounds: String,
    pub(super) submission: SubmissionId,
    pub(super) agent: Option<String>,
}

/// The teams, by name.
pub(super) async fn of(
    app: &AppState,
    view: &TournamentView,
    spoilers: &Spoilers,
) -> Result<Vec<Entrant>, Problem> {
    let mut entrants = Vec::new();
    for entrant in &view.entrants {
        let mut plays = Vec::new();
        for (submission, rounds) in rounds_of(view, entrant.team, spoilers) {
            let agent = app.store.submission(submission).await?.agent_name;
            plays.push(Plays {
                rounds: in_words(&rounds),
                submission,
                agent: agent.map(|name| faceoff_types::harmless(&name).into_owned()),
            });
        }
        let left = entrant.left.as_ref().map(|left| {
            let how = standings::left(left.r#as);
            let from = left.from_round;
            match spoilers.hide() {
                true => format!("{how} from round {from} on"),
                false => format!("{how} from round {from} on: {}", left.reason),
            }
        });
        entrants.push(Entrant {
            team: entrant.team_name.clone(),
            team_id: entrant.team,
            entered_at: minute(entrant.entered_at),
            left,
            plays,
        });
    }
    Ok(entrants)
}

/// What a team plays which rounds with, the first one first.
fn rounds_of(
    view: &TournamentView,
    team: TeamId,
    spoilers: &Spoilers,
) -> Vec<(SubmissionId, Vec<RoundNumber>)> {
    let mut played = Vec::<(SubmissionId, Vec<RoundNumber>)>::new();
    for round in &view.rounds {
        if is_withheld(view, round.number, spoilers) {
            continue;
        }
        let own = round.submissions.iter().find(|one| one.team == team);
        let Some(own) = own else { continue };
        match played.iter_mut().find(|(id, _)| *id == own.submission) {
            Some((_, rounds)) => rounds.push(round.number),
            None => played.push((own.submission, vec![round.number])),
        }
    }
    played
}

/// Of each submission, by its id as ratings have it, the rounds that it plays.
pub(super) fn rounds_by_submission(view: &TournamentView) -> BTreeMap<String, String> {
    let mut rounds = BTreeMap::<String, Vec<RoundNumber>>::new();
    for round in &view.rounds {
        for one in &round.submissions {
            let of_one = rounds.entry(one.submission.to_string()).or_default();
            of_one.push(round.number);
        }
    }
    rounds
        .into_iter()
        .map(|(id, rounds)| (id, in_words(&rounds)))
        .collect()
}

fn in_words(rounds: &[RoundNumber]) -> String {
    let numbers: Vec<_> = rounds.iter().map(ToString::to_string).collect();
    match numbers.as_slice() {
        [only] => format!("round {only}"),
        many => format!("rounds {}", many.join(", ")),
    }
}
