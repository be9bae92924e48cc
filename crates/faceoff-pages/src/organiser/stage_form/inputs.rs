//! The inputs of the form of a stage: their labels, their texts for a stage, and the settings that are read from them.

use super::texts::StageForm;
use faceoff_api::requests::{OrNull, StagePatch};
use faceoff_service::problem::Problem;
use faceoff_store::Stage;
use faceoff_types::{IanaTimeZone, Schedule};
use jiff::{Timestamp, civil::DateTime};
use serde_json::{Value, json};
use std::{fmt::Display, str::FromStr};

/// An input of the form.
pub(in crate::organiser) struct Input {
    /// The name of the setting in the API, if this is the setting's only input.
    pub(in crate::organiser) name: &'static str,
    pub(in crate::organiser) label: &'static str,
    /// A hint beside the label: unit or format; empty if the label says enough.
    pub(in crate::organiser) hint: &'static str,
    pub(in crate::organiser) kind: InputKind,
    /// The text that the input shows for a stage.
    pub(super) text: fn(&Stage) -> String,
    /// Reads the setting of this input from the form. A setting with several inputs, such as the schedule, is read from all of them.
    pub(super) read: fn(&StageForm, &mut StagePatch) -> Result<(), Problem>,
}

pub(in crate::organiser) enum InputKind {
    Text,
    OptionalText,
    /// In the stage's time zone, in the format of an input `datetime-local`: `2026-03-01T10:00`. May be empty.
    DateTime,
    /// A whole number that is at least this one.
    Number(u32),
    /// A choice among the profiles of the competition.
    ProfileChoice,
    /// A choice among values, which have labels.
    Choice(fn() -> Vec<(&'static str, &'static str)>),
    Checkbox,
}

/// Inputs that are shown together.
pub(in crate::organiser) struct InputGroup {
    /// Title of the group; empty for a group without title and border.
    pub(in crate::organiser) legend: &'static str,
    pub(in crate::organiser) hint: &'static str,
    pub(super) inputs: &'static [Input],
    /// Is the group followed by a checkbox for each task?
    pub(in crate::organiser) has_tasks: bool,
}

impl InputGroup {
    /// All inputs but checkboxes, which are shown below.
    pub(in crate::organiser) fn fields(&self) -> impl Iterator<Item = &'static Input> {
        let inputs = self.inputs.iter();
        inputs.filter(|input| !matches!(input.kind, InputKind::Checkbox))
    }

    pub(in crate::organiser) fn checkboxes(&self) -> impl Iterator<Item = &'static Input> {
        let inputs = self.inputs.iter();
        inputs.filter(|input| matches!(input.kind, InputKind::Checkbox))
    }
}

/// The stage's name, above all groups.
pub(super) static NAME: Input = Input {
    name: "name",
    label: "Name",
    hint: "",
    kind: InputKind::Text,
    text: |stage| stage.name.to_string(),
    read: |form, patch| {
        patch.name = Some(form.text("name").to_owned());
        Ok(())
    },
};

pub(super) static GROUPS: [InputGroup; 4] = [
    InputGroup {
        legend: "",
        hint: "",
        has_tasks: false,
        inputs: &[
            Input {
                name: "opens_at",
                label: "Opens",
                hint: "",
                kind: InputKind::DateTime,
                text: |stage| datetime_local(stage.opens_at, &stage.zone),
                read: |form, patch| {
                    patch.opens_at = parse_time(form, "opens_at")?;
                    Ok(())
                },
            },
            Input {
                name: "closes_at",
                label: "Closes",
                hint: "empty: no date set",
                kind: InputKind::DateTime,
                text: |stage| {
                    let closes_at = stage.closes_at;
                    let text = closes_at.map(|instant| datetime_local(instant, &stage.zone));
                    text.unwrap_or_default()
                },
                read: |form, patch| {
                    patch.closes_at = Some(OrNull(parse_time(form, "closes_at")?));
                    Ok(())
                },
            },
            Input {
                name: "zone",
                label: "Time zone",
                hint: "",
                kind: InputKind::Text,
                text: |stage| stage.zone.to_string(),
                read: |form, patch| parse(form, "zone", &mut patch.zone),
            },
        ],
    },
    InputGroup {
        legend: "Daily cutoff",
        hint: "",
        has_tasks: false,
        inputs: &[
            Input {
                name: "schedule",
                label: "Time or cron expression",
                hint: "06:00 or 0 6 * * 1-5; empty: the organisers start each day",
                kind: InputKind::OptionalText,
                text: time_or_cron,
                read: read_schedule,
            },
            Input {
                name: "days_off",
                label: "Dates without an evaluation day",
                hint: "2026-12-24 2026-12-25",
                kind: InputKind::OptionalText,
                text: days_off,
                read: read_schedule,
            },
            Input {
                name: "day_deadline",
                label: "Deadline of a day",
                hint: "next-cut: the next daily cutoff; never; or hours such as 30h",
                kind: InputKind::Text,
                text: |stage| stage.settings.day_deadline.to_string(),
                read: |form, patch| parse(form, "day_deadline", &mut patch.day_deadline),
            },
        ],
    },
    InputGroup {
        legend: "Rules",
        hint: "a change of an open stage starts a new revision with its own, empty board",
        has_tasks: true,
        inputs: &[
            Input {
                name: "profile",
                label: "Perturbations",
                hint: "differences from the simulator that teams have",
                kind: InputKind::ProfileChoice,
                text: |stage| stage.revision.rules.profile.to_string(),
                read: |form, patch| parse(form, "profile", &mut patch.profile),
            },
            Input {
                name: "episodes_per_task",
                label: "Episodes per task",
                hint: "",
                kind: InputKind::Number(1),
                text: |stage| stage.revision.rules.episodes_per_task.to_string(),
                read: |form, patch| {
                    parse_number(form, "episodes_per_task", &mut patch.episodes_per_task)
                },
            },
            Input {
                name: "max_faults",
                label: "Faults allowed",
                hint: "agent faults (crashes, invalid or missing answers) in an evaluation; with more, there is no score",
                kind: InputKind::Number(0),
                text: |stage| stage.revision.rules.max_faults.to_string(),
                read: |form, patch| parse_number(form, "max_faults", &mut patch.max_faults),
            },
        ],
    },
    InputGroup {
        legend: "Boards and files",
        hint: "",
        has_tasks: false,
        inputs: &[
            Input {
                name: "standings",
                label: "Which result counts",
                hint: "latest: the newest; best: the highest ranked; final: only that of the final day, after the stage has closed; \
mean_of_last:5: the mean of the last 5 days",
                kind: InputKind::Text,
                text: |stage| stage.settings.counting_result.to_string(),
                read: |form, patch| parse(form, "standings", &mut patch.counting_result),
            },
            Input {
                name: "publishes",
                label: "Datasets become public",
                hint: "",
                kind: InputKind::Choice(publications),
                text: |stage| stage.settings.publishes.to_string(),
                read: |form, patch| parse(form, "publishes", &mut patch.publishes),
            },
            Input {
                name: "ablation_episodes",
                label: "Ablation episodes",
                hint: "per task and profile, of the ablation of each new submission at a scheduled cutoff (the same episodes without \
perturbations, with each one alone, and with all; counts for no board); 0: no ablations",
                kind: InputKind::Number(0),
                text: |stage| stage.settings.ablation_episodes.to_string(),
                read: |form, patch| {
                    parse_number(form, "ablation_episodes", &mut patch.ablation_episodes)
                },
            },
            Input {
                name: "blind",
                label: "Blind: only organisers see scores",
                hint: "",
                kind: InputKind::Checkbox,
                text: |stage| checkbox_text(stage.settings.blind),
                read: |form, patch| {
                    patch.blind = Some(form.is_ticked("blind"));
                    Ok(())
                },
            },
        ],
    },
];

fn publications() -> Vec<(&'static str, &'static str)> {
    vec![
        ("never", "never"),
        ("at_close", "when the stage closes"),
        ("at_release", "when their day is released"),
    ]
}

fn invalid_field(name: &str, error: impl Display) -> Problem {
    Problem::invalid(name, error)
}

/// Parses the text of the input `name`.
fn parse<T: FromStr<Err: Display>>(
    form: &StageForm,
    name: &str,
    setting: &mut Option<T>,
) -> Result<(), Problem> {
    let parsed = form.text(name).trim().parse();
    *setting = Some(parsed.map_err(|error| invalid_field(name, error))?);
    Ok(())
}

fn parse_number(form: &StageForm, name: &str, setting: &mut Option<u32>) -> Result<(), Problem> {
    let text = form.text(name);
    let invalid = |_| invalid_field(name, format!("expected a whole number, got {text:?}"));
    *setting = Some(text.parse().map_err(invalid)?);
    Ok(())
}

/// A time in the stage's time zone, in the format of an input `datetime-local`.
fn datetime_local(instant: Timestamp, zone: &IanaTimeZone) -> String {
    let local = instant.to_zoned(zone.time_zone());
    local.strftime("%Y-%m-%dT%H:%M").to_string()
}

fn parse_time(form: &StageForm, name: &str) -> Result<Option<Timestamp>, Problem> {
    let text = form.text(name);
    if text.is_empty() {
        return Ok(None);
    }
    let local: DateTime = text.parse().map_err(|error| invalid_field(name, error))?;
    let zone: IanaTimeZone = form
        .zone()
        .parse()
        .map_err(|error| invalid_field("zone", error))?;
    let zoned = local.to_zoned(zone.time_zone());
    Ok(Some(
        zoned
            .map_err(|error| invalid_field(name, error))?
            .timestamp(),
    ))
}

/// The text of a checkbox: the value that a browser sends if it is ticked.
fn checkbox_text(is_ticked: bool) -> String {
    if is_ticked {
        "on".to_owned()
    } else {
        String::new()
    }
}

fn schedule_json(stage: &Stage) -> Value {
    serde_json::to_value(&stage.settings.schedule).unwrap_or_default()
}

fn json_text(value: &Value) -> String {
    value.as_str().unwrap_or_default().to_owned()
}

fn time_or_cron(stage: &Stage) -> String {
    let schedule = schedule_json(stage);
    match &schedule["daily"] {
        Value::String(daily) => daily.strip_suffix(":00").unwrap_or(daily).to_owned(),
        _ => json_text(&schedule["cron"]),
    }
}

fn days_off(stage: &Stage) -> String {
    let schedule = schedule_json(stage);
    let dates = schedule["days_off"].as_array();
    let dates = dates.map(|dates| dates.iter().map(json_text).collect::<Vec<_>>().join(" "));
    dates.unwrap_or_default()
}

/// Reads a daily cutoff: a time, a cron expression of five fields, or nothing if an organiser starts each day. Dates without
/// an evaluation are separated by spaces or commas.
fn read_schedule(form: &StageForm, patch: &mut StagePatch) -> Result<(), Problem> {
    let time_or_cron = form.text("schedule").trim();
    if time_or_cron.is_empty() {
        patch.schedule = Some(OrNull(None));
        return Ok(());
    }
    let kind = if time_or_cron.contains(' ') || time_or_cron.starts_with('@') {
        "cron"
    } else {
        "daily"
    };
    let dates = form.text("days_off").split([' ', ',', '\n', '\r']);
    let dates: Vec<&str> = dates.filter(|date| !date.is_empty()).collect();
    let fields = json!({ kind: time_or_cron, "days_off": dates });
    let schedule: Schedule =
        serde_json::from_value(fields).map_err(|error| invalid_field("schedule", error))?;
    patch.schedule = Some(OrNull(Some(schedule)));
    Ok(())
}
