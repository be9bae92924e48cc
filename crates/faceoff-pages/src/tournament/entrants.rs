//! Teams of a tournament with their submissions by round.

use super::schedule::is_hidden;
use crate::{format::utc_minute, spoilers::Spoilers, tournament_text::departure_label};
use faceoff_api::views::tournament::TournamentView;
use faceoff_service::{app::AppState, problem::Problem};
use faceoff_types::{RoundNumber, SubmissionId, TeamId, TeamName};
use std::collections::BTreeMap;

pub(super) struct Entrant {
    pub(super) team: TeamName,
    pub(super) team_id: TeamId,
    pub(super) entered_at: String,
    /// Since when and why the team is out of the tournament.
    pub(super) departure: Option<String>,
    pub(super) submissions: Vec<RoundsSubmission>,
}

/// A submission with the rounds in which the team plays with it.
pub(super) struct RoundsSubmission {
    pub(super) rounds: String,
    pub(super) submission: SubmissionId,
    pub(super) agent: Option<String>,
}

/// The teams, sorted by name.
pub(super) async fn entrants(
    app: &AppState,
    view: &TournamentView,
    spoilers: &Spoilers,
) -> Result<Vec<Entrant>, Problem> {
    let mut entrants = Vec::new();
    for entrant in &view.entrants {
        let mut submissions = Vec::new();
        for (submission, rounds) in rounds_of(view, entrant.team, spoilers) {
            let agent = app.store.submission(submission).await?.agent_name;
            submissions.push(RoundsSubmission {
                rounds: rounds_text(&rounds),
                submission,
                agent: agent.map(|name| faceoff_types::escape_unprintable(&name).into_owned()),
            });
        }
        let departure = entrant.departure.as_ref().map(|departure| {
            let kind = departure_label(departure.kind);
            let from = departure.from_round;
            match spoilers.hides_results() {
                true => format!("{kind} from round {from}"),
                false => format!("{kind} from round {from}: {}", departure.reason),
            }
        });
        entrants.push(Entrant {
            team: entrant.team_name.clone(),
            team_id: entrant.team,
            entered_at: utc_minute(entrant.entered_at),
            departure,
            submissions,
        });
    }
    Ok(entrants)
}

/// Rounds of a team by submission, in order.
fn rounds_of(
    view: &TournamentView,
    team: TeamId,
    spoilers: &Spoilers,
) -> Vec<(SubmissionId, Vec<RoundNumber>)> {
    let mut rounds_of_submissions = Vec::<(SubmissionId, Vec<RoundNumber>)>::new();
    for round in &view.rounds {
        if is_hidden(view, round.number, spoilers) {
            continue;
        }
        let own_submission = round
            .submissions
            .iter()
            .find(|submission| submission.team == team);
        let Some(own) = own_submission else { continue };
        match rounds_of_submissions
            .iter_mut()
            .find(|(id, _)| *id == own.submission)
        {
            Some((_, rounds)) => rounds.push(round.number),
            None => rounds_of_submissions.push((own.submission, vec![round.number])),
        }
    }
    rounds_of_submissions
}

/// The rounds in which each submission plays, as text by its id, for the ratings.
pub(super) fn rounds_by_submission(view: &TournamentView) -> BTreeMap<String, String> {
    let mut rounds = BTreeMap::<String, Vec<RoundNumber>>::new();
    for round in &view.rounds {
        for submission in &round.submissions {
            let entry = rounds.entry(submission.submission.to_string()).or_default();
            entry.push(round.number);
        }
    }
    rounds
        .into_iter()
        .map(|(id, rounds)| (id, rounds_text(&rounds)))
        .collect()
}

fn rounds_text(rounds: &[RoundNumber]) -> String {
    let numbers: Vec<_> = rounds.iter().map(ToString::to_string).collect();
    match numbers.as_slice() {
        [only] => format!("round {only}"),
        many => format!("rounds {}", many.join(", ")),
    }
}
