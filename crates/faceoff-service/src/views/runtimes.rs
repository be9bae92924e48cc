//! Runtimes and resource limits of agents, for the server and for each stage and tournament. A *runtime* is an environment in which an
//! agent runs, for example Python with its packages.

use crate::{app::AppState, boxed_future, problem::Problem, views::stage};
use faceoff_api::views::{
    runtimes::{Absent, RuntimesView, StageResources, TournamentResources},
    stage::PhaseView,
};
use faceoff_types::{RuntimeContent, RuntimeInventory, Runtimes};

/// The current runtimes and limits.
#[boxed_future]
pub async fn build(app: &AppState) -> Result<RuntimesView, Problem> {
    let resources = &app.config.agent_resources;
    let aborted = || Problem::internal("the inspection of the runtimes was aborted");
    let inventories = resources.inventories().await.ok_or_else(aborted)?;
    let runtimes: Vec<_> = inventories.iter().map(public_inventory).collect();
    // Names of the runtimes that a stage or tournament accepts; `None`: all.
    let accepted_names = |selection: Option<&Runtimes>| -> Vec<String> {
        let names = runtimes.iter().map(|runtime| &runtime.name);
        names
            .filter(|name| selection.is_none_or(|selection| selection.contains(name)))
            .cloned()
            .collect()
    };
    let now = app.config.clock.now();
    let mut stages = Vec::new();
    for stage in app.store.stages().await? {
        let phase = stage::phase(stage.phase(now));
        if phase == PhaseView::Closed || stage.sign_off.is_some() {
            continue;
        }
        let rules = &stage.revision.rules;
        stages.push(StageResources {
            runtimes: accepted_names(rules.runtimes.as_ref()),
            limits: rules.limits.apply_to(&resources.limits),
            id: stage.id,
            name: stage.name,
            phase,
        });
    }
    let tournaments = app.store.tournaments().await?.into_iter();
    let tournaments = tournaments.filter(|tournament| tournament.closed_at.is_none());
    Ok(RuntimesView {
        ruleset: app.config.competition().ruleset().to_string(),
        machine: resources.machine.clone(),
        gpu: Absent::None,
        network: Absent::None,
        limits: resources.limits.clone(),
        stages,
        tournaments: tournaments
            .map(|tournament| TournamentResources {
                id: tournament.id,
                name: tournament.name,
                runtimes: accepted_names(tournament.rules.runtimes.as_ref()),
                limits: tournament.rules.limits.apply_to(&resources.limits),
                game_limits: tournament.rules.game_limits,
            })
            .collect(),
        runtimes,
    })
}

/// Hides why a runtime does not work: the reason may contain the host's folders.
fn public_inventory(runtime: &RuntimeInventory) -> RuntimeInventory {
    match &runtime.content {
        RuntimeContent::Failed { .. } => RuntimeInventory {
            name: runtime.name.clone(),
            content: RuntimeContent::Failed {
                reason:
                    "it does not work; the server's log and `faceoff doctor` show the reason to the organisers"
                        .to_owned(),
            },
        },
        _ => runtime.clone(),
    }
}
