//! The server as a slot on another machine sees it: orders, questions and outcomes go by NATS, files by the server's own HTTP.

use super::{connection::ANSWER, link::Link, order_files::OrderFiles};
use crate::{
    full_disk,
    server::{Claimed, GameShow, GivenBack, Holding, QueueMark, WorkServer},
};
use anyhow::Context as _;
use async_nats::jetstream::{self, consumer::PullConsumer};
use faceoff_dataset::CLIPS_FILE;
use faceoff_types::{BundleRef, GameId};
use faceoff_wire::{
    remote::{Answer, Ask, Outcome, RemoteOrder, RemoteShow, Shown},
    work::{Lease, WorkReport},
};
use std::{
    path::Path,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};
use tokio_util::sync::CancellationToken;

/// After a refusal or a failure, until it is asked again.
pub(super) const REST: Duration = Duration::from_secs(2);
/// A worker without room leaves the queue to others for so long; what it gives back rests there, and it would make all of it rest.
const FULL_DISK_REST: Duration = Duration::from_secs(10);

/// The server of one slot.
pub(super) struct FarServer {
    pub(super) link: Arc<Link>,
    pub(super) jetstream: jetstream::Context,
    /// What orders are asked of, while it answers.
    pub(super) consumer: Mutex<Option<PullConsumer>>,
    current: Mutex<Current>,
    /// When there was last no room for something.
    full_at: Mutex<Option<Instant>>,
}

/// What the slot works at.
#[derive(Debug, Default)]
struct Current {
    files: Arc<OrderFiles>,
    /// When the server last said that it is this slot's.
    held_at: Option<Instant>,
    /// It is no longer this slot's.
    is_lost: bool,
    /// What keeps it from being handed in.
    trouble: Option<String>,
}

impl FarServer {
    pub(super) fn new(link: Arc<Link>) -> Self {
        Self {
            jetstream: jetstream::new(link.client.clone()),
            link,
            consumer: Mutex::default(),
            current: Mutex::default(),
            full_at: Mutex::default(),
        }
    }

    /// Had this slot no room just now?
    fn is_without_room(&self) -> bool {
        let full_at = self.full_at.lock().unwrap_or_else(PoisonError::into_inner);
        full_at.is_some_and(|at| at.elapsed() < FULL_DISK_REST)
    }

    fn current(&self) -> MutexGuard<'_, Current> {
        self.current.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Is what it works at no longer its own? At the end of this worker it is given back.
    pub(super) fn has_ended(&self) -> bool {
        self.current().is_lost || self.link.shutdown.is_cancelled()
    }

    /// What is played cannot be handed in, and why; the server is told when it is asked next.
    pub(super) fn cannot_hand_in(&self, cause: &str) {
        self.current().trouble = Some(cause.to_owned());
    }

    /// Those of what it works at.
    fn files(&self) -> Arc<OrderFiles> {
        Arc::clone(&self.current().files)
    }

    async fn store(&self, name: &str, file: &Path) -> anyhow::Result<()> {
        let (files, by) = (self.files(), &self.link.carrier);
        files.store(by, name, file, || self.has_ended()).await
    }

    pub(super) async fn rest(&self) {
        tokio::select! {
            () = self.link.shutdown.cancelled() => {}
            () = tokio::time::sleep(REST) => {}
        }
    }
}

impl WorkServer for FarServer {
    fn claim(&self, slot: &str) -> anyhow::Result<Claimed> {
        // NATS wakes who waits here: there is no queue to look at.
        let queue = QueueMark(0);
        self.link.runtime.block_on(async {
            if self.is_without_room() {
                self.rest().await;
                return Ok(Claimed::Nothing { queue });
            }
            match self.may_work().await {
                Ok(true) => {}
                Ok(false) => {
                    self.rest().await;
                    return Ok(Claimed::Nothing { queue });
                }
                Err(error) => {
                    self.rest().await;
                    return Err(error);
                }
            }
            let order = match self.order(slot).await {
                Ok(order) => order,
                Err(error) => {
                    *self.consumer.lock().unwrap_or_else(PoisonError::into_inner) = None;
                    self.rest().await;
                    return Err(error);
                }
            };
            let Some(RemoteOrder {
                order,
                grant,
                files,
                objects,
                ..
            }) = order
            else {
                return Ok(Claimed::Nothing { queue });
            };
            self.link.is_busy();
            *self.current() = Current {
                files: Arc::new(OrderFiles {
                    grant,
                    server: files,
                    objects,
                }),
                held_at: Some(Instant::now()),
                is_lost: false,
                trouble: None,
            };
            Ok(Claimed::Order(Box::new(order)))
        })
    }

    fn renew(&self, lease: &Lease, episodes_done: u32) -> anyhow::Result<Holding> {
        self.link.is_busy();
        let ask = Ask::Renew {
            lease: lease.clone(),
            episodes_done,
            trouble: self.current().trouble.clone(),
        };
        let answer = self.link.runtime.block_on(self.link.ask(&ask));
        match answer {
            Ok(Answer::Yes) => {
                self.current().held_at = Some(Instant::now());
                Ok(Holding::Held)
            }
            Ok(Answer::No { .. }) => {
                self.current().is_lost = true;
                Ok(Holding::Lost)
            }
            Ok(Answer::Unknown) | Err(_) => {
                let held_at = self.current().held_at;
                let cut_off = Duration::from_secs(lease.duration_s.into());
                if held_at.is_some_and(|at| at.elapsed() > cut_off) {
                    tracing::error!(unit = %lease.unit, "nothing was heard of the server for as long as the lease is: this worker stops");
                    self.current().is_lost = true;
                    return Ok(Holding::Lost);
                }
                answer
                    .map(|_| Holding::Held)
                    .and_then(|_| anyhow::bail!("the server cannot tell now"))
            }
        }
    }

    fn renews_every(&self, _: &Lease) -> Duration {
        // So soon a worker hears that its work is not wanted any more.
        Duration::from_millis(500)
    }

    fn show(&self, lease: &Lease, (game, attempt): (GameId, u32), show: GameShow) {
        let shown = match show {
            GameShow::Begun { steps } => Shown::Begun { steps },
            GameShow::Goes {
                happenings,
                position,
            } => Shown::Goes {
                happenings,
                position,
            },
            GameShow::Over => Shown::Over,
        };
        let show = RemoteShow {
            lease: lease.clone(),
            game,
            attempt,
            shown,
        };
        self.link.runtime.block_on(self.link.show(&show));
    }

    fn commit(&self, lease: &Lease, report: WorkReport) -> anyhow::Result<Holding> {
        let (report, files) = (Box::new(report), self.files());
        let episodes_done = report.episodes();
        let holding = self.link.runtime.block_on(async {
            let sent = self.send(lease, &files.grant, Outcome::Done { report });
            let Some(sequence) = sent.await? else {
                return anyhow::Ok(Holding::Lost);
            };
            let handed_in = Ask::HandedIn {
                lease: lease.clone(),
                episodes_done,
                sequence,
            };
            // From now on the server keeps the lease. If it does not hear of that, there is what is left of it.
            if let Err(error) = self.link.ask(&handed_in).await {
                tracing::debug!(%error, "the server was not told that an outcome waits for it");
            }
            anyhow::Ok(Holding::Held)
        })?;
        self.link.is_busy();
        Ok(holding)
    }

    fn give_back(&self, lease: &Lease, why: GivenBack<'_>) -> anyhow::Result<()> {
        let outcome = match why {
            GivenBack::Shutdown => Outcome::Shutdown,
            GivenBack::FullDisk => {
                let mut full_at = self.full_at.lock().unwrap_or_else(PoisonError::into_inner);
                *full_at = Some(Instant::now());
                Outcome::FullDisk
            }
            GivenBack::PlatformFault(reason) => Outcome::PlatformFault {
                reason: reason.to_owned(),
            },
        };
        let files = self.files();
        self.link.runtime.block_on(async {
            let sent = tokio::time::timeout(ANSWER, self.send(lease, &files.grant, outcome));
            sent.await.context("telling the server")?.map(drop)
        })
    }

    fn met_full_disk(&self, error: &anyhow::Error) -> bool {
        full_disk::is_told_by(error)
    }

    fn wait(&self, stop: &CancellationToken, at_most: Duration, queue: Option<QueueMark>) {
        // Who asks for an order has waited already.
        if queue.is_some() {
            return;
        }
        self.link.runtime.block_on(async {
            tokio::select! {
                () = stop.cancelled() => {}
                () = tokio::time::sleep(at_most) => {}
            }
        });
    }

    fn fetch_bundle(&self, bundle: &BundleRef, archive: &Path) -> anyhow::Result<()> {
        let (files, by) = (self.files(), &self.link.carrier);
        let fetched = files.fetch_bundle(by, bundle, archive, || self.has_ended());
        self.link.runtime.block_on(fetched)
    }

    fn fetch_recording(&self, key: &str, _: &Path) -> anyhow::Result<()> {
        anyhow::bail!("no order to another machine asks for the recording {key}")
    }

    fn store_recording(&self, _: &str, folder: &Path) -> anyhow::Result<()> {
        self.link.runtime.block_on(async {
            let mut entries = tokio::fs::read_dir(folder).await?;
            while let Some(entry) = entries.next_entry().await? {
                let name = entry.file_name();
                let name = name.to_str().context("a recording's file without a name")?;
                self.store(name, &entry.path()).await?;
            }
            Ok(())
        })
    }

    fn store_clips(&self, _: &str, clips: &Path) -> anyhow::Result<()> {
        self.link.runtime.block_on(self.store(CLIPS_FILE, clips))
    }

    fn store_dataset(&self, key: &str, _: &Path, _: Option<&Path>) -> anyhow::Result<()> {
        anyhow::bail!("no order to another machine asks for the dataset {key}")
    }
}
