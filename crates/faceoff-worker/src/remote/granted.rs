//! What an order opens, and what comes of it within that.

use super::checked::Checks;
use crate::{
    local::LocalServer,
    server::{GivenBack, Holding, WorkServer},
};
use faceoff_store::StoreError;
use faceoff_wire::{
    grant::{Grant, GrantKey, Plays, Writes},
    remote::{Outcome, RemoteOutcome},
    work::{Assignment, Keeps, Lease, WorkOrder, WorkReport},
};

/// What an order opens that this program gives out.
pub(super) fn grant_of(order: &WorkOrder, program: &str) -> Grant {
    let (bundles, writes, plays) = match &order.assignment {
        Assignment::Play {
            agent, keeps, spec, ..
        } => {
            let (writes, plays) = match keeps {
                Keeps::Nothing => (Writes::Nothing, Plays::Nothing),
                Keeps::Clips(key) => (Writes::File(key.clone()), Plays::Nothing),
                Keeps::Recording(key) => (Writes::Folder(key.clone()), Plays::Shard(spec.clone())),
            };
            (vec![agent.bundle.clone()], writes, plays)
        }
        Assignment::Game {
            agents,
            recording,
            spec,
            ..
        } => {
            let bundles = agents.each_ref().map(|agent| agent.bundle.clone());
            let (writes, plays) = match recording {
                Some(key) => (Writes::Folder(key.clone()), Plays::Game(spec.clone())),
                None => (Writes::Nothing, Plays::Nothing),
            };
            (bundles.into(), writes, plays)
        }
        Assignment::Smoke { .. } | Assignment::Finalise { .. } => {
            (Vec::new(), Writes::Nothing, Plays::Nothing)
        }
    };
    Grant {
        unit: order.lease.unit,
        nonce: order.lease.nonce,
        bundles,
        writes,
        plays,
        program: program.to_owned(),
    }
}

/// What became of an outcome.
pub(super) enum Taken {
    Held,
    /// It is of no order that is its worker's.
    Lost,
    /// It does not fit its order, which is given back: a fault of ours.
    Unusable,
    /// It is not what the simulator gives; the words are for organisers.
    Disbelieved(String),
    /// A file of it is still on its way.
    StillComing,
}

impl From<Holding> for Taken {
    fn from(holding: Holding) -> Self {
        match holding {
            Holding::Held => Self::Held,
            Holding::Lost => Self::Lost,
        }
    }
}

/// The order that an outcome is of, if it is of one.
pub(super) fn of_its_order(outcome: &RemoteOutcome, key: &GrantKey) -> Option<Grant> {
    let lease = &outcome.lease;
    Grant::open(&outcome.grant, key)
        .filter(|grant| grant.unit == lease.unit && grant.nonce == lease.nonce)
}

/// Stores an outcome of this order, if it is to be believed. One that does not fit its order is a fault of ours, and ends nobody else's work.
pub(super) fn store(
    server: &LocalServer,
    checks: &Checks,
    grant: &Grant,
    outcome: RemoteOutcome,
) -> anyhow::Result<Taken> {
    let RemoteOutcome { lease, outcome, .. } = outcome;
    let given_back = match outcome {
        Outcome::Done { report } => return done(server, checks, grant, &lease, *report),
        Outcome::Shutdown => server.give_back(&lease, GivenBack::Shutdown),
        Outcome::FullDisk => server.give_back(&lease, GivenBack::FullDisk),
        Outcome::PlatformFault { reason } => {
            server.give_back(&lease, GivenBack::PlatformFault(&reason))
        }
    };
    given_back.map(|()| Taken::Held)
}

fn done(
    server: &LocalServer,
    checks: &Checks,
    grant: &Grant,
    lease: &Lease,
    report: WorkReport,
) -> anyhow::Result<Taken> {
    if !is_of(&report, grant) {
        tracing::error!(unit = %lease.unit, slot = lease.slot, "a worker's report is not of its order");
        let why = GivenBack::PlatformFault("a worker's report was not of its order");
        server.give_back(lease, why)?;
        return Ok(Taken::Unusable);
    }
    // What was stored before, or is another's by now, needs no look; its files may be gone.
    if server.is_held(lease)? {
        if !server.store.workers().close_files(lease.nonce) {
            return Ok(Taken::StillComing);
        }
        if let Some(difference) = checks.difference(grant, &report, server.store.artifacts())? {
            return Ok(Taken::Disbelieved(difference));
        }
    }
    match server.commit(lease, report) {
        Ok(holding) => Ok(holding.into()),
        // It would be refused again, however often it is tried.
        Err(error) if matches!(error.downcast_ref(), Some(StoreError::Conflict(_))) => {
            tracing::error!(unit = %lease.unit, slot = lease.slot, %error, "what a worker reported cannot count");
            let why = "what a worker reported does not fit its order";
            server.give_back(lease, GivenBack::PlatformFault(why))?;
            Ok(Taken::Unusable)
        }
        Err(error) => Err(error),
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
