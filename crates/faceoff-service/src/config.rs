//! How the web side is configured.

use crate::{link_key::LinkKey, offer::Offer, pace::LeastRate, rates::RateLimits};
use faceoff_metrics::{Metrics, Process};
use faceoff_notify::WebhookRules;
use faceoff_store::UploadQuota;
use faceoff_types::{Clock, TimeLimits};
use std::{path::PathBuf, time::Duration};

/// How much the web side takes on at a time, and how long it waits.
#[derive(Debug, Clone, Copy)]
pub struct HttpLimits {
    /// Requests being answered at the same time; more are told to come back.
    pub requests: usize,
    /// Uploads of one team at the same time; each one writes to disk.
    pub team_uploads: usize,
    /// Readers of games under way at the same time, each of whom holds a connection.
    pub live_readers: usize,
    /// Readers of the stream of events at the same time, each of whom holds a connection.
    pub event_readers: usize,
    /// Longest time to answer a request that is no upload.
    pub answer: Duration,
    /// How fast the body of an upload must come.
    pub upload_rate: LeastRate,
    /// Uploads of one team that may wait for their smoke run.
    pub pending_submissions: usize,
    /// How much a team may upload and keep.
    pub upload_quota: UploadQuota,
}

impl Default for HttpLimits {
    fn default() -> Self {
        Self {
            requests: 512,
            team_uploads: 2,
            live_readers: 256,
            event_readers: 512,
            answer: Duration::from_secs(30),
            upload_rate: LeastRate {
                bytes_per_s: 16 << 10,
                grace: Duration::from_secs(30),
            },
            pending_submissions: 5,
            upload_quota: UploadQuota::default(),
        }
    }
}

/// What evaluates, as far as the web side tells of it.
#[derive(Debug, Clone)]
pub struct Capacity {
    /// Units of work that the server's own slots play at the same time; 0: others play.
    pub slots: u32,
    /// How long an agent may take.
    pub time: TimeLimits,
    /// The runtimes that agents may name.
    pub runtimes: Vec<String>,
}

/// What [`router`](crate::router) needs besides the store.
#[derive(Debug, Clone)]
pub struct HttpConfig {
    /// Largest packed bundle, in bytes.
    pub max_bundle_bytes: u64,
    /// Where people reach the server, without a slash at its end; links begin with it, and by https cookies are sent
    /// over TLS only. None: links are paths.
    pub public_url: Option<String>,
    /// Existing folder for uploads under way, on a disk with room for some bundles.
    pub upload_dir: PathBuf,
    /// Stamps what is written, and tells which day it is.
    pub clock: Clock,
    pub limits: HttpLimits,
    /// Where webhooks may be.
    pub webhooks: WebhookRules,
    /// Tells how long what waits will take.
    pub capacity: Capacity,
    /// What agents find here.
    pub offer: Offer,
    /// How often somebody may ask.
    pub rates: RateLimits,
    /// What links are signed with.
    pub link_key: LinkKey,
    pub metrics: Metrics,
    /// What the operating system counts of this process.
    pub process: fn() -> Process,
}
