//! Runtimes, the environments in which agents run, and the resource limits of agents, for the server and for each stage and
//! tournament.

use crate::views::stage::PhaseView;
use faceoff_types::{
    AgentLimits, AgentMachine, GameLimits, RuntimeInventory, StageId, StageName, TournamentId,
};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Runtimes and resource limits of agents on this server.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RuntimesView {
    /// The ruleset of current evaluations.
    #[schema(example = "airhockey-2023.3")]
    pub ruleset: String,
    /// The runtimes that `agent.toml` can name, with the packages found at the server's start; empty in an archived season.
    pub runtimes: Vec<RuntimeInventory>,
    /// CPUs of the machines that run agents.
    pub machine: AgentMachine,
    /// Agents have no GPU.
    #[schema(example = "none")]
    pub gpu: Absent,
    /// Agents have no network, only an empty loopback interface.
    #[schema(example = "none")]
    pub network: Absent,
    /// Resource limits from the server's configuration. A stage or tournament may override them.
    pub limits: AgentLimits,
    /// Stages that have not ended, in order of their opening.
    pub stages: Vec<StageResources>,
    /// Tournaments that are not closed, in order of creation.
    pub tournaments: Vec<TournamentResources>,
}

/// Agents do not have this resource.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Absent {
    /// Not available.
    None,
}

/// Runtimes and resource limits of agents in a stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StageResources {
    /// Id of the stage.
    pub id: StageId,
    /// Name of the stage.
    pub name: StageName,
    /// The stage's phase.
    pub phase: PhaseView,
    /// Names of the runtimes that the stage accepts.
    pub runtimes: Vec<String>,
    /// All limits: the stage's own, and the server's for the rest.
    pub limits: AgentLimits,
}

/// Runtimes and resource limits of agents in a tournament.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TournamentResources {
    /// Id of the tournament.
    pub id: TournamentId,
    /// Name of the tournament.
    pub name: StageName,
    /// Names of the runtimes that the tournament accepts.
    pub runtimes: Vec<String>,
    /// All limits: the tournament's own, and the server's for the rest.
    pub limits: AgentLimits,
    /// Further limits of each side of a game.
    pub game_limits: GameLimits,
}
