//! `faceoff admin stage`: makes, changes and lists the season's stages.

use crate::{
    client::Client,
    commands::{
        find_stage::find_stage,
        output::{or_none, print},
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
    DayDeadline, PerturbationSettings, Profile, Publishes, Retention, Runtimes, Schedule,
    StageLimits, StageUploads, Standings, Task, TaskWeights, TierBounds, Zone,
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
    /// Tell whether the stage's days fit: what there is to play against the slots and the time until the deadline
    Capacity {
        /// The stage's name or id
        stage: String,
    },
    /// Make a stage: what is left out is as in the stage that is open
    Create {
        /// 1 to 40 letters, digits, spaces and . _ -
        name: String,
        #[command(flatten)]
        wanted: Box<Wanted>,
    },
    /// Change a stage: what is left out stays as it is
    Change {
        /// The stage's name or id
        stage: String,
        /// Another name
        #[arg(long, value_name = "NAME")]
        rename: Option<String>,
        #[command(flatten)]
        wanted: Box<Wanted>,
        /// No end as yet
        #[arg(long, conflicts_with = "closes")]
        open_end: bool,
        /// The organiser starts the days
        #[arg(long, conflicts_with_all = ["daily", "cron"])]
        no_schedule: bool,
        /// The stage's name, if it is open and gets other rules or standings (its board begins anew then), or if
        /// --retention removes something
        #[arg(long, value_name = "NAME")]
        confirm: Option<String>,
    },
    /// Start a stage's final day, once, after its close: of a stage with --standings final
    Final {
        /// The stage's name or id
        stage: String,
    },
    /// Sign a closed stage's result off: nothing of it changes any more; without --confirm, say what that would do
    Finalise {
        /// The stage's name or id
        stage: String,
        /// The stage's name
        #[arg(long, value_name = "NAME")]
        confirm: Option<String>,
    },
}

#[derive(Debug, Args)]
pub(super) struct Wanted {
    /// When it opens: "2026-12-01 06:00" in its zone, or with an offset; left out at its making, now
    #[arg(long, value_name = "TIME")]
    opens: Option<String>,
    /// When it closes; left out at its making, it has no end yet
    #[arg(long, value_name = "TIME")]
    closes: Option<String>,
    /// Time zone of its days and its schedule, e.g. Europe/Berlin
    #[arg(long, value_name = "NAME")]
    zone: Option<Zone>,
    /// Perturbation profile
    #[arg(long)]
    profile: Option<Profile>,
    /// Tasks, e.g. hit,defend
    #[arg(long, value_delimiter = ',', value_name = "TASKS")]
    tasks: Option<Vec<Task>>,
    /// Episodes of each task on a day
    #[arg(long)]
    episodes: Option<u32>,
    /// More agent faults than this: no score
    #[arg(long)]
    max_faults: Option<u32>,
    /// What hit, defend and prepare weigh in the score, e.g. 0.4,0.4,0.2
    #[arg(long, value_name = "WEIGHTS")]
    weights: Option<TaskWeights>,
    /// Penalty points per episode up to which an agent is deployable, and improvable, e.g. 0.5,1.5
    #[arg(long, value_name = "BOUNDS")]
    tier_bounds: Option<TierBounds>,
    /// A JSON file with magnitudes of the perturbations; what it leaves out is the ruleset's, so {} gives up all others
    #[arg(long, value_name = "FILE")]
    perturbations: Option<PathBuf>,
    /// Limits of agents in place of the server's, e.g. '{"memory_bytes":4294967296,"step_s":0.5}'; {} gives them up
    #[arg(long, value_name = "JSON", value_parser = json::<StageLimits>)]
    limits: Option<StageLimits>,
    /// The runtimes that its agents may use, e.g. native,python3; `all`: all that the server offers
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    runtimes: Option<Vec<String>>,
    /// What each team may upload in place of the server's, e.g. '{"waiting":2,"day_bytes":1073741824}'
    #[arg(long, value_name = "JSON", value_parser = json::<StageUploads>)]
    uploads: Option<StageUploads>,
    /// Its days start every day at this time
    #[arg(long, value_name = "HH:MM", conflicts_with = "cron")]
    daily: Option<Time>,
    /// Its days start at the first of these times of a date, e.g. "0 6 * * 1-5"
    #[arg(long, value_name = "EXPRESSION")]
    cron: Option<String>,
    /// Dates without a day, with --daily or --cron, e.g. 2026-12-24,2026-12-25
    #[arg(long, value_delimiter = ',', value_name = "DATES")]
    days_off: Option<Vec<Date>>,
    /// Episodes per task and profile of the ablation of every submission that the schedule starts; 0: none
    #[arg(long)]
    ablation_episodes: Option<u32>,
    /// Episodes of one unit of work
    #[arg(long)]
    episodes_per_shard: Option<u32>,
    /// Until when a day may be played: next-cut, never, or hours from its cut as 30h
    #[arg(long, value_name = "DEADLINE")]
    deadline: Option<DayDeadline>,
    /// Hide its scores from everybody but the organiser; `false` opens it, for good once it has scores
    #[arg(long, value_name = "true|false")]
    blind: Option<bool>,
    /// When its datasets are there for everybody: never, at_close or at_release
    #[arg(long, value_name = "WHEN")]
    publishes: Option<Publishes>,
    /// What is kept of datasets and archives, e.g. '{"last":5,"days_after_sign_off":90}' or '{"until":"2027-06-01T00:00:00Z"}';
    /// {} keeps everything
    #[arg(long, value_name = "JSON", value_parser = json::<Retention>)]
    retention: Option<Retention>,
    /// What a team's row on its board is: latest, best, mean_of_last:N, or final
    #[arg(long, value_name = "HOW")]
    standings: Option<Standings>,
}

impl Wanted {
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
        reason = "all and left out are told apart, as the request does"
    )]
    fn runtimes(&self) -> Option<Option<Runtimes>> {
        let names = self.runtimes.as_ref()?;
        let is_all = names.iter().any(|name| name == "all");
        Some((!is_all).then(|| names.iter().cloned().collect()))
    }

    fn schedule(&self) -> anyhow::Result<Option<Schedule>> {
        let schedule = match (self.daily, &self.cron) {
            (Some(at), _) => Schedule::daily(at),
            (None, Some(pattern)) => Schedule::cron(pattern).context("--cron")?,
            (None, None) => {
                ensure!(
                    self.days_off.is_none(),
                    "--days-off goes with --daily or --cron: say when days start, too"
                );
                return Ok(None);
            }
        };
        Ok(Some(
            schedule.without(self.days_off.clone().unwrap_or_default()),
        ))
    }
}

fn json<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    let mut json = serde_json::Deserializer::from_str(text);
    serde_path_to_error::deserialize(&mut json).map_err(|error| error.to_string())
}

/// An instant as people write it: with an offset or a zone, or by the clocks of `zone`.
fn instant(text: &str, zone: &Zone) -> anyhow::Result<Timestamp> {
    if let Ok(at) = text.parse::<Timestamp>() {
        return Ok(at);
    }
    if let Ok(at) = text.parse::<Zoned>() {
        return Ok(at.timestamp());
    }
    let there: DateTime = text.parse().ok().with_context(|| {
        format!(
            "{text:?} is no time: expected one as \"2026-12-01 06:00\" ({zone}), or with an offset as \
             2026-12-01T06:00+01:00"
        )
    })?;
    let at = there.to_zoned(zone.time_zone());
    Ok(at
        .with_context(|| format!("the time {text:?}"))?
        .timestamp())
}

pub(super) async fn act(client: &Client, json: bool, action: StageAction) -> anyhow::Result<()> {
    match action {
        StageAction::List => {
            let stages = client.stages().await?;
            print(json, &stages, || {
                or_none(stages.iter().map(told).collect(), "no stage")
            })
        }
        StageAction::Capacity { stage } => {
            let stage = find_stage(client, &stage).await?;
            let capacity = client.capacity(stage.id).await?;
            print(json, &capacity, || {
                let mut lines = vec![format!("{}, {} slots", capacity.stage_name, capacity.slots)];
                lines.extend(capacity.days.iter().map(|day| day.summary.clone()));
                lines.join("\n")
            })
        }
        StageAction::Create { name, wanted } => {
            let zone = match &wanted.zone {
                Some(zone) => zone.clone(),
                None => like(client).await?,
            };
            let at = |text: &Option<String>| {
                let at = text.as_deref().map(|text| instant(text, &zone));
                at.transpose()
            };
            let new = NewStage {
                name,
                perturbations: wanted.perturbations()?,
                runtimes: wanted.runtimes(),
                opens_at: at(&wanted.opens)?,
                closes_at: at(&wanted.closes)?,
                schedule: wanted.schedule()?,
                zone: wanted.zone,
                profile: wanted.profile,
                tasks: wanted.tasks,
                episodes_per_task: wanted.episodes,
                max_faults: wanted.max_faults,
                weights: wanted.weights,
                tier_bounds: wanted.tier_bounds,
                limits: wanted.limits.map(Box::new),
                uploads: wanted.uploads,
                ablation_episodes: wanted.ablation_episodes,
                episodes_per_shard: wanted.episodes_per_shard,
                day_deadline: wanted.deadline,
                blind: wanted.blind,
                publishes: wanted.publishes,
                standings: wanted.standings,
                retention: wanted.retention,
            };
            let made = client.create_stage(&new).await?;
            print(json, &made, || told(&made))
        }
        StageAction::Change {
            stage,
            rename,
            wanted,
            open_end,
            no_schedule,
            confirm,
        } => {
            let stage = find_stage(client, &stage).await?;
            let zone = wanted.zone.clone().unwrap_or_else(|| stage.zone.clone());
            let at = |text: &Option<String>| {
                let at = text.as_deref().map(|text| instant(text, &zone));
                at.transpose()
            };
            let schedule = wanted.schedule()?.map(Some).or(no_schedule.then_some(None));
            let change = StageChange {
                name: rename,
                perturbations: wanted.perturbations()?,
                runtimes: wanted.runtimes(),
                opens_at: at(&wanted.opens)?,
                closes_at: at(&wanted.closes)?.map(Some).or(open_end.then_some(None)),
                schedule,
                zone: wanted.zone,
                profile: wanted.profile,
                tasks: wanted.tasks,
                episodes_per_task: wanted.episodes,
                max_faults: wanted.max_faults,
                weights: wanted.weights,
                tier_bounds: wanted.tier_bounds,
                limits: wanted.limits.map(Box::new),
                uploads: wanted.uploads,
                ablation_episodes: wanted.ablation_episodes,
                episodes_per_shard: wanted.episodes_per_shard,
                day_deadline: wanted.deadline,
                blind: wanted.blind,
                publishes: wanted.publishes,
                standings: wanted.standings,
                retention: wanted.retention,
                confirm,
            };
            let changed = client.change_stage(stage.id, &change).await?;
            print(json, &changed, || told(&changed))
        }
        StageAction::Final { stage } => {
            let stage = find_stage(client, &stage).await?;
            let day = client.start_final_day(stage.id).await?;
            print(json, &day, || {
                format!("{}: final day, {} started", day.day, day.created.len())
            })
        }
        StageAction::Finalise { stage, confirm } => {
            let stage = find_stage(client, &stage).await?;
            let done = client.finalise(stage.id, confirm).await?;
            print(json, &done, || told(&done))
        }
    }
}

/// The zone of the stage that is open, or of the last.
async fn like(client: &Client) -> anyhow::Result<Zone> {
    let stages = client.stages().await?;
    let open = stages.iter().rfind(|stage| stage.phase == PhaseView::Open);
    let like = open.or(stages.last());
    Ok(like.map_or(Zone::UTC, |stage| stage.zone.clone()))
}

/// The days that do not fit into their time.
fn warnings(stage: &StageView) -> impl Iterator<Item = String> {
    let loads = stage.capacity.iter().flatten();
    let overflows = loads.filter(|load| load.fit == Fit::Not);
    overflows.map(|load| format!("\n  warning  {}", load.summary))
}

fn told(stage: &StageView) -> String {
    let there = |at: Timestamp| {
        let there = at.to_zoned(stage.zone.time_zone());
        there.strftime("%Y-%m-%d %H:%M:%S").to_string()
    };
    let phase = match stage.phase {
        PhaseView::Upcoming => "upcoming",
        PhaseView::Open => "open",
        PhaseView::Closed => "closed",
    };
    let closes = stage.closes_at.map_or_else(|| "open end".to_owned(), there);
    let rules = &stage.rules.rules;
    let tasks: Vec<&str> = rules.tasks.iter().map(|task| task.as_str()).collect();
    let next = match &stage.next_cut {
        Some(next) => next.to_string(),
        None => "none".to_owned(),
    };
    let result = match &stage.finalised {
        Some(done) => format!("signed off on {} by {}", there(done.at), done.by),
        None => "provisional".to_owned(),
    };
    let settings = &stage.settings;
    let own = [
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
    let limits: String = own
        .into_iter()
        .filter(|(_, is_own, _)| *is_own)
        .filter_map(|(name, _, json)| Some(format!("\n  {name}  {}", json.ok()?)))
        .chain(
            rules
                .runtimes
                .iter()
                .map(|runtimes| format!("\n  agents   of the runtime {runtimes} only")),
        )
        .chain(warnings(stage))
        .collect();
    let blind = if settings.blind { ", blind" } else { "" };
    format!(
        "{} ({phase}{blind})\n  id       {}\n  times    {} to {closes}, {}\n  next day {next}\n  deadline {}\n  rules    revision {} since {}: {}, {} \
         episodes of each of {}, at most {} faults\n  score    weights {}, tiers up to {} \
         points per episode, perturbations {}{limits}\n  board    by {}, {result}\n  datasets public {}\n  kept     {}",
        stage.name,
        stage.id,
        there(stage.opens_at),
        stage.zone,
        stage.settings.day_deadline,
        stage.rules.revision,
        there(stage.rules.since),
        rules.profile,
        rules.episodes_per_task,
        tasks.join(", "),
        rules.max_faults,
        rules.variation.weights,
        rules.variation.tier_bounds,
        if *rules.variation.perturbations == PerturbationSettings::default() {
            "as the ruleset has them"
        } else {
            "of its own"
        },
        settings.standings,
        match settings.publishes {
            Publishes::Never => "if their teams publish them",
            Publishes::AtClose => "at the close",
            Publishes::AtRelease => "when their day is released",
        },
        stage.retention,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_is_by_the_clocks_of_the_stage_unless_it_says_otherwise() {
        let berlin: Zone = "Europe/Berlin".parse().unwrap();
        let at = |text: &str| instant(text, &berlin).map(|at| at.to_string());
        for text in [
            "2026-12-01 06:00",
            "2026-12-01T06:00:00",
            "2026-12-01T05:00:00Z",
            "2026-12-01T06:00+01:00",
            "2026-12-01T00:00[America/New_York]",
        ] {
            assert_eq!(at(text).unwrap(), "2026-12-01T05:00:00Z", "{text}");
        }
        for wrong in ["tomorrow", "2026-13-01 06:00", ""] {
            let error = at(wrong).unwrap_err().to_string();
            assert!(error.contains("2026-12-01 06:00"), "{error}");
        }
    }
}
