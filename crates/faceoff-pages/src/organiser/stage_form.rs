//! A form with the most important settings of a stage, and the conversion into requests of the API.

use faceoff_api::requests::{NewStage, StageChange};
use faceoff_service::problem::Problem;
use faceoff_store::Stage;
use faceoff_types::{Profile, Schedule, Task, Zone};
use jiff::{Timestamp, civil::DateTime, tz::TimeZone};
use serde::Deserialize;
use serde_json::{Value, json};
use std::fmt::Display;

/// Fields as typed.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default)]
pub(super) struct StageForm {
    pub(super) name: String,
    /// In UTC, in the format of an input `datetime-local`: `2026-03-01T10:00`.
    pub(super) opens_at: String,
    /// As `opens_at`; empty: no date set.
    pub(super) closes_at: String,
    pub(super) zone: String,
    pub(super) profile: String,
    /// Checkboxes: empty if not ticked, as `blind`.
    pub(super) task_hit: String,
    pub(super) task_defend: String,
    pub(super) task_prepare: String,
    pub(super) episodes_per_task: String,
    pub(super) max_faults: String,
    /// Daily cutoff: a time, a cron expression of five fields, or empty if an organiser starts each day.
    pub(super) schedule: String,
    /// Dates without an evaluation, separated by spaces or commas.
    pub(super) days_off: String,
    /// `next-cut` (the next cutoff), `never`, or hours such as `30h`.
    pub(super) day_deadline: String,
    /// Which result of a team counts: `latest`, `best`, `final` or `mean_of_last:5`.
    pub(super) standings: String,
    /// When datasets become public: `never`, `at_close` or `at_release`.
    pub(super) publishes: String,
    pub(super) blind: String,
    pub(super) ablation_episodes: String,
    /// Name of the stage, if the change needs a confirmation.
    pub(super) confirm: String,
}

/// A time in the format of an input `datetime-local`.
fn datetime_local(instant: Timestamp) -> String {
    instant.strftime("%Y-%m-%dT%H:%M").to_string()
}

/// Value that a browser sends for a ticked checkbox.
const TICKED: &str = "on";

fn checkbox_value(is_ticked: bool) -> String {
    if is_ticked {
        TICKED.to_owned()
    } else {
        String::new()
    }
}

fn invalid_field(field: &str, error: impl Display) -> Problem {
    Problem::invalid(field, error)
}

fn parse_time(field: &str, text: &str) -> Result<Option<Timestamp>, Problem> {
    if text.is_empty() {
        return Ok(None);
    }
    let local: DateTime = text.parse().map_err(|error| invalid_field(field, error))?;
    let zoned = local.to_zoned(TimeZone::UTC);
    Ok(Some(
        zoned
            .map_err(|error| invalid_field(field, error))?
            .timestamp(),
    ))
}

fn parse_number(field: &str, text: &str) -> Result<u32, Problem> {
    let invalid = |_| invalid_field(field, format!("expected a whole number, got {text:?}"));
    text.parse().map_err(invalid)
}

impl StageForm {
    /// The current settings of a stage.
    pub(super) fn from_stage(stage: &Stage) -> Self {
        let (rules, settings) = (&stage.rules.rules, &stage.settings);
        let schedule = serde_json::to_value(&settings.schedule).unwrap_or_default();
        let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
        let time_or_cron = match &schedule["daily"] {
            Value::String(daily) => daily.strip_suffix(":00").unwrap_or(daily).to_owned(),
            _ => text(&schedule["cron"]),
        };
        let days_off = schedule["days_off"].as_array();
        let days_off = days_off.map(|dates| dates.iter().map(text).collect::<Vec<_>>().join(" "));
        let task_checkbox = |task| checkbox_value(rules.tasks.contains(&task));
        Self {
            name: stage.name.to_string(),
            opens_at: datetime_local(stage.opens_at),
            closes_at: stage.closes_at.map(datetime_local).unwrap_or_default(),
            zone: stage.zone.to_string(),
            profile: rules.profile.to_string(),
            task_hit: task_checkbox(Task::Hit),
            task_defend: task_checkbox(Task::Defend),
            task_prepare: task_checkbox(Task::Prepare),
            episodes_per_task: rules.episodes_per_task.to_string(),
            max_faults: rules.max_faults.to_string(),
            schedule: time_or_cron,
            days_off: days_off.unwrap_or_default(),
            day_deadline: settings.day_deadline.to_string(),
            standings: settings.standings.to_string(),
            publishes: settings.publishes.to_string(),
            blind: checkbox_value(settings.blind),
            ablation_episodes: settings.ablation_episodes.to_string(),
            confirm: String::new(),
        }
    }

    /// Default settings for a new stage: those of `stage` without name and dates.
    pub(super) fn defaults_from(stage: &Stage) -> Self {
        Self {
            name: String::new(),
            opens_at: String::new(),
            closes_at: String::new(),
            schedule: String::new(),
            days_off: String::new(),
            ablation_episodes: "0".to_owned(),
            blind: String::new(),
            ..Self::from_stage(stage)
        }
    }

    fn tasks(&self) -> Vec<Task> {
        let checkboxes = [
            (Task::Hit, &self.task_hit),
            (Task::Defend, &self.task_defend),
            (Task::Prepare, &self.task_prepare),
        ];
        let ticked = checkboxes
            .into_iter()
            .filter(|(_, value)| !value.is_empty());
        ticked.map(|(task, _)| task).collect()
    }

    fn profile(&self) -> Result<Profile, Problem> {
        self.profile
            .parse()
            .map_err(|error| invalid_field("profile", error))
    }

    fn zone(&self) -> Result<Zone, Problem> {
        self.zone
            .trim()
            .parse()
            .map_err(|error| invalid_field("zone", error))
    }

    fn schedule(&self) -> Result<Option<Schedule>, Problem> {
        let time_or_cron = self.schedule.trim();
        if time_or_cron.is_empty() {
            return Ok(None);
        }
        let kind = if time_or_cron.contains(' ') || time_or_cron.starts_with('@') {
            "cron"
        } else {
            "daily"
        };
        let dates = self.days_off.split([' ', ',', '\n', '\r']);
        let dates: Vec<&str> = dates.filter(|date| !date.is_empty()).collect();
        let fields = json!({ kind: time_or_cron, "days_off": dates });
        let parsed = serde_json::from_value(fields);
        parsed
            .map(Some)
            .map_err(|error| invalid_field("schedule", error))
    }

    /// The differences between the form and the stage. Unchanged settings are omitted, since many of them cannot be changed at
    /// any time.
    pub(super) fn change(&self, stage: &Stage) -> Result<StageChange, Problem> {
        let current = Self::from_stage(stage);
        let mut change = StageChange::default();
        if self.name != current.name {
            change.name = Some(self.name.clone());
        }
        if self.opens_at != current.opens_at {
            change.opens_at = parse_time("opens_at", &self.opens_at)?;
        }
        if self.closes_at != current.closes_at {
            change.closes_at = Some(parse_time("closes_at", &self.closes_at)?);
        }
        if self.zone != current.zone {
            change.zone = Some(self.zone()?);
        }
        if self.profile != current.profile {
            change.profile = Some(self.profile()?);
        }
        if self.tasks() != current.tasks() {
            change.tasks = Some(self.tasks());
        }
        if self.episodes_per_task != current.episodes_per_task {
            change.episodes_per_task =
                Some(parse_number("episodes_per_task", &self.episodes_per_task)?);
        }
        if self.max_faults != current.max_faults {
            change.max_faults = Some(parse_number("max_faults", &self.max_faults)?);
        }
        if (&self.schedule, &self.days_off) != (&current.schedule, &current.days_off) {
            change.schedule = Some(self.schedule()?);
        }
        let parsed = self.day_deadline.parse();
        let deadline = parsed.map_err(|error| invalid_field("day_deadline", error))?;
        change.day_deadline = (deadline != stage.settings.day_deadline).then_some(deadline);
        let parsed = self.standings.parse();
        let standings = parsed.map_err(|error| invalid_field("standings", error))?;
        change.standings = (standings != stage.settings.standings).then_some(standings);
        let parsed = self.publishes.parse();
        let publishes = parsed.map_err(|error| invalid_field("publishes", error))?;
        change.publishes = (publishes != stage.settings.publishes).then_some(publishes);
        if self.blind.is_empty() != current.blind.is_empty() {
            change.blind = Some(!self.blind.is_empty());
        }
        if self.ablation_episodes != current.ablation_episodes {
            change.ablation_episodes =
                Some(parse_number("ablation_episodes", &self.ablation_episodes)?);
        }
        change.confirm = Some(self.confirm.clone()).filter(|name| !name.is_empty());
        Ok(change)
    }

    /// The request for a new stage.
    pub(super) fn new_stage(&self) -> Result<NewStage, Problem> {
        Ok(NewStage {
            name: self.name.clone(),
            opens_at: parse_time("opens_at", &self.opens_at)?,
            closes_at: parse_time("closes_at", &self.closes_at)?,
            zone: Some(self.zone()?),
            profile: Some(self.profile()?),
            tasks: Some(self.tasks()),
            episodes_per_task: Some(parse_number("episodes_per_task", &self.episodes_per_task)?),
            max_faults: Some(parse_number("max_faults", &self.max_faults)?),
            weights: None,
            tier_bounds: None,
            perturbations: None,
            limits: None,
            runtimes: None,
            uploads: None,
            schedule: self.schedule()?,
            ablation_episodes: Some(parse_number("ablation_episodes", &self.ablation_episodes)?),
            episodes_per_shard: None,
            day_deadline: Some(
                self.day_deadline
                    .parse()
                    .map_err(|error| invalid_field("day_deadline", error))?,
            ),
            blind: Some(!self.blind.is_empty()),
            publishes: Some(
                self.publishes
                    .parse()
                    .map_err(|error| invalid_field("publishes", error))?,
            ),
            standings: Some(
                self.standings
                    .parse()
                    .map_err(|error| invalid_field("standings", error))?,
            ),
            retention: None,
        })
    }
}
