//! What agents find on this server: runtimes with their packages, and limits, contest by contest.

use crate::{app::AppState, boxed, problem::Problem, views::stage};
use faceoff_api::views::{
    runtimes::{Absent, RuntimesView, StageOffer, TournamentOffer},
    stage::PhaseView,
};
use faceoff_types::{RULESET, RuntimeContent, RuntimeInventory, Runtimes};

/// What agents find here now.
#[boxed]
pub async fn now(app: &AppState) -> Result<RuntimesView, Problem> {
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
        let phase = stage::phase(stage.phase(now));
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
    Ok(RuntimesView {
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
