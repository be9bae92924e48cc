//! A connection between slots and their server that a test can disturb.

use crate::{
    local::LocalServer,
    server::{Claimed, GameShow, GivenBack, Holding, QueueMark, WorkServer},
};
use faceoff_types::{BundleRef, GameId};
use faceoff_wire::work::{Lease, WorkReport};
use std::{path::Path, sync::Arc, time::Duration};
use tokio_util::sync::CancellationToken;

/// What a test hears of, and may answer with an error.
pub(super) enum Moment<'a> {
    /// The server has stored this; the slot has not heard of it yet.
    Committed(&'a WorkReport),
    /// A unit is about to be given back.
    GivingBack,
}

type Disturb = dyn Fn(Moment<'_>) -> anyhow::Result<()> + Send + Sync;

pub(super) struct Between {
    server: LocalServer,
    disturb: Box<Disturb>,
}

impl Between {
    pub(super) fn slots_and(
        server: LocalServer,
        disturb: impl Fn(Moment<'_>) -> anyhow::Result<()> + Send + Sync + 'static,
    ) -> Arc<dyn WorkServer> {
        Arc::new(Self {
            server,
            disturb: Box::new(disturb),
        })
    }
}

impl WorkServer for Between {
    fn claim(&self, slot: &str) -> anyhow::Result<Claimed> {
        self.server.claim(slot)
    }

    fn renew(&self, lease: &Lease, episodes_done: u32) -> anyhow::Result<Holding> {
        self.server.renew(lease, episodes_done)
    }

    fn show(&self, lease: &Lease, attempt: (GameId, u32), show: GameShow) {
        self.server.show(lease, attempt, show);
    }

    fn commit(&self, lease: &Lease, report: WorkReport) -> anyhow::Result<Holding> {
        let holding = self.server.commit(lease, report.clone())?;
        (self.disturb)(Moment::Committed(&report))?;
        Ok(holding)
    }

    fn give_back(&self, lease: &Lease, why: GivenBack<'_>) -> anyhow::Result<()> {
        (self.disturb)(Moment::GivingBack)?;
        self.server.give_back(lease, why)
    }

    fn met_full_disk(&self, error: &anyhow::Error) -> bool {
        self.server.met_full_disk(error)
    }

    fn wait(&self, stop: &CancellationToken, at_most: Duration, queue: Option<QueueMark>) {
        self.server.wait(stop, at_most, queue);
    }

    fn fetch_bundle(&self, bundle: &BundleRef, archive: &Path) -> anyhow::Result<()> {
        self.server.fetch_bundle(bundle, archive)
    }

    fn fetch_recording(&self, key: &str, folder: &Path) -> anyhow::Result<()> {
        self.server.fetch_recording(key, folder)
    }

    fn store_recording(&self, key: &str, folder: &Path) -> anyhow::Result<()> {
        self.server.store_recording(key, folder)
    }

    fn store_clips(&self, key: &str, clips: &Path) -> anyhow::Result<()> {
        self.server.store_clips(key, clips)
    }

    fn store_dataset(&self, key: &str, archive: &Path, clips: Option<&Path>) -> anyhow::Result<()> {
        self.server.store_dataset(key, archive, clips)
    }
}
