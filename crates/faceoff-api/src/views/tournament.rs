//! Tournaments: rules, entrants (the teams that take part), rounds and standings. A round is divided into *matchdays*, on
//! each of which a team meets at most one opponent; a team without an opponent on a matchday has a *bye*.

use crate::views::decision::DecisionView;
use faceoff_scoring::tournament::schedule::Table;
use faceoff_types::{
    DepartureKind, RoundNumber, StageId, StageName, SubmissionId, TeamId, TeamName, TournamentId,
    TournamentRules, TournamentSettings, deprecated_names,
};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A tournament, as in lists.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = TournamentHead)]
pub struct TournamentSummary {
    /// Id of the tournament.
    pub id: TournamentId,
    /// Number in its season, from 1; the seeds derive from it.
    pub number: u32,
    /// Name of the tournament.
    pub name: StageName,
    /// The current phase.
    pub phase: TournamentPhase,
    /// When it was created.
    pub created_at: Timestamp,
    /// The stage that qualified its first entrants; null: an organiser named them.
    pub stage: Option<StageId>,
    /// If it is paused and no game starts: since when, and why; null otherwise.
    pub paused: Option<DecisionView>,
    /// When it was closed and became final; null before.
    pub closed_at: Option<Timestamp>,
    /// The first team of the table that decides the tournament, once all rounds are over; null before.
    pub champion: Option<TeamName>,
    /// What happens next, in words.
    pub next: String,
}

/// Phase of a tournament.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum TournamentPhase {
    /// No round has started: entrants and rules may change.
    Open,
    /// A round is running: a game lacks a result that it can still get.
    #[serde(rename = "round")]
    RoundRunning,
    /// All games of the started rounds have results; another round follows.
    #[serde(rename = "between")]
    BetweenRounds,
    /// All rounds are over.
    #[serde(rename = "played")]
    AllRoundsPlayed,
    /// An organiser has closed it.
    Closed,
}

/// A tournament without its games.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TournamentView {
    /// The fields that also appear in lists of tournaments.
    #[serde(flatten)]
    pub summary: TournamentSummary,
    /// What results depend on; fixed from the first round on.
    pub rules: TournamentRules,
    /// What results do not depend on.
    pub settings: TournamentSettings,
    /// The organisers' submission that is the opponent of test games; null: none.
    pub baseline: Option<SubmissionId>,
    /// The entrants by name, including those that left.
    pub entrants: Vec<EntrantView>,
    /// The started rounds, in order.
    pub rounds: Vec<RoundView>,
    /// The standings: one table; in a tournament with groups, the table of the final, which decides the tournament, then
    /// that of each group.
    pub tables: Vec<Table>,
}

/// A team in a tournament.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(remote = "Self")]
pub struct EntrantView {
    /// Id of the team.
    pub team: TeamId,
    /// The team's current name.
    pub team_name: TeamName,
    /// When it entered.
    pub entered_at: Timestamp,
    /// If it left: when, how, and why; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub departure: Option<DepartureView>,
}
deprecated_names!(EntrantView { left => departure });

/// A team's departure from a tournament.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct DepartureView {
    /// Whether it withdrew or was disqualified.
    #[serde(rename = "as")]
    pub kind: DepartureKind,
    /// The first round whose games against it do not count.
    #[schema(value_type = u32, minimum = 1, maximum = 100)]
    pub from_round: RoundNumber,
    /// When it left.
    pub at: Timestamp,
    /// The public reason.
    pub reason: String,
}

/// A round with its draw.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(remote = "Self")]
pub struct RoundView {
    /// From 1.
    #[schema(value_type = u32, minimum = 1, maximum = 100)]
    pub number: RoundNumber,
    /// When it started; its submissions are fixed since then.
    pub started_at: Timestamp,
    /// When the last of its games ended for the first time; null before.
    pub ended_at: Option<Timestamp>,
    /// Number of matchdays. The games of a matchday can run in parallel.
    pub matchdays: u32,
    /// Number of its games in each state.
    pub progress: RoundProgress,
    /// Teams of each group; empty without groups.
    pub groups: Vec<Vec<TeamName>>,
    /// Byes in order of the matchdays.
    pub byes: Vec<ByeView>,
    /// The submission of each team.
    pub submissions: Vec<RoundSubmission>,
}
deprecated_names!(RoundView { over_at => ended_at });

/// Number of a round's games in each state.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct RoundProgress {
    /// All games.
    pub games: u32,
    /// Games with a result.
    pub played: u32,
    /// Running games.
    pub running: u32,
    /// Games that wait for a slot.
    pub queued: u32,
    /// Games that an organiser has to rerun: void, or given up after a platform fault.
    pub to_be_rerun: u32,
    /// Games that are not played, because a team left.
    pub cancelled: u32,
}

/// A team without an opponent on a matchday.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct ByeView {
    /// From 1.
    pub matchday: u32,
    /// Id of the team.
    pub team: TeamId,
    /// The team's current name.
    pub team_name: TeamName,
}

/// A team's submission for a round.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct RoundSubmission {
    /// Id of the team.
    pub team: TeamId,
    /// The team's current name.
    pub team_name: TeamName,
    /// The submission that was active when the round started.
    pub submission: SubmissionId,
}
