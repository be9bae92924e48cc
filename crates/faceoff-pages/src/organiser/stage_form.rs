//! The most used settings of a stage as fields of a form, and what of them is to be another.

use faceoff_api::requests::{NewStage, StageChange};
use faceoff_service::problem::Problem;
use faceoff_store::Stage;
use faceoff_types::{Profile, Schedule, Task, Zone};
use jiff::{Timestamp, civil::DateTime, tz::TimeZone};
use serde::Deserialize;
use serde_json::{Value, json};
use std::fmt::Display;

/// The fields, as they are typed.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default)]
pub(super) struct StageForm {
    pub(super) name: String,
    /// In UTC, as the browser's field has it: `2026-03-01T10:00`.
    pub(super) opens_at: String,
    /// Likewise; empty: it has no end yet.
    pub(super) closes_at: String,
    pub(super) zone: String,
    pub(super) profile: String,
    pub(super) task_hit: String,
    pub(super) task_defend: String,
    pub(super) task_prepare: String,
    pub(super) episodes_per_task: String,
    pub(super) max_faults: String,
    /// A time, five fields of a cron expression, or nothing.
    pub(super) schedule: String,
    pub(super) days_off: String,
    pub(super) day_deadline: String,
    pub(super) standings: String,
    pub(super) publishes: String,
    pub(super) blind: String,
    pub(super) ablation_episodes: String,
    /// The stage's name, where something is to be confirmed.
    pub(super) confirm: String,
}

/// What a field of a browser has for a time.
fn typed(at: Timestamp) -> String {
    at.strftime("%Y-%m-%dT%H:%M").to_string()
}

const TICKED: &str = "on";

fn ticked(is: bool) -> String {
    if is { TICKED.to_owned() } else { String::new() }
}

/// A value that does not fit its field.
fn wrong(field: &str, error: impl Display) -> Problem {
    Problem::invalid(field, error)
}

fn time(field: &str, text: &str) -> Result<Option<Timestamp>, Problem> {
    if text.is_empty() {
        return Ok(None);
    }
    let at: DateTime = text.parse().map_err(|error| wrong(field, error))?;
    let at = at.to_zoned(TimeZone::UTC);
    Ok(Some(at.map_err(|error| wrong(field, error))?.timestamp()))
}

fn number(field: &str, text: &str) -> Result<u32, Problem> {
    let wrong = |_| wrong(field, format!("expected a whole number, got {text:?}"));
    text.parse().map_err(wrong)
}

impl StageForm {
    /// As a stage is now.
    pub(super) fn of(stage: &Stage) -> Self {
        let (rules, settings) = (&stage.rules.rules, &stage.settings);
        let schedule = serde_json::to_value(&settings.schedule).unwrap_or_default();
        let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
        let at = match &schedule["daily"] {
            Value::String(daily) => daily.strip_suffix(":00").unwrap_or(daily).to_owned(),
            _ => text(&schedule["cron"]),
        };
        let off = schedule["days_off"].as_array();
        let off = off.map(|dates| dates.iter().map(text).collect::<Vec<_>>().join(" "));
        let has = |task| ticked(rules.tasks.contains(&task));
        Self {
            name: stage.name.to_string(),
            opens_at: typed(stage.opens_at),
            closes_at: stage.closes_at.map(typed).unwrap_or_default(),
            zone: stage.zone.to_string(),
            profile: rules.profile.to_string(),
            task_hit: has(Task::Hit),
            task_defend: has(Task::Defend),
            task_prepare: has(Task::Prepare),
            episodes_per_task: rules.episodes_per_task.to_string(),
            max_faults: rules.max_faults.to_string(),
            schedule: at,
            days_off: off.unwrap_or_default(),
            day_deadline: settings.day_deadline.to_string(),
            standings: settings.standings.to_string(),
            publishes: settings.publishes.to_string(),
            blind: ticked(settings.blind),
            ablation_episodes: settings.ablation_episodes.to_string(),
            confirm: String::new(),
        }
    }

    /// Like another stage, for one to be made.
    pub(super) fn like(stage: &Stage) -> Self {
        Self {
            name: String::new(),
            opens_at: String::new(),
            closes_at: String::new(),
            schedule: String::new(),
            days_off: String::new(),
            ablation_episodes: "0".to_owned(),
            blind: String::new(),
            ..Self::of(stage)
        }
    }

    fn tasks(&self) -> Vec<Task> {
        let ticks = [
            (Task::Hit, &self.task_hit),
            (Task::Defend, &self.task_defend),
            (Task::Prepare, &self.task_prepare),
        ];
        let ticks = ticks.into_iter().filter(|(_, tick)| !tick.is_empty());
        ticks.map(|(task, _)| task).collect()
    }

    fn profile(&self) -> Result<Profile, Problem> {
        self.profile
            .parse()
            .map_err(|error| wrong("profile", error))
    }

    fn zone(&self) -> Result<Zone, Problem> {
        self.zone
            .trim()
            .parse()
            .map_err(|error| wrong("zone", error))
    }

    fn schedule(&self) -> Result<Option<Schedule>, Problem> {
        let at = self.schedule.trim();
        if at.is_empty() {
            return Ok(None);
        }
        let kind = if at.contains(' ') || at.starts_with('@') {
            "cron"
        } else {
            "daily"
        };
        let off = self.days_off.split([' ', ',', '\n', '\r']);
        let off: Vec<&str> = off.filter(|date| !date.is_empty()).collect();
        let fields = json!({ kind: at, "days_off": off });
        let parsed = serde_json::from_value(fields);
        parsed.map(Some).map_err(|error| wrong("schedule", error))
    }

    /// What of the stage is another in the form: what is the same stays unsaid, since much of it may not be changed at
    /// any time.
    pub(super) fn change(&self, stage: &Stage) -> Result<StageChange, Problem> {
        let is = Self::of(stage);
        let mut change = StageChange::default();
        if self.name != is.name {
            change.name = Some(self.name.clone());
        }
        if self.opens_at != is.opens_at {
            change.opens_at = time("opens_at", &self.opens_at)?;
        }
        if self.closes_at != is.closes_at {
            change.closes_at = Some(time("closes_at", &self.closes_at)?);
        }
        if self.zone != is.zone {
            change.zone = Some(self.zone()?);
        }
        if self.profile != is.profile {
            change.profile = Some(self.profile()?);
        }
        if self.tasks() != is.tasks() {
            change.tasks = Some(self.tasks());
        }
        if self.episodes_per_task != is.episodes_per_task {
            change.episodes_per_task = Some(number("episodes_per_task", &self.episodes_per_task)?);
        }
        if self.max_faults != is.max_faults {
            change.max_faults = Some(number("max_faults", &self.max_faults)?);
        }
        if (&self.schedule, &self.days_off) != (&is.schedule, &is.days_off) {
            change.schedule = Some(self.schedule()?);
        }
        let parsed = self.day_deadline.parse();
        let deadline = parsed.map_err(|error| wrong("day_deadline", error))?;
        change.day_deadline = (deadline != stage.settings.day_deadline).then_some(deadline);
        let parsed = self.standings.parse();
        let standings = parsed.map_err(|error| wrong("standings", error))?;
        change.standings = (standings != stage.settings.standings).then_some(standings);
        let parsed = self.publishes.parse();
        let publishes = parsed.map_err(|error| wrong("publishes", error))?;
        change.publishes = (publishes != stage.settings.publishes).then_some(publishes);
        if self.blind.is_empty() != is.blind.is_empty() {
            change.blind = Some(!self.blind.is_empty());
        }
        if self.ablation_episodes != is.ablation_episodes {
            change.ablation_episodes = Some(number("ablation_episodes", &self.ablation_episodes)?);
        }
        change.confirm = Some(self.confirm.clone()).filter(|name| !name.is_empty());
        Ok(change)
    }

    /// A stage to be made.
    pub(super) fn new_stage(&self) -> Result<NewStage, Problem> {
        Ok(NewStage {
            name: self.name.clone(),
            opens_at: time("opens_at", &self.opens_at)?,
            closes_at: time("closes_at", &self.closes_at)?,
            zone: Some(self.zone()?),
            profile: Some(self.profile()?),
            tasks: Some(self.tasks()),
            episodes_per_task: Some(number("episodes_per_task", &self.episodes_per_task)?),
            max_faults: Some(number("max_faults", &self.max_faults)?),
            weights: None,
            tier_bounds: None,
            perturbations: None,
            limits: None,
            runtimes: None,
            uploads: None,
            schedule: self.schedule()?,
            ablation_episodes: Some(number("ablation_episodes", &self.ablation_episodes)?),
            episodes_per_shard: None,
            day_deadline: Some(
                self.day_deadline
                    .parse()
                    .map_err(|error| wrong("day_deadline", error))?,
            ),
            blind: Some(!self.blind.is_empty()),
            publishes: Some(
                self.publishes
                    .parse()
                    .map_err(|error| wrong("publishes", error))?,
            ),
            standings: Some(
                self.standings
                    .parse()
                    .map_err(|error| wrong("standings", error))?,
            ),
            retention: None,
        })
    }
}
