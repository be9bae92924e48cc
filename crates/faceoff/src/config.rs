//! The configuration: one TOML file in which every field may be left out.
//!
//! The defaults are the `Default` implementations of the sections and of their types. Tests compare the commented file and
//! the documentation (`docs/configuration.md`) with them.

use crate::competition::{competition, simulator};
use anyhow::{Context, anyhow};
use faceoff_http::{ConnectionLimits, HttpLimits, MinTransferRate, ProxyNetwork};
use faceoff_notify::WebhookRules;
use faceoff_runner::{AgentEnvironment, Supervision, TimeLimits, bundle::BundleLimits};
use faceoff_sandbox::{Isolation, Layer, Limits, Runtime};
use faceoff_store::UploadQuota;
use faceoff_types::{
    CountingResult, DayDeadline, IanaTimeZone, InvalidSchedule, Magnitudes, Profile, Publication,
    Schedule, StageRules, StageSettings, Task, TaskWeights, TierBounds, Variation,
};
use jiff::civil::{Date, Time};
use reqwest::header::HeaderName;
use serde::{Deserialize, Serialize};
use std::{
    collections::BTreeMap,
    io::ErrorKind,
    net::SocketAddr,
    path::{Path, PathBuf},
    str::FromStr as _,
};

/// The file that is read by default, if it exists.
pub const DEFAULT_FILE: &str = "faceoff.toml";

/// The defaults with units and meanings, written by `faceoff init`.
pub const COMMENTED_DEFAULTS: &str = include_str!("config/faceoff.toml");

#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Address and data folder.
    pub server: ServerConfig,
    /// Name of the season.
    pub season: SeasonConfig,
    pub evaluation: EvaluationConfig,
    /// Worker slots of this machine.
    pub workers: WorkersConfig,
    /// Remote workers.
    pub nats: NatsSection,
    /// Resource limits of an agent's process tree.
    pub limits: Limits,
    /// Time limits of agents.
    pub time: TimeLimits,
    /// Size limits of bundles.
    pub bundle: BundleLimits,
    /// Limits of uploads per team.
    pub uploads: UploadsConfig,
    /// Limits of connections per client.
    pub connections: ConnectionsConfig,
    /// Limits of request rates.
    pub rates: RatesConfig,
    /// Allowed addresses of webhooks.
    pub webhooks: WebhookRules,
    /// Isolation of agents.
    pub sandbox: SandboxConfig,
    /// Runtimes by their name in `agent.toml`, in addition to `python3` and `native` or instead of
    /// them.
    pub runtimes: BTreeMap<String, RuntimeConfig>,
}

/// `[server]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ServerConfig {
    /// Address of API and pages. Bind a public address only behind a proxy that provides TLS.
    pub listen: SocketAddr,
    /// Public address of the server, for links: http or https, without a trailing slash.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub public_url: Option<String>,
    /// Folder with further files for `/downloads`, such as the Python package; left out: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub downloads_dir: Option<PathBuf>,
    /// Address of the source code, for the page `/downloads`; left out: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source_url: Option<String>,
    /// Address of metrics and health checks without a token; left out: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub metrics_listen: Option<SocketAddr>,
    /// Folder of the database, the artifacts and the operator's token.
    pub data_dir: PathBuf,
    /// Bytes that must stay free on the disks of `data_dir` and `workers.scratch_dir`; below, the queue
    /// pauses and uploads are refused. 0: never.
    pub min_free_bytes: u64,
}

impl Default for ServerConfig {
    fn default() -> Self {
        Self {
            listen: SocketAddr::from(([127, 0, 0, 1], 8080)),
            public_url: None,
            downloads_dir: None,
            source_url: None,
            metrics_listen: None,
            data_dir: PathBuf::from("faceoff-data"),
            min_free_bytes: 1 << 30,
        }
    }
}

/// `[season]`
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SeasonConfig {
    /// The season's name; left out, the name in the data folder remains (initially “Season 1”).
    pub name: Option<String>,
}

/// `[evaluation]`: rules and settings of the season's first *stage*, a period with its own board, until they are changed through
/// the API. At a *cutoff*, an evaluation of each team's submission starts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EvaluationConfig {
    pub profile: Profile,
    pub tasks: Vec<Task>,
    /// Episodes per task.
    pub episodes_per_task: u32,
    /// Episodes per shard, the job that one slot runs at a time. Scores do not depend on it; smaller shards lose less when a
    /// worker dies, larger ones start fewer agents.
    pub episodes_per_shard: u32,
    /// Time of the daily cutoff in `zone`; left out, `cron` applies, or organisers start each day.
    pub at: Option<Time>,
    /// Times of cutoffs instead of `at`: minute, hour, day of the month, month, day of the week in `zone`.
    pub cron: Option<String>,
    /// Dates without a cutoff by `at` or `cron`.
    pub days_off: Vec<Date>,
    /// Time zone of `at` and `cron`, and of the dates of evaluation days.
    pub zone: IanaTimeZone,
    /// When the evaluations of a day end, finished or not.
    pub day_deadline: DayDeadline,
    /// Allowed agent faults; with more, an evaluation ends without a score.
    pub max_faults: u32,
    /// Episodes per task and profile of the *ablation* that the schedule starts for each submission; 0: none. An ablation
    /// evaluates the agent on the same episodes without perturbations, with each one alone, and with all.
    pub ablation_episodes: u32,
    /// Weights of the tasks' success rates in the score.
    pub weights: TaskWeights,
    /// Most penalty points per episode of the tiers (classes of agents) deployable and improvable.
    pub tier_bounds: Option<TierBounds>,
    /// Magnitudes of the perturbations that the profile (a set of perturbations) enables; left out, those of the ruleset.
    #[serde(skip_serializing_if = "Magnitudes::is_empty")]
    pub perturbations: Magnitudes,
    /// When the datasets of released days are published.
    pub publishes: Publication,
    /// The result that counts for a team's row on the board.
    pub standings: CountingResult,
}

impl Default for EvaluationConfig {
    fn default() -> Self {
        let settings = StageSettings::default();
        Self {
            profile: competition().counting_profile,
            tasks: competition().task_names().collect(),
            episodes_per_task: 1000,
            episodes_per_shard: settings.episodes_per_shard,
            at: None,
            cron: None,
            days_off: Vec::new(),
            zone: IanaTimeZone::UTC,
            day_deadline: settings.day_deadline,
            max_faults: 10,
            ablation_episodes: settings.ablation_episodes,
            weights: competition().weights(&Variation::default()),
            tier_bounds: competition().tiers,
            perturbations: Magnitudes::default(),
            publishes: settings.publishes,
            standings: settings.counting_result,
        }
    }
}

/// `[workers]`
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WorkersConfig {
    /// Slots, each of which runs one job at a time; left out, one per two CPUs after one CPU is reserved, so that an agent,
    /// its simulator and the rest of the server each have a CPU.
    pub slots: Option<usize>,
    /// Seconds after which the jobs of a dead worker are given to another one.
    pub lease_s: u32,
    /// The server's own slots run evaluations. Otherwise they only validate submissions and compute scores.
    pub play: bool,
    /// Episodes of each shard of a remote worker that are simulated again before the result is accepted; 0: none, and
    /// no games.
    pub checked_episodes: u32,
    /// CPUs that all agents share; empty: each slot has separate ones, if the host has two per slot.
    pub agent_cpus: Vec<usize>,
    /// Folder for unpacked bundles and unfinished recordings; left out, `scratch` in the data folder.
    pub scratch_dir: Option<PathBuf>,
}

impl Default for WorkersConfig {
    fn default() -> Self {
        Self {
            slots: None,
            lease_s: 30,
            play: true,
            checked_episodes: 2,
            agent_cpus: Vec::new(),
            scratch_dir: None,
        }
    }
}

/// `[uploads]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct UploadsConfig {
    /// Parallel uploads of one team.
    pub at_once: usize,
    /// Lowest mean transfer rate of an upload.
    pub least_bytes_per_s: u64,
    /// Seconds that a transfer may lag behind that rate.
    pub grace_s: f64,
    /// Bytes that a team may upload per UTC day.
    pub day_bytes: u64,
    /// Bytes of bundles that the server stores per team.
    pub stored_bytes: u64,
}

impl Default for UploadsConfig {
    fn default() -> Self {
        let HttpLimits {
            team_uploads,
            min_upload_rate,
            upload_quota,
            ..
        } = HttpLimits::default();
        Self {
            at_once: team_uploads,
            least_bytes_per_s: min_upload_rate.bytes_per_s,
            grace_s: min_upload_rate.grace.as_secs_f64(),
            day_bytes: upload_quota.day_bytes,
            stored_bytes: upload_quota.stored_bytes,
        }
    }
}

impl UploadsConfig {
    /// The limits for the HTTP server.
    #[must_use]
    pub fn limits(&self) -> HttpLimits {
        HttpLimits {
            team_uploads: self.at_once,
            min_upload_rate: MinTransferRate {
                bytes_per_s: self.least_bytes_per_s,
                grace: TimeLimits::duration(self.grace_s),
            },
            upload_quota: UploadQuota {
                day_bytes: self.day_bytes,
                stored_bytes: self.stored_bytes,
            },
            ..HttpLimits::default()
        }
    }
}

/// `[connections]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ConnectionsConfig {
    /// Most open connections, if there are enough file descriptors.
    pub most: usize,
    /// Most connections of one address or IPv6 network of 64 bits; at most a quarter of all.
    pub per_address: usize,
    /// Addresses and networks without this limit, for proxies.
    pub exempt: Vec<ProxyNetwork>,
    /// Header in which these proxies name their clients.
    pub forwarded_header: String,
    /// Seconds to send the head of a request, and to be idle between requests.
    pub head_s: f64,
    /// Lowest mean rate at which a client must read a response.
    pub least_bytes_per_s: u64,
    /// Seconds that a transfer may lag behind that rate.
    pub grace_s: f64,
}

impl Default for ConnectionsConfig {
    fn default() -> Self {
        let ConnectionLimits {
            open,
            per_address,
            exempt,
            forwarded_header,
            head_timeout,
            min_read_rate,
        } = ConnectionLimits::default();
        Self {
            most: open,
            per_address,
            exempt,
            forwarded_header: forwarded_header.to_string(),
            head_s: head_timeout.as_secs_f64(),
            least_bytes_per_s: min_read_rate.bytes_per_s,
            grace_s: min_read_rate.grace.as_secs_f64(),
        }
    }
}

impl ConnectionsConfig {
    /// The limits for the HTTP server, if there are enough file descriptors.
    #[must_use]
    pub fn limits(&self) -> ConnectionLimits {
        ConnectionLimits {
            open: self.most,
            per_address: self.per_address,
            exempt: self.exempt.clone(),
            // The configuration was checked.
            forwarded_header: HeaderName::from_str(&self.forwarded_header)
                .unwrap_or(ConnectionLimits::default().forwarded_header),
            head_timeout: TimeLimits::duration(self.head_s),
            min_read_rate: MinTransferRate {
                bytes_per_s: self.least_bytes_per_s,
                grace: TimeLimits::duration(self.grace_s),
            },
        }
    }
}

/// `[sandbox]`
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SandboxConfig {
    /// Disabled layers (single protections) of the sandbox: they are not used, for hosts that lack them.
    pub given_up: Vec<Layer>,
    /// The runtimes' files are copied into memory if they are at most this large; 0: never.
    pub resident_bytes: u64,
    /// Agents may be container images. Images need namespaces, so they cannot run if those are given up.
    pub images: bool,
}

impl Default for SandboxConfig {
    fn default() -> Self {
        Self {
            given_up: Vec::new(),
            resident_bytes: 1 << 30,
            images: true,
        }
    }
}

impl Config {
    /// Reads `file`; without one, [`DEFAULT_FILE`] of the working folder if it exists, else the
    /// defaults.
    ///
    /// # Errors
    /// If the file cannot be read, or a field is unknown or has an invalid value; the error names file and field.
    pub fn load(file: Option<&Path>) -> anyhow::Result<Self> {
        let path = file.unwrap_or(Path::new(DEFAULT_FILE));
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(error) if file.is_none() && error.kind() == ErrorKind::NotFound => {
                return Ok(Self::default());
            }
            Err(error) => {
                return Err(error)
                    .with_context(|| format!("reading the configuration {}", path.display()));
            }
        };
        let read = || -> anyhow::Result<Self> {
            let config = Self::parse(&text)?;
            config.check_this_host()?;
            Ok(config)
        };
        read().with_context(|| format!("the configuration {}", path.display()))
    }

    fn parse(text: &str) -> anyhow::Result<Self> {
        let config: Self = toml::from_str(text).map_err(|error: toml::de::Error| {
            anyhow!(suggestion::with_suggestion(&error.to_string()))
        })?;
        config.check()?;
        Ok(config)
    }

    /// The rules of the first stage, on which scores depend.
    #[must_use]
    pub fn rules(&self) -> StageRules {
        let evaluation = &self.evaluation;
        let mut rules = StageRules {
            runtimes: None,
            ruleset: competition().ruleset(),
            profile: evaluation.profile,
            tasks: evaluation.tasks.clone(),
            episodes_per_task: evaluation.episodes_per_task,
            max_faults: evaluation.max_faults,
            variation: Variation {
                weights: Some(evaluation.weights.clone()),
                tier_bounds: evaluation.tier_bounds,
                perturbations: evaluation.perturbations.clone(),
            },
            limits: Default::default(),
        };
        // Brings valid rules into the competition's order; `check` reports invalid ones.
        competition().check_and_normalise_rules(&mut rules).ok();
        rules
    }

    /// The settings of the first stage, on which scores do not depend.
    ///
    /// # Errors
    /// If the schedule is invalid, which is not possible after [`Self::load`].
    pub fn settings(&self) -> Result<StageSettings, InvalidSchedule> {
        let evaluation = &self.evaluation;
        let schedule = match (evaluation.at, &evaluation.cron) {
            (None, None) => None,
            (Some(time_of_day), None) => Some(Schedule::daily(time_of_day)),
            (None, Some(pattern)) => Some(Schedule::cron(pattern)?),
            (Some(_), Some(_)) => return Err(InvalidSchedule::OneKindExpected),
        };
        Ok(StageSettings {
            schedule: schedule.map(|schedule| schedule.without(evaluation.days_off.clone())),
            ablation_episodes: evaluation.ablation_episodes,
            episodes_per_shard: evaluation.episodes_per_shard,
            day_deadline: evaluation.day_deadline,
            publishes: evaluation.publishes,
            counting_result: evaluation.standings,
            ..StageSettings::default()
        })
    }

    /// The environment of agents on this host: all layers that are not given up; the runtimes `native`, `python3` if
    /// the host has Python, and the configured ones.
    #[must_use]
    pub fn agent_environment(&self) -> AgentEnvironment {
        let mut runtimes = BTreeMap::from([("native".to_owned(), Runtime::native())]);
        runtimes.extend(Runtime::python3().map(|python| ("python3".to_owned(), python)));
        let configured = self.runtimes.iter();
        runtimes.extend(configured.map(|(name, config)| (name.clone(), config.runtime())));
        AgentEnvironment {
            limits: self.limits.clone(),
            time: self.time.clone(),
            isolation: Isolation::Sandboxed {
                disabled_layers: self.sandbox.given_up.clone(),
            },
            runtimes,
            images: self.sandbox.images,
            agent_cpus: self.workers.agent_cpus.clone(),
            supervision: Supervision::default(),
            simulator: simulator(),
        }
    }

    /// Overrides the address of NATS, if `url` is given.
    ///
    /// # Errors
    /// If the address is invalid.
    pub fn override_nats_url(&mut self, url: Option<String>) -> anyhow::Result<()> {
        if url.is_some() {
            self.nats.url = url;
        }
        self.nats.check()
    }

    /// Overrides the number of slots.
    ///
    /// # Errors
    /// If this host has too few CPUs for the slots.
    pub fn override_slots(&mut self, slots: usize) -> anyhow::Result<()> {
        anyhow::ensure!(slots > 0, "--slots: expected at least 1");
        self.workers.slots = Some(slots);
        self.check_this_host()
    }

    /// Number of worker slots: configured, or one per two CPUs after one is reserved for the server.
    #[must_use]
    pub fn slots(&self) -> usize {
        self.workers.slots.unwrap_or_else(|| {
            let cpus = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
            Self::slots_on(cpus)
        })
    }

    /// Number of slots that do not disturb each other or the server on a host with `cpus` CPUs; at least one.
    #[must_use]
    pub const fn slots_on(cpus: usize) -> usize {
        if cpus < 3 { 1 } else { (cpus - 1) / 2 }
    }

    /// Folder for unpacked bundles and unfinished recordings.
    #[must_use]
    pub fn scratch_dir(&self) -> PathBuf {
        self.workers
            .scratch_dir
            .clone()
            .unwrap_or_else(|| self.server.data_dir.join("scratch"))
    }
}

mod check;
mod nats;
mod rates;
mod runtime;
mod suggestion;
#[cfg(test)]
mod tests;

pub use nats::NatsSection;
pub use rates::RatesConfig;
pub use runtime::RuntimeConfig;
