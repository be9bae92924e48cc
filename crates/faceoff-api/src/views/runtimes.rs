//! What agents find on this server: runtimes with their packages, and limits, contest by contest.

use crate::views::stage::PhaseView;
use faceoff_types::{
    AgentLimits, AgentMachine, GameLimits, RuntimeInventory, StageId, StageName, TournamentId,
};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// What agents run on here.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RuntimesView {
    /// The ruleset of what is played now.
    #[schema(example = "airhockey-2023.3")]
    pub ruleset: String,
    /// What `agent.toml` may name, with what was found in each when the server started; empty in an archive.
    pub runtimes: Vec<RuntimeInventory>,
    /// Whose CPUs agents use.
    pub machine: AgentMachine,
    /// There is none: agents see no device.
    #[schema(example = "none")]
    pub gpu: Absent,
    /// There is none but an empty loopback interface.
    #[schema(example = "none")]
    pub network: Absent,
    /// What agents are held to by the server's configuration; where a contest has limits of its own, those count.
    pub limits: AgentLimits,
    /// The stages that are not over, the first to open first.
    pub stages: Vec<StageOffer>,
    /// The tournaments that are not closed, the first one first.
    pub tournaments: Vec<TournamentOffer>,
}

/// Agents have none of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Absent {
    /// None.
    None,
}

/// What agents of a stage have and are held to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StageOffer {
    /// Which.
    pub id: StageId,
    /// As the organiser named it.
    pub name: StageName,
    /// Where it is now.
    pub phase: PhaseView,
    /// Of the runtimes those that it takes.
    pub runtimes: Vec<String>,
    /// All of them, its own and the server's.
    pub limits: AgentLimits,
}

/// What agents of a tournament have and are held to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TournamentOffer {
    /// Which.
    pub id: TournamentId,
    /// As the organiser named it.
    pub name: StageName,
    /// Of the runtimes those that it takes.
    pub runtimes: Vec<String>,
    /// All of them, its own and the server's.
    pub limits: AgentLimits,
    /// Of each side of a game, besides.
    pub game_limits: GameLimits,
}
