//! A tournament: its rules, who is in it, its rounds, its tables, and what comes next.

use crate::views::ruling::RulingView;
use faceoff_scoring::tournament::schedule::Table;
use faceoff_types::{
    LeftAs, RoundNumber, StageId, StageName, SubmissionId, TeamId, TeamName, TournamentId,
    TournamentRules, TournamentSettings,
};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A tournament, as lists have it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TournamentHead {
    /// Names the tournament in paths.
    pub id: TournamentId,
    /// In its season, from 1; its seeds follow from it.
    pub number: u32,
    /// As the organiser named it.
    pub name: StageName,
    /// Where it is now.
    pub phase: TournamentPhase,
    /// When the organiser opened it.
    pub created_at: Timestamp,
    /// The stage whose tiers its first entrants come from; null: the organiser named them.
    pub stage: Option<StageId>,
    /// No game of it begins: since when, and why; null otherwise.
    pub paused: Option<RulingView>,
    /// From then on nothing of it changes; null: it is not closed.
    pub closed_at: Option<Timestamp>,
    /// First of the deciding table, once all rounds are over; null before.
    pub champion: Option<TeamName>,
    /// What comes next.
    pub next: String,
}

/// Where a tournament is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum TournamentPhase {
    /// No round was started: entrants and rules may change.
    Open,
    /// A game of a round has no result and can still get one.
    Round,
    /// All games of the rounds that were started have results, and there is another round.
    Between,
    /// All rounds are over.
    Played,
    /// The organiser has closed it.
    Closed,
}

/// A tournament with all that everybody may know of it but its games.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TournamentView {
    /// As lists have it.
    #[serde(flatten)]
    pub head: TournamentHead,
    /// What results depend on; fixed from the first round on.
    pub rules: TournamentRules,
    /// What they do not depend on.
    pub settings: TournamentSettings,
    /// The organisers' agent, against which teams may test theirs; null: none.
    pub baseline: Option<SubmissionId>,
    /// Its teams, by name, those that left included.
    pub entrants: Vec<EntrantView>,
    /// Those that were started, in order.
    pub rounds: Vec<RoundView>,
    /// The standings, the deciding ones first: one table, or the final's and each group's.
    pub tables: Vec<Table>,
}

/// A team of a tournament.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct EntrantView {
    /// Which.
    pub team: TeamId,
    /// As it is called now.
    pub team_name: TeamName,
    /// Since when it is in it.
    pub entered_at: Timestamp,
    /// It plays no more in it; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left: Option<LeaveView>,
}

/// A team left.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct LeaveView {
    /// How.
    pub r#as: LeftAs,
    /// The first round whose games with it do not count.
    #[schema(value_type = u32, minimum = 1, maximum = 100)]
    pub from_round: RoundNumber,
    /// When.
    pub at: Timestamp,
    /// As everybody may read it.
    pub reason: String,
}

/// A round, as it was drawn.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct RoundView {
    /// From 1.
    #[schema(value_type = u32, minimum = 1, maximum = 100)]
    pub number: RoundNumber,
    /// From then on its submissions are fixed.
    pub started_at: Timestamp,
    /// When the last of its games had ended for the first time; null before.
    pub over_at: Option<Timestamp>,
    /// Games that can be played side by side, one after another.
    pub matchdays: u32,
    /// How far it is.
    pub progress: RoundProgress,
    /// Who plays in which group; empty without groups.
    pub groups: Vec<Vec<TeamName>>,
    /// Who has nobody to play, in the order of play.
    pub byes: Vec<ByeView>,
    /// What each team plays with.
    pub submissions: Vec<RoundSubmission>,
}

/// Of a round's games, how many stand how.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct RoundProgress {
    /// All of them.
    pub games: u32,
    /// That have a result.
    pub played: u32,
    /// That a slot plays.
    pub running: u32,
    /// That wait for a slot.
    pub queued: u32,
    /// That wait for the organiser: void, or broken by us, to be played again.
    pub to_be_rerun: u32,
    /// That are not played, since a side left.
    pub cancelled: u32,
}

/// A team that has nobody to play on a matchday.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct ByeView {
    /// From 1.
    pub matchday: u32,
    /// Which.
    pub team: TeamId,
    /// As it is called now.
    pub team_name: TeamName,
}

/// What a team plays a round with.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct RoundSubmission {
    /// Which team.
    pub team: TeamId,
    /// As it is called now.
    pub team_name: TeamName,
    /// What it had active when the round was started.
    pub submission: SubmissionId,
}
