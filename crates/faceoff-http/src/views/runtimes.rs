//! What agents find on this server: runtimes with their packages, and limits, contest by contest.

use super::stage::PhaseView;
use crate::{app::AppState, problem::Problem};
use faceoff_types::{
    AgentLimits, AgentMachine, GameLimits, RULESET, RuntimeContent, RuntimeInventory, Runtimes,
    StageId, StageName, TournamentId,
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

impl RuntimesView {
    pub(crate) async fn now(app: &AppState) -> Result<Self, Problem> {
        let offer = &app.config.offer;
        let gave_up = || Problem::internal("the runtimes were not looked into to the end");
        let found = offer.inventories().await.ok_or_else(gave_up)?;
        let runtimes: Vec<_> = found.iter().map(public).collect();
        let taken = |by: Option<&Runtimes>| -> Vec<String> {
            let names = runtimes.iter().map(|runtime| &runtime.name);
            names
                .filter(|name| by.is_none_or(|by| by.contains(name)))
                .cloned()
                .collect()
        };
        let now = app.config.clock.now();
        let mut stages = Vec::new();
        for stage in app.store.stages().await? {
            let phase = PhaseView::from(stage.phase(now));
            if phase == PhaseView::Closed || stage.finalised.is_some() {
                continue;
            }
            let rules = &stage.rules.rules;
            stages.push(StageOffer {
                runtimes: taken(rules.runtimes.as_ref()),
                limits: rules.limits.over(&offer.limits),
                id: stage.id,
                name: stage.name,
                phase,
            });
        }
        let tournaments = app.store.tournaments().await?.into_iter();
        let tournaments = tournaments.filter(|one| one.closed_at.is_none());
        Ok(Self {
            ruleset: RULESET.to_owned(),
            machine: offer.machine.clone(),
            gpu: Absent::None,
            network: Absent::None,
            limits: offer.limits.clone(),
            stages,
            tournaments: tournaments
                .map(|tournament| TournamentOffer {
                    id: tournament.id,
                    name: tournament.name,
                    runtimes: taken(tournament.rules.runtimes.as_ref()),
                    limits: tournament.rules.limits.over(&offer.limits),
                    game_limits: tournament.rules.game_limits,
                })
                .collect(),
            runtimes,
        })
    }
}

/// Why a runtime does not work may name the host's folders.
fn public(runtime: &RuntimeInventory) -> RuntimeInventory {
    match &runtime.content {
        RuntimeContent::Broken { .. } => RuntimeInventory {
            name: runtime.name.clone(),
            content: RuntimeContent::Broken {
                why:
                    "it does not work; the server's log and `faceoff doctor` tell the organiser why"
                        .to_owned(),
            },
        },
        _ => runtime.clone(),
    }
}
