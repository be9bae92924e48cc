//! `faceoff admin stage`: creates, changes and lists the season's *stages*, periods with their own rules, cutoffs and board.
//! The *ruleset* is the simulator's version, from which a stage's rules may deviate.

use crate::{
    client::Client,
    commands::{
        output::{print, print_list},
        stage_lookup::find_stage,
    },
};
use anyhow::{Context, ensure};
use clap::{Args, Subcommand};
use faceoff_api::{
    requests::{NewStage, StageChange},
    views::{
        capacity::Fit,
        stage::{PhaseView, StageView},
    },
};
use faceoff_types::{
    CountingResult, DayDeadline, PerturbationSettings, Profile, Publication, Retention, Runtimes,
    Schedule, StageLimits, StageUploadLimits, Task, TaskWeights, TierBounds, Zone,
};
use jiff::{
    Timestamp, Zoned,
    civil::{Date, DateTime, Time},
};
use serde::de::DeserializeOwned;
use std::path::PathBuf;

#[derive(Debug, Subcommand)]
pub(super) enum StageAction {
    /// List the stages with their times and rules
    List,
    /// Estimate whether the evaluation days fit: the expected load against the slots and the time until the deadline
    Capacity {
        /// The stage's name or id
        stage: String,
    },
    /// Create a stage; options that are left out are copied from the open stage
    Create {
        /// 1 to 40 letters, digits, spaces and . _ -
        name: String,
        #[command(flatten)]
        options: Box<StageOptions>,
    },
    /// Change a stage; options that are left out do not change
    Change {
        /// The stage's name or id
        stage: String,
        /// The new name
        #[arg(long, value_name = "NAME")]
        rename: Option<String>,
        #[command(flatten)]
        options: Box<StageOptions>,
        /// Remove the closing time
        #[arg(long, conflicts_with = "closes")]
        open_end: bool,
        /// Remove the schedule: organisers start each evaluation day
        #[arg(long, conflicts_with_all = ["daily", "cron"])]
        no_schedule: bool,
        /// The stage's name, as confirmation, if new rules or a new counting result of an open stage start a new
        /// board, or if --retention deletes files
        #[arg(long, value_name = "NAME")]
        confirm: Option<String>,
    },
    /// Start the final evaluation day of a closed stage with --standings final; possible once
    Final {
        /// The stage's name or id
        stage: String,
    },
    /// Sign off the result of a closed stage: it becomes final; without --confirm, only list the effects
    Finalise {
        /// The stage's name or id
        stage: String,
        /// The stage's name, as confirmation
        #[arg(long, value_name = "NAME")]
        confirm: Option<String>,
    },
}

#[derive(Debug, Args)]
pub(super) struct StageOptions {
    /// Opening time, e.g. "2026-12-01 06:00" in the stage's time zone, or with an offset [default of a new stage: now]
    #[arg(long, value_name = "TIME")]
    opens: Option<String>,
    /// Closing time [default of a new stage: open end]
    #[arg(long, value_name = "TIME")]
    closes: Option<String>,
    /// Time zone of the evaluation days and the schedule, e.g. Europe/Berlin
    #[arg(long, value_name = "NAME")]
    zone: Option<Zone>,
    /// Perturbation profile
    #[arg(long)]
    profile: Option<Profile>,
    /// Tasks, e.g. hit,defend
    #[arg(long, value_delimiter = ',', value_name = "TASKS")]
    tasks: Option<Vec<Task>>,
    /// Episodes per task and evaluation
    #[arg(long)]
    episodes: Option<u32>,
    /// Agent faults allowed in an evaluation; with more, it has no score
    #[arg(long)]
    max_faults: Option<u32>,
    /// Weights of hit, defend and prepare in the score, e.g. 0.4,0.4,0.2
    #[arg(long, value_name = "WEIGHTS")]
    weights: Option<TaskWeights>,
    /// Penalty points per episode up to which an agent is deployable and improvable, e.g. 0.5,1.5
    #[arg(long, value_name = "BOUNDS")]
    tier_bounds: Option<TierBounds>,
    /// A JSON file with magnitudes of the perturbations; those left out are the ruleset's, so {} resets all of them
    #[arg(long, value_name = "FILE")]
    perturbations: Option<PathBuf>,
    /// Limits of agents instead of the server's, e.g. '{"memory_bytes":4294967296,"step_s":0.5}'; {} resets them
    #[arg(long, value_name = "JSON", value_parser = parse_json::<StageLimits>)]
    limits: Option<StageLimits>,
    /// Allowed runtimes, e.g. native,python3; `all`: all that the server offers
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    runtimes: Option<Vec<String>>,
    /// Upload limits of each team instead of the server's, e.g. '{"waiting":2,"day_bytes":1073741824}'
    #[arg(long, value_name = "JSON", value_parser = parse_json::<StageUploadLimits>)]
    uploads: Option<StageUploadLimits>,
    /// Daily cutoff at this time
    #[arg(long, value_name = "HH:MM", conflicts_with = "cron")]
    daily: Option<Time>,
    /// Cutoffs by a cron expression, e.g. "0 6 * * 1-5"; at most the first time of each date
    #[arg(long, value_name = "EXPRESSION")]
    cron: Option<String>,
    /// Dates without a cutoff, with --daily or --cron, e.g. 2026-12-24,2026-12-25
    #[arg(long, value_delimiter = ',', value_name = "DATES")]
    days_off: Option<Vec<Date>>,
    /// Episodes per task and profile of the ablation that the schedule starts for each submission; 0: none
    #[arg(long)]
    ablation_episodes: Option<u32>,
    /// Episodes per shard, the job that one slot runs at a time
    #[arg(long)]
    episodes_per_shard: Option<u32>,
    /// Deadline of an evaluation day: next-cut, never, or hours after its cutoff, e.g. 30h
    #[arg(long, value_name = "DEADLINE")]
    deadline: Option<DayDeadline>,
    /// Hide the scores from everyone but organisers; `false` reveals them, permanently if there are any
    #[arg(long, value_name = "true|false")]
    blind: Option<bool>,
    /// When datasets are published: never, at_close or at_release
    #[arg(long, value_name = "TIME")]
    publishes: Option<Publication>,
    /// Retention of datasets and bundles, e.g. '{"last":5,"days_after_sign_off":90}' or
    /// '{"until":"2027-06-01T00:00:00Z"}'; {} keeps all files
    #[arg(long, value_name = "JSON", value_parser = parse_json::<Retention>)]
    retention: Option<Retention>,
    /// The result that counts for a team: latest, best, mean_of_last:N, or final
    #[arg(long, value_name = "RESULT")]
    standings: Option<CountingResult>,
}

impl StageOptions {
    fn perturbations(&self) -> anyhow::Result<Option<Box<PerturbationSettings>>> {
        let Some(path) = &self.perturbations else {
            return Ok(None);
        };
        let read = || -> anyhow::Result<Box<PerturbationSettings>> {
            let text = std::fs::read_to_string(path)?;
            let mut json = serde_json::Deserializer::from_str(&text);
            let settings: Box<PerturbationSettings> = serde_path_to_error::deserialize(&mut json)?;
            json.end()?;
            settings.check()?;
            Ok(settings)
        };
        let settings = read().with_context(|| format!("--perturbations {}", path.display()))?;
        Ok(Some(settings))
    }

    #[expect(
        clippy::option_option,
        reason = "the request distinguishes `all` from an option that is left out"
    )]
    fn runtimes(&self) -> Option<Option<Runtimes>> {
        let names = self.runtimes.as_ref()?;
        let is_all = names.iter().any(|name| name == "all");
        Some((!is_all).then(|| names.iter().cloned().collect()))
    }

    fn schedule(&self) -> anyhow::Result<Option<Schedule>> {
        let schedule = match (self.daily, &self.cron) {
            (Some(time_of_day), _) => Schedule::daily(time_of_day),
            (None, Some(pattern)) => Schedule::cron(pattern).context("--cron")?,
            (None, None) => {
                ensure!(
                    self.days_off.is_none(),
                    "--days-off needs --daily or --cron, which set the cutoffs"
                );
                return Ok(None);
            }
        };
        Ok(Some(
            schedule.without(self.days_off.clone().unwrap_or_default()),
        ))
    }
}

/// Parses an option in JSON; an error names the wrong field.
fn parse_json<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    let mut json = serde_json::Deserializer::from_str(text);
    serde_path_to_error::deserialize(&mut json).map_err(|error| error.to_string())
}

/// Parses a time with an offset or a zone; without them, it is local time in `zone`.
fn parse_time(text: &str, zone: &Zone) -> anyhow::Result<Timestamp> {
    if let Ok(time) = text.parse::<Timestamp>() {
        return Ok(time);
    }
    if let Ok(time) = text.parse::<Zoned>() {
        return Ok(time.timestamp());
    }
    let local: DateTime = text.parse().ok().with_context(|| {
        format!(
            "{text:?} is not a time: expected e.g. \"2026-12-01 06:00\" ({zone}), or with an offset \
            2026-12-01T06:00+01:00"
        )
    })?;
    let time = local.to_zoned(zone.time_zone());
    Ok(time
        .with_context(|| format!("the time {text:?}"))?
        .timestamp())
}

pub(super) async fn act(client: &Client, json: bool, action: StageAction) -> anyhow::Result<()> {
    match action {
        StageAction::List => {
            let stages = client.stages().await?;
            print_list(json, &stages, stage_text, "no stages")
        }
        StageAction::Capacity { stage } => {
            let stage = find_stage(client, &stage).await?;
            let capacity = client.capacity(stage.id).await?;
            print(json, &capacity, |capacity| {
                let mut lines = vec![format!("{}, {} slots", capacity.stage_name, capacity.slots)];
                lines.extend(capacity.days.iter().map(|day| day.summary.clone()));
                lines.join("\n")
            })
        }
        StageAction::Create { name, options } => {
            let zone = match &options.zone {
                Some(zone) => zone.clone(),
                None => default_zone(client).await?,
            };
            let parse_optional = |text: &Option<String>| {
                let time = text.as_deref().map(|text| parse_time(text, &zone));
                time.transpose()
            };
            let new = NewStage {
                name,
                perturbations: options.perturbations()?,
                runtimes: options.runtimes(),
                opens_at: parse_optional(&options.opens)?,
                closes_at: parse_optional(&options.closes)?,
                schedule: options.schedule()?,
                zone: options.zone,
                profile: options.profile,
                tasks: options.tasks,
                episodes_per_task: options.episodes,
                max_faults: options.max_faults,
                weights: options.weights,
                tier_bounds: options.tier_bounds,
                limits: options.limits.map(Box::new),
                uploads: options.uploads,
                ablation_episodes: options.ablation_episodes,
                episodes_per_shard: options.episodes_per_shard,
                day_deadline: options.deadline,
                blind: options.blind,
                publishes: options.publishes,
                standings: options.standings,
                retention: options.retention,
            };
            let created = client.create_stage(&new).await?;
            print(json, &created, stage_text)
        }
        StageAction::Change {
            stage,
            rename,
            options,
            open_end,
            no_schedule,
            confirm,
        } => {
            let stage = find_stage(client, &stage).await?;
            let zone = options.zone.clone().unwrap_or_else(|| stage.zone.clone());
            let parse_optional = |text: &Option<String>| {
                let time = text.as_deref().map(|text| parse_time(text, &zone));
                time.transpose()
            };
            let schedule = options
                .schedule()?
                .map(Some)
                .or(no_schedule.then_some(None));
            let change = StageChange {
                name: rename,
                perturbations: options.perturbations()?,
                runtimes: options.runtimes(),
                opens_at: parse_optional(&options.opens)?,
                closes_at: parse_optional(&options.closes)?
                    .map(Some)
                    .or(open_end.then_some(None)),
                schedule,
                zone: options.zone,
                profile: options.profile,
                tasks: options.tasks,
                episodes_per_task: options.episodes,
                max_faults: options.max_faults,
                weights: options.weights,
                tier_bounds: options.tier_bounds,
                limits: options.limits.map(Box::new),
                uploads: options.uploads,
                ablation_episodes: options.ablation_episodes,
                episodes_per_shard: options.episodes_per_shard,
                day_deadline: options.deadline,
                blind: options.blind,
                publishes: options.publishes,
                standings: options.standings,
                retention: options.retention,
                confirm,
            };
            let changed = client.change_stage(stage.id, &change).await?;
            print(json, &changed, stage_text)
        }
        StageAction::Final { stage } => {
            let stage = find_stage(client, &stage).await?;
            let day = client.start_final_day(stage.id).await?;
            print(json, &day, |day| {
                format!(
                    "{}: final day, {} evaluations started",
                    day.day,
                    day.created.len()
                )
            })
        }
        StageAction::Finalise { stage, confirm } => {
            let stage = find_stage(client, &stage).await?;
            let signed_off = client.finalise(stage.id, confirm).await?;
            print(json, &signed_off, stage_text)
        }
    }
}

/// The time zone of the open stage, or else of the last one.
async fn default_zone(client: &Client) -> anyhow::Result<Zone> {
    let stages = client.stages().await?;
    let open = stages.iter().rfind(|stage| stage.phase == PhaseView::Open);
    let template = open.or(stages.last());
    Ok(template.map_or(Zone::UTC, |stage| stage.zone.clone()))
}

/// Warnings about evaluation days that do not fit into their time.
fn capacity_warnings(stage: &StageView) -> impl Iterator<Item = String> {
    let loads = stage.capacity.iter().flatten();
    let overflows = loads.filter(|load| load.fit == Fit::Not);
    overflows.map(|load| format!("\n  warning  {}", load.summary))
}

/// A stage as several lines: times, rules, settings and state.
fn stage_text(stage: &StageView) -> String {
    let local_time = |time: Timestamp| {
        let local = time.to_zoned(stage.zone.time_zone());
        local.strftime("%Y-%m-%d %H:%M:%S").to_string()
    };
    let phase = match stage.phase {
        PhaseView::Upcoming => "upcoming",
        PhaseView::Open => "open",
        PhaseView::Closed => "closed",
    };
    let closes = stage
        .closes_at
        .map_or_else(|| "open end".to_owned(), local_time);
    let rules = &stage.rules.rules;
    let tasks: Vec<&str> = rules.tasks.iter().map(|task| task.as_str()).collect();
    let next_cutoff = match &stage.next_cutoff {
        Some(next) => next.to_string(),
        None => "none".to_owned(),
    };
    let result = match &stage.finalised {
        Some(sign_off) => format!(
            "signed off on {} by {}",
            local_time(sign_off.at),
            sign_off.by
        ),
        None => "provisional".to_owned(),
    };
    let settings = &stage.settings;
    let overrides = [
        (
            "limits ",
            !rules.limits.is_none(),
            serde_json::to_string(&rules.limits),
        ),
        (
            "uploads",
            !settings.uploads.is_none(),
            serde_json::to_string(&settings.uploads),
        ),
    ];
    let overrides: String = overrides
        .into_iter()
        .filter(|(_, is_set, _)| *is_set)
        .filter_map(|(name, _, json)| Some(format!("\n  {name}  {}", json.ok()?)))
        .chain(
            rules
                .runtimes
                .iter()
                .map(|runtimes| format!("\n  runtimes {runtimes} only")),
        )
        .chain(capacity_warnings(stage))
        .collect();
    let blind = if settings.blind { ", blind" } else { "" };
    format!(
        "{} ({phase}{blind})\n  id       {}\n  times    {} to {closes}, {}\n  cutoff   {next_cutoff}\n  \
         deadline {}\n  rules    revision {} since {}: {}, {} \
         episodes per task ({}), at most {} faults\n  score    weights {}, tiers up to {} \
         points per episode, perturbations {}{overrides}\n  board    by {}, {result}\n  datasets public {}\n  kept     {}",
        stage.name,
        stage.id,
        local_time(stage.opens_at),
        stage.zone,
        stage.settings.day_deadline,
        stage.rules.revision,
        local_time(stage.rules.since),
        rules.profile,
        rules.episodes_per_task,
        tasks.join(", "),
        rules.max_faults,
        rules.variation.weights,
        rules.variation.tier_bounds,
        if *rules.variation.perturbations == PerturbationSettings::default() {
            "of the ruleset"
        } else {
            "custom"
        },
        settings.standings,
        match settings.publishes {
            Publication::Never => "if the team publishes them",
            Publication::AtClose => "when the stage closes",
            Publication::AtRelease => "when the day is released",
        },
        stage.retention,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_without_offset_is_in_the_zone_of_the_stage() {
        let berlin: Zone = "Europe/Berlin".parse().unwrap();
        let parse = |text: &str| parse_time(text, &berlin).map(|time| time.to_string());
        for text in [
            "2026-12-01 06:00",
            "2026-12-01T06:00:00",
            "2026-12-01T05:00:00Z",
            "2026-12-01T06:00+01:00",
            "2026-12-01T00:00[America/New_York]",
        ] {
            assert_eq!(parse(text).unwrap(), "2026-12-01T05:00:00Z", "{text}");
        }
        for wrong in ["tomorrow", "2026-13-01 06:00", ""] {
            let error = parse(wrong).unwrap_err().to_string();
            assert!(error.contains("2026-12-01 06:00"), "{error}");
        }
    }
}
