//! `faceoff admin stage`: creates, changes and lists the season's *stages*, periods with their own rules, cutoffs and board.
//! The *ruleset* is the simulator's version, from which a stage's rules may deviate.

use crate::competition::{competition, parse_profile, parse_task, parse_weights, read_magnitudes};
use crate::{
    client::Client,
    commands::{
        output::{print, print_list},
        stage_lookup::find_stage,
    },
};
use anyhow::Context;
use clap::{Args, Subcommand};
use faceoff_api::{
    requests::{NewStage, OrNull, StagePatch},
    views::{
        capacity::Fit,
        stage::{PhaseView, StageView},
    },
};
use faceoff_types::{IanaTimeZone, Publication, Task, TaskWeights};
use jiff::{Timestamp, Zoned, civil::DateTime};

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
        /// 1 to 40 letters and digits of any script, spaces and . _ - ' & + ·
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
    /// Start the final evaluation day of a closed stage that was configured with --standings final; possible once
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

// The options `--profile` and `--perturbations` come from the API's crate, which does not know the competition. So their parsers, which
// check the values, are set here.
#[derive(Debug, Args)]
#[command(
    mut_arg("profile", |option| option.value_parser(parse_profile)),
    mut_arg("perturbations", |option| option.value_parser(read_magnitudes)),
)]
pub(super) struct StageOptions {
    /// Opening time, e.g. "2026-12-01 06:00" in the stage's time zone, or with an offset [default of a new stage: now]
    #[arg(long, value_name = "TIME")]
    opens: Option<String>,
    /// Closing time [default of a new stage: open end]
    #[arg(long, value_name = "TIME")]
    closes: Option<String>,
    /// Tasks, e.g. hit,defend
    #[arg(long, value_name = "TASKS", value_delimiter = ',', value_parser = parse_task)]
    tasks: Option<Vec<Task>>,
    /// Weights of hit, defend and prepare in the score, e.g. 0.4,0.4,0.2
    #[arg(long, value_name = "WEIGHTS", value_parser = parse_weights)]
    weights: Option<TaskWeights>,
    #[command(flatten)]
    settings: StagePatch,
}

impl StageOptions {
    /// The settings. Times without an offset are local in the zone of the option `--zone`, or else in `zone`.
    fn settings(self, zone: &IanaTimeZone) -> anyhow::Result<StagePatch> {
        let zone = self.settings.zone.as_ref().unwrap_or(zone);
        let parse = |text: Option<String>| {
            let time = text.map(|text| parse_time(&text, zone));
            time.transpose()
        };
        Ok(StagePatch {
            opens_at: parse(self.opens)?,
            closes_at: parse(self.closes)?.map(|at| OrNull(Some(at))),
            tasks: self.tasks,
            weights: self.weights,
            ..self.settings
        })
    }
}

/// Parses a time with an offset or a zone; without them, it is local time in `zone`.
fn parse_time(text: &str, zone: &IanaTimeZone) -> anyhow::Result<Timestamp> {
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

pub(super) async fn run_action(
    client: &Client,
    json: bool,
    action: StageAction,
) -> anyhow::Result<()> {
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
            let zone = match &options.settings.zone {
                Some(zone) => zone.clone(),
                None => default_zone(client).await?,
            };
            let new = NewStage {
                name,
                settings: options.settings(&zone)?,
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
            let settings = options.settings(&stage.zone)?;
            let change = StagePatch {
                name: rename,
                closes_at: settings.closes_at.or(open_end.then_some(OrNull(None))),
                schedule: settings.schedule.or(no_schedule.then_some(OrNull(None))),
                confirm,
                ..settings
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
                    day.evaluations.len()
                )
            })
        }
        StageAction::Finalise { stage, confirm } => {
            let stage = find_stage(client, &stage).await?;
            let signed_off = client.sign_off_stage(stage.id, confirm).await?;
            print(json, &signed_off, stage_text)
        }
    }
}

/// The time zone of the open stage, or else of the last one.
async fn default_zone(client: &Client) -> anyhow::Result<IanaTimeZone> {
    let stages = client.stages().await?;
    let open = stages.iter().rfind(|stage| stage.phase == PhaseView::Open);
    let open_or_last = open.or(stages.last());
    Ok(open_or_last.map_or(IanaTimeZone::UTC, |stage| stage.zone.clone()))
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
    let result = match &stage.sign_off {
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
            !rules.limits.is_empty(),
            serde_json::to_string(&rules.limits),
        ),
        (
            "uploads",
            !settings.uploads.is_empty(),
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
    let tiers = competition().tier_bounds(&rules.variation);
    let tiers = tiers.map_or_else(String::new, |bounds| {
        format!(", tiers up to {bounds} points per episode")
    });
    let blind = if settings.blind { ", blind" } else { "" };
    format!(
        "{} ({phase}{blind})\n  id       {}\n  times    {} to {closes}, {}\n  cutoff   {next_cutoff}\n  \
         deadline {}\n  rules    revision {} since {}: {}, {} \
         episodes per task ({}), at most {} faults\n  score    weights {}{tiers}, perturbations \
         {}{overrides}\n  board    by {}, {result}\n  datasets public {}\n  kept     {}",
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
        competition().weights(&rules.variation),
        if rules.variation.perturbations.is_empty() {
            "of the ruleset"
        } else {
            "custom"
        },
        settings.counting_result,
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
        let berlin: IanaTimeZone = "Europe/Berlin".parse().unwrap();
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
