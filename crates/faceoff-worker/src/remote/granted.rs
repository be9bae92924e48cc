//! What an order opens, and what comes of it within that.

use super::names;
use crate::{
    local::LocalServer,
    server::{GivenBack, Holding, WorkServer},
};
use faceoff_wire::{
    grant::{Grant, GrantKey, Writes},
    remote::{Outcome, RemoteOutcome},
    work::{Assignment, Keeps, WorkOrder, WorkReport},
};

/// What an order opens.
pub(super) fn grant_of(order: &WorkOrder) -> Grant {
    let (bundles, writes) = match &order.assignment {
        Assignment::Play { agent, keeps, .. } => {
            let writes = match keeps {
                Keeps::Nothing => Writes::Nothing,
                Keeps::Clips(key) => Writes::File(key.clone()),
                Keeps::Recording(key) => Writes::Folder(key.clone()),
            };
            (vec![agent.bundle.clone()], writes)
        }
        Assignment::Game {
            agents, recording, ..
        } => {
            let bundles = agents.each_ref().map(|agent| agent.bundle.clone());
            let writes = match recording {
                Some(key) => Writes::Folder(key.clone()),
                None => Writes::Nothing,
            };
            (bundles.into(), writes)
        }
        Assignment::Smoke { .. } | Assignment::Finalise { .. } => (Vec::new(), Writes::Nothing),
    };
    Grant {
        unit: order.lease.unit,
        nonce: order.lease.nonce,
        bundles,
        writes,
    }
}

/// Stores an outcome, if it is of its order. One that is not is a fault of ours, and ends nobody else's work.
pub(super) fn store(
    server: &LocalServer,
    key: &GrantKey,
    worker: &str,
    outcome: RemoteOutcome,
) -> anyhow::Result<Holding> {
    let RemoteOutcome {
        mut lease,
        grant,
        outcome,
    } = outcome;
    if !lease.slot.starts_with(&names::slot(worker, "")) {
        lease.slot = names::slot(worker, "?");
    }
    let opened = Grant::open(&grant, key)
        .filter(|grant| grant.unit == lease.unit && grant.nonce == lease.nonce);
    let Some(grant) = opened else {
        tracing::error!(unit = %lease.unit, worker, "a worker sent an outcome without the order that it is of; it is left out");
        return Ok(Holding::Lost);
    };
    match outcome {
        Outcome::Done { report } if is_of(&report, &grant) => server.commit(&lease, *report),
        Outcome::Done { .. } => {
            tracing::error!(unit = %lease.unit, worker, "a worker's report is not of its order");
            server.give_back(
                &lease,
                GivenBack::PlatformFault("a worker's report was not of its order"),
            )?;
            Ok(Holding::Lost)
        }
        Outcome::Shutdown => {
            server.give_back(&lease, GivenBack::Shutdown)?;
            Ok(Holding::Held)
        }
        Outcome::FullDisk => {
            server.give_back(&lease, GivenBack::FullDisk)?;
            Ok(Holding::Held)
        }
        Outcome::PlatformFault { reason } => {
            server.give_back(&lease, GivenBack::PlatformFault(&reason))?;
            Ok(Holding::Held)
        }
    }
}

/// Does a report name what its order lets it?
fn is_of(report: &WorkReport, grant: &Grant) -> bool {
    match (report, &grant.writes) {
        (
            WorkReport::Play {
                recording: Some(key),
                ..
            },
            Writes::Folder(granted),
        ) => key == granted,
        (
            WorkReport::Play {
                recording: None, ..
            },
            Writes::Nothing | Writes::File(_),
        ) => true,
        (
            WorkReport::Game {
                recording: Some(stored),
                ..
            },
            Writes::Folder(granted),
        ) => stored.key == *granted,
        (
            WorkReport::Game {
                recording: None, ..
            },
            Writes::Nothing,
        ) => true,
        _ => false,
    }
}
