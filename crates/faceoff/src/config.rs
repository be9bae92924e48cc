//! The configuration: one TOML file in which every field may be left out.
//!
//! The defaults are the `Default` implementations below and of the types that the sections hold, so
//! that the file, the documentation (`docs/operating.md`, held to them by a test) and the code
//! cannot state different ones.

use anyhow::{Context, anyhow};
use faceoff_http::{ConnectionLimits, HttpLimits, LeastRate};
use faceoff_notify::WebhookRules;
use faceoff_runner::{AgentEnvironment, Supervision, TimeLimits, bundle::BundleLimits};
use faceoff_sandbox::{Isolation, Layer, Limits, Runtime, affinity};
use faceoff_store::UploadQuota;
use faceoff_types::{
    DayDeadline, InvalidSchedule, PerturbationSettings, Profile, Publishes, Ruleset, Schedule,
    StageRules, StageSettings, Standings, Task, TaskWeights, TierBounds, Variation, Zone,
};
use jiff::civil::{Date, Time};
use serde::{Deserialize, Serialize};
use std::{
    collections::BTreeMap,
    net::{IpAddr, SocketAddr},
    path::{Path, PathBuf},
};

/// The file that is read when none is named and it exists.
pub const DEFAULT_FILE: &str = "faceoff.toml";

/// The defaults, with units and meanings: what `faceoff init` writes.
pub const COMMENTED: &str = include_str!("config/faceoff.toml");

#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Address and data folder.
    pub server: ServerConfig,
    /// What the season is called.
    pub season: SeasonConfig,
    pub evaluation: EvaluationConfig,
    /// How this machine evaluates.
    pub workers: WorkersConfig,
    /// Work on other machines.
    pub nats: NatsSection,
    /// What an agent's process tree may use.
    pub limits: Limits,
    /// How long an agent may take.
    pub time: TimeLimits,
    /// What a bundle may hold.
    pub bundle: BundleLimits,
    /// How much a team may upload, and how slowly.
    pub uploads: UploadsConfig,
    /// How much of the server a stranger may hold.
    pub connections: ConnectionsConfig,
    /// How often a stranger may ask.
    pub rates: RatesConfig,
    /// Where programs may be told of what happens.
    pub webhooks: WebhookRules,
    /// What is not enforced.
    pub sandbox: SandboxConfig,
    /// Runtimes by the name that `agent.toml` gives; added to `python3` and `native`, or in their
    /// place.
    pub runtimes: BTreeMap<String, RuntimeConfig>,
}

/// `[server]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ServerConfig {
    /// Address of API and pages. Bind a public address only behind a proxy that speaks TLS.
    pub listen: SocketAddr,
    /// The address by which people reach the server, for links: of http or https, without a slash at its end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub public_url: Option<String>,
    /// Where numbers and health are there without a token; left out: nowhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub metrics_listen: Option<SocketAddr>,
    /// Folder of the database, the artifacts and the organiser's token.
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
    /// Its name, kept in the data folder; left out, it stays as it is there (at first “Season 1”).
    pub name: Option<String>,
}

/// `[evaluation]`: rules and settings of the season's first stage, as long as nobody changes them through the API.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EvaluationConfig {
    pub profile: Profile,
    pub tasks: Vec<Task>,
    /// Episodes of each task.
    pub episodes_per_task: u32,
    /// Episodes of one unit of work. Scores do not depend on it; smaller units lose less when a
    /// worker dies, larger ones start fewer agents.
    pub episodes_per_shard: u32,
    /// Time of the daily cut in `zone`; left out, `cron` says when, or the organiser starts each day.
    pub at: Option<Time>,
    /// When days start, in place of `at`: minute, hour, day of the month, month, day of the week in `zone`.
    pub cron: Option<String>,
    /// Dates on which neither starts a day.
    pub days_off: Vec<Date>,
    /// Time zone of `at` and `cron`; days are dates there.
    pub zone: Zone,
    /// Until when a day may be played.
    pub day_deadline: DayDeadline,
    /// More agent faults than this end an evaluation without a score.
    pub max_faults: u32,
    /// Episodes of each task and profile of the ablation that the schedule orders of every submission
    /// it starts; 0: none.
    pub ablation_episodes: u32,
    /// What each task's success rate weighs in the score.
    pub weights: TaskWeights,
    /// Penalty points per episode up to which an agent is in a tier.
    pub tier_bounds: TierBounds,
    /// Magnitudes of the perturbations that the profile switches on; left out, the ruleset's.
    pub perturbations: Option<Box<PerturbationSettings>>,
    /// When datasets of released days are there for everybody.
    pub publishes: Publishes,
    /// What a team's row on the board is made of.
    pub standings: Standings,
}

impl Default for EvaluationConfig {
    fn default() -> Self {
        Self {
            profile: Profile::Evaluation,
            tasks: Task::ALL.to_vec(),
            episodes_per_task: 1000,
            episodes_per_shard: 50,
            at: None,
            cron: None,
            days_off: Vec::new(),
            zone: Zone::UTC,
            day_deadline: DayDeadline::NextCut,
            max_faults: 10,
            ablation_episodes: 0,
            weights: TaskWeights::default(),
            tier_bounds: TierBounds::default(),
            perturbations: None,
            publishes: Publishes::AtClose,
            standings: Standings::Latest,
        }
    }
}

/// `[workers]`
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WorkersConfig {
    /// Evaluations at the same time; left out, one per two CPUs and one CPU less, so that an agent, its
    /// simulator and the rest of the server have a CPU each.
    pub slots: Option<usize>,
    /// Seconds after which the work of a dead worker is given to another.
    pub lease_s: u32,
    /// Do this server's own slots play? If not, they only try uploads and score what others have played.
    pub play: bool,
    /// How many episodes of each shard that another machine has played are simulated again before they count; 0: none, and no games.
    pub checked_episodes: u32,
    /// CPUs of all agents; empty = every slot has its own, where there are two per slot.
    pub agent_cpus: Vec<usize>,
    /// Folder for unpacked bundles and recordings under way; left out, `scratch` in the data folder.
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
    /// Uploads of one team under way at the same time.
    pub at_once: usize,
    /// How fast the body of an upload must come, in the mean.
    pub least_bytes_per_s: u64,
    /// How many seconds it may be behind that.
    pub grace_s: f64,
    /// How much a team may upload on a UTC day, in bytes.
    pub day_bytes: u64,
    /// How much is kept of a team at the same time, in bytes.
    pub stored_bytes: u64,
}

impl Default for UploadsConfig {
    fn default() -> Self {
        let HttpLimits {
            team_uploads,
            upload_rate,
            upload_quota,
            ..
        } = HttpLimits::default();
        Self {
            at_once: team_uploads,
            least_bytes_per_s: upload_rate.bytes_per_s,
            grace_s: upload_rate.grace.as_secs_f64(),
            day_bytes: upload_quota.day_bytes,
            stored_bytes: upload_quota.stored_bytes,
        }
    }
}

impl UploadsConfig {
    /// As the web side takes them.
    #[must_use]
    pub fn limits(&self) -> HttpLimits {
        HttpLimits {
            team_uploads: self.at_once,
            upload_rate: LeastRate {
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
    /// Open at the same time, where there are descriptors for so many.
    pub most: usize,
    /// Of one address, or IPv6 network of 64 bits; a quarter of all at most.
    pub per_address: usize,
    /// Addresses without a bound of their own: proxies'.
    pub exempt: Vec<IpAddr>,
    /// Seconds to send the head of a request, or to be idle before the next.
    pub head_s: f64,
    /// What a reader must take of an answer, in the mean.
    pub least_bytes_per_s: u64,
    /// How many seconds it may be behind that.
    pub grace_s: f64,
}

impl Default for ConnectionsConfig {
    fn default() -> Self {
        let ConnectionLimits {
            open,
            per_address,
            exempt,
            head,
            reading,
        } = ConnectionLimits::default();
        Self {
            most: open,
            per_address,
            exempt,
            head_s: head.as_secs_f64(),
            least_bytes_per_s: reading.bytes_per_s,
            grace_s: reading.grace.as_secs_f64(),
        }
    }
}

impl ConnectionsConfig {
    /// As the web side takes them, if there are descriptors for all.
    #[must_use]
    pub fn limits(&self) -> ConnectionLimits {
        ConnectionLimits {
            open: self.most,
            per_address: self.per_address,
            exempt: self.exempt.clone(),
            head: TimeLimits::duration(self.head_s),
            reading: LeastRate {
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
    /// Layers that this host cannot provide and the organiser does without.
    pub given_up: Vec<Layer>,
    /// The runtimes' files are copied into memory if they have no more bytes than this; 0: never.
    pub resident_bytes: u64,
    /// May agents be container images? They need the namespaces, so none can where those are given up.
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
    /// A file that cannot be read, or a field that is unknown or has a value that cannot be; the
    /// error names the file and the field.
    pub fn load(file: Option<&Path>) -> anyhow::Result<Self> {
        let (file, text) = match file {
            Some(file) => {
                let text = std::fs::read_to_string(file)
                    .with_context(|| format!("reading the configuration {}", file.display()))?;
                (file, text)
            }
            None => {
                let file = Path::new(DEFAULT_FILE);
                match std::fs::read_to_string(file) {
                    Ok(text) => (file, text),
                    Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                        return Ok(Self::default());
                    }
                    Err(error) => {
                        return Err(error).with_context(|| {
                            format!("reading the configuration {}", file.display())
                        });
                    }
                }
            }
        };
        let read = || -> anyhow::Result<Self> {
            let config = Self::parse(&text)?;
            config.check_host(&affinity::allowed().context("asking for this host's CPUs")?)?;
            Ok(config)
        };
        read().with_context(|| format!("the configuration {}", file.display()))
    }

    fn parse(text: &str) -> anyhow::Result<Self> {
        let config: Self = toml::from_str(text)
            .map_err(|error: toml::de::Error| anyhow!(nearest::told(&error.to_string())))?;
        config.check()?;
        Ok(config)
    }

    /// What scores of the first stage depend on.
    #[must_use]
    pub fn rules(&self) -> StageRules {
        let evaluation = &self.evaluation;
        StageRules {
            runtimes: None,
            ruleset: Ruleset::CURRENT,
            profile: evaluation.profile,
            tasks: evaluation.tasks.clone(),
            episodes_per_task: evaluation.episodes_per_task,
            max_faults: evaluation.max_faults,
            variation: Variation {
                weights: evaluation.weights,
                tier_bounds: evaluation.tier_bounds,
                perturbations: evaluation.perturbations.clone().unwrap_or_default(),
            },
            limits: Default::default(),
        }
    }

    /// What they do not depend on.
    ///
    /// # Errors
    /// If there is no such schedule, which no configuration that was read has.
    pub fn settings(&self) -> Result<StageSettings, InvalidSchedule> {
        let evaluation = &self.evaluation;
        let schedule = match (evaluation.at, &evaluation.cron) {
            (None, None) => None,
            (Some(at), None) => Some(Schedule::daily(at)),
            (None, Some(pattern)) => Some(Schedule::cron(pattern)?),
            (Some(_), Some(_)) => return Err(InvalidSchedule::Which),
        };
        Ok(StageSettings {
            schedule: schedule.map(|schedule| schedule.without(evaluation.days_off.clone())),
            ablation_episodes: evaluation.ablation_episodes,
            episodes_per_shard: evaluation.episodes_per_shard,
            day_deadline: evaluation.day_deadline,
            publishes: evaluation.publishes,
            standings: evaluation.standings,
            ..StageSettings::default()
        })
    }

    /// How agents are run here: all layers but those given up; `native`, `python3` where this host
    /// has one, and the configured runtimes.
    #[must_use]
    pub fn agent_environment(&self) -> AgentEnvironment {
        let mut runtimes = BTreeMap::from([("native".to_owned(), Runtime::native())]);
        runtimes.extend(Runtime::python3().map(|python| ("python3".to_owned(), python)));
        let own = self.runtimes.iter();
        runtimes.extend(own.map(|(name, own)| (name.clone(), own.runtime())));
        AgentEnvironment {
            limits: self.limits.clone(),
            time: self.time.clone(),
            isolation: Isolation::Sandboxed {
                given_up: self.sandbox.given_up.clone(),
            },
            runtimes,
            images: self.sandbox.images,
            agent_cpus: self.workers.agent_cpus.clone(),
            supervision: Supervision::default(),
        }
    }

    /// Has NATS be elsewhere than the file says, if it is named.
    ///
    /// # Errors
    /// If it is no address.
    pub fn reach_nats(&mut self, url: Option<String>) -> anyhow::Result<()> {
        if url.is_some() {
            self.nats.url = url;
        }
        self.nats.check()
    }

    /// Has so many slots, whatever the file says.
    ///
    /// # Errors
    /// If this host cannot have so many.
    pub fn have_slots(&mut self, slots: usize) -> anyhow::Result<()> {
        anyhow::ensure!(slots > 0, "--slots: expected at least 1");
        self.workers.slots = Some(slots);
        self.check_host(&affinity::allowed().context("asking for this host's CPUs")?)
    }

    /// Worker slots: as configured, or one per two CPUs once the server has one.
    #[must_use]
    pub fn slots(&self) -> usize {
        self.workers.slots.unwrap_or_else(|| {
            let cpus = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
            Self::slots_on(cpus)
        })
    }

    /// How many slots so many CPUs have without disturbing each other or the server: one at least.
    #[must_use]
    pub const fn slots_on(cpus: usize) -> usize {
        if cpus < 3 { 1 } else { (cpus - 1) / 2 }
    }

    /// Folder for unpacked bundles and recordings under way.
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
mod nearest;
mod rates;
mod runtime;
#[cfg(test)]
mod tests;

pub use nats::NatsSection;
pub use rates::RatesConfig;
pub use runtime::RuntimeConfig;
