//! Configuration of the web server: limits, addresses, keys, and what it shows about the machines that run jobs.

use crate::{
    agent_resources::AgentResources, download::Downloads, link_key::LinkKey,
    rate_limits::RateLimits, transfer_rate::MinTransferRate,
};
use faceoff_episode::Simulator;
use faceoff_metrics::{Metrics, Process};
use faceoff_notify::WebhookRules;
use faceoff_store::UploadQuota;
use faceoff_types::{Clock, Competition, TimeLimits};
use std::{path::PathBuf, sync::Arc, time::Duration};

/// Limits and timeouts of the web server.
#[derive(Debug, Clone, Copy)]
pub struct HttpLimits {
    /// Requests that are handled at the same time; further ones get 503.
    pub requests: usize,
    /// Uploads of one team at the same time; each one writes to disk.
    pub team_uploads: usize,
    /// Readers of live games at the same time; each one holds a connection.
    pub live_readers: usize,
    /// Readers of the event stream at the same time; each one holds a connection.
    pub event_readers: usize,
    /// Longest duration of a request that is not an upload or the download of a season archive.
    pub request_timeout: Duration,
    /// Minimum transfer rate of an upload.
    pub min_upload_rate: MinTransferRate,
    /// Submissions of one team that may wait for their validation run.
    pub pending_submissions: usize,
    /// Bytes that a team may upload per day, and bytes that it may store in total.
    pub upload_quota: UploadQuota,
}

impl Default for HttpLimits {
    fn default() -> Self {
        Self {
            requests: 512,
            team_uploads: 2,
            live_readers: 256,
            event_readers: 512,
            request_timeout: Duration::from_secs(30),
            min_upload_rate: MinTransferRate {
                bytes_per_s: 1 << 10,
                grace: Duration::from_secs(30),
            },
            pending_submissions: 5,
            upload_quota: UploadQuota::default(),
        }
    }
}

/// The slots and runtimes for evaluations, as far as the web server shows them. A *slot* runs one job at a time.
#[derive(Debug, Clone)]
pub struct Capacity {
    /// Jobs that the server's own slots run in parallel; 0: only remote workers run jobs.
    pub slots: u32,
    /// Limits of an agent's computation time.
    pub time: TimeLimits,
    /// Simulated duration of the competition's longest episode, in seconds.
    pub longest_episode_s: f64,
    /// Names of the runtimes (environments such as Python) that an agent may ask for.
    pub runtimes: Vec<String>,
}

/// Everything that the handlers need besides the store.
#[derive(Debug, Clone)]
pub struct HttpConfig {
    /// The tasks and violations of its competition are the columns of boards and files.
    pub simulator: Arc<dyn Simulator>,
    /// Largest packed bundle, in bytes.
    pub max_bundle_bytes: u64,
    /// The server's public URL without a trailing slash. Links begin with it; if it begins with https, cookies are sent
    /// over TLS only. `None`: links are paths.
    pub public_url: Option<String>,
    /// Files that visitors can download to develop agents.
    pub downloads: Arc<Downloads>,
    /// Address of the server's source code.
    pub source_url: Option<String>,
    /// Existing folder for unfinished uploads, on a disk with space for some bundles.
    pub upload_dir: PathBuf,
    /// Source of the current time: tests set it.
    pub clock: Clock,
    pub limits: HttpLimits,
    /// Which addresses webhooks may have.
    pub webhooks: WebhookRules,
    /// Slots and time limits, for forecasts of durations.
    pub capacity: Capacity,
    /// Runtimes and resource limits of agents.
    pub agent_resources: AgentResources,
    /// Rate limits of requests.
    pub rate_limits: RateLimits,
    /// Signs download links and seals grants of remote jobs.
    pub link_key: LinkKey,
    pub metrics: Metrics,
    /// Reads the resource usage of this process from the operating system.
    pub process: fn() -> Process,
}

impl HttpConfig {
    /// The competition of the season.
    #[must_use]
    pub fn competition(&self) -> &Arc<Competition> {
        self.simulator.competition()
    }
}
