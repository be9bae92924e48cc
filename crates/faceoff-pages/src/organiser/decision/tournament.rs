//! Decisions about a tournament: start its next round, pause, resume or close it, and let a team leave it.

use super::preview::{DecisionOutcome, DecisionPreview, PUBLIC_REASON};
use crate::organiser::tournament::page_path;
use faceoff_api::requests;
use faceoff_service::{
    app::AppState,
    problem::Problem,
    services::{
        departures::{self, PlannedDeparture},
        tournament_rounds, tournaments,
    },
};
use faceoff_store::{Actor, TournamentRecord};
use faceoff_types::{DepartureKind, RoundNumber, TeamId, TournamentFormat, TournamentId};

#[derive(Debug, Clone, Copy)]
pub(in crate::organiser) enum TournamentDecision {
    /// Start the round with this number, which has to be the next one.
    StartRound(TournamentId, RoundNumber),
    Pause(TournamentId),
    Resume(TournamentId),
    Close(TournamentId),
    Leave(TournamentId, TeamId, DepartureKind),
}

const fn departure(team: TeamId, kind: DepartureKind) -> PlannedDeparture<'static> {
    PlannedDeparture {
        team,
        kind,
        from_round: None,
        reason: None,
    }
}

/// The teams among which the games of the round are drawn, as text.
fn round_teams(record: &TournamentRecord, number: RoundNumber) -> String {
    let has_groups = matches!(
        record.tournament.rules.format,
        TournamentFormat::Groups { .. }
    );
    if has_groups && number > RoundNumber::FIRST {
        return "the teams that advanced from the groups".to_owned();
    }
    let entrants = record.entrants.iter();
    let teams = entrants.filter(|entrant| entrant.departure.is_none());
    format!("the {} teams", teams.count())
}

impl TournamentDecision {
    const fn tournament(self) -> TournamentId {
        let (Self::StartRound(id, _)
        | Self::Pause(id)
        | Self::Resume(id)
        | Self::Close(id)
        | Self::Leave(id, ..)) = self;
        id
    }

    pub(super) async fn preview(self, app: &AppState) -> Result<DecisionPreview, Problem> {
        let id = self.tournament();
        let return_path = page_path(id);
        let preview = DecisionPreview::new(return_path.clone());
        let record = app.store.tournament_record(id).await?;
        let name = &record.tournament.name;
        Ok(match self {
            Self::StartRound(_, number) => {
                tournament_rounds::check_next_round(number, record.rounds.len())?;
                DecisionPreview {
                    title: format!("Start round {number} of {name}"),
                    effects: format!(
                        "The pairings of {} will be decided and their games queued. For each of these teams, the submission that is \
                         active now will play the whole round; later uploads will play in the next one.",
                        round_teams(&record, number)
                    ),
                    button: "Start the round",
                    ..preview
                }
            }
            Self::Pause(_) => DecisionPreview {
                title: format!("Pause {name}"),
                effects: "No further games will start, test and friendly games included. Running games will continue. The \
                          tournament’s page will show the reason."
                    .to_owned(),
                reason_readers: Some(PUBLIC_REASON),
                button: "Pause the tournament",
                ..preview
            },
            Self::Resume(_) => DecisionPreview {
                title: format!("Resume {name}"),
                effects: "Queued games will start at once.".to_owned(),
                button: "Resume the tournament",
                ..preview
            },
            Self::Close(_) => DecisionPreview {
                title: format!("Close {name}"),
                button: "Close the tournament",
                ..DecisionPreview::needing_confirmation(
                    tournaments::preview_close(app, id).await?,
                    return_path,
                )
            },
            Self::Leave(_, team, kind) => {
                let effects =
                    departures::preview_departure(app, id, &departure(team, kind)).await?;
                let (verb, button) = match kind {
                    DepartureKind::Withdrawn => ("Withdraw", "Withdraw the team"),
                    DepartureKind::Disqualified => ("Disqualify", "Disqualify the team"),
                };
                DecisionPreview {
                    title: format!("{verb} {} from {name}", effects.name),
                    reason_readers: Some(PUBLIC_REASON),
                    button,
                    ..DecisionPreview::needing_confirmation(effects, return_path)
                }
            }
        })
    }

    pub(super) async fn carry_out(
        self,
        app: &AppState,
        actor: Actor,
        request: requests::Decision,
    ) -> Result<DecisionOutcome, Problem> {
        let confirm = request.confirm.as_deref();
        let notice = match self {
            Self::StartRound(id, number) => {
                tournament_rounds::start_round(app, actor, id, Some(number)).await?;
                "round-started"
            }
            Self::Pause(id) => {
                tournaments::pause_tournament(app, actor, id, &request.reason).await?;
                "tournament-paused"
            }
            Self::Resume(id) => {
                tournaments::resume_tournament(app, actor, id).await?;
                "tournament-resumed"
            }
            Self::Close(id) => {
                tournaments::close_tournament(app, actor, id, confirm).await?;
                "tournament-closed"
            }
            Self::Leave(id, team, kind) => {
                let planned = PlannedDeparture {
                    reason: Some(&request.reason),
                    ..departure(team, kind)
                };
                departures::leave_tournament(app, actor, id, &planned, confirm).await?;
                "team-left"
            }
        };
        Ok(DecisionOutcome::new(notice, page_path(self.tournament())))
    }
}
