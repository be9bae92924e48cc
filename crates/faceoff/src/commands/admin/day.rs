//! `faceoff admin start-day`, `freeze`, `unfreeze`, `missed-day` and `extra-turn`: changes of boards and evaluation days, i.e. of all
//! evaluations of one cutoff. `extra-turn` adds one evaluation.

use super::{
    evaluation_lines::{evaluation_line, evaluation_lines},
    team_lookup::find_team,
};
use crate::{
    client::Client,
    commands::{output::print, stage_lookup::find_stage},
};
use clap::Subcommand;
use faceoff_api::{
    requests::{MissedDay, NewExtraEvaluation},
    views::day::DayView,
};
use faceoff_types::StageDay;
use jiff::civil::Date;

#[derive(Debug, Subcommand)]
pub(super) enum DayAction {
    /// Start an evaluation day: the active submission of each team is evaluated. A day starts only once
    StartDay {
        /// The stage's name or id [default: the open stage]
        #[arg(long)]
        stage: Option<String>,
    },
    /// Freeze the boards of a stage: they keep their current results and are marked as frozen; evaluation days continue
    Freeze {
        /// The stage's name or id
        stage: String,
        /// Shown publicly
        reason: String,
    },
    /// Unfreeze the boards of a stage: they show all released results again
    Unfreeze {
        /// The stage's name or id
        stage: String,
    },
    /// Start an evaluation day for a past date without a cutoff, with the submissions that are active now
    MissedDay {
        /// The date of the day
        day: Date,
        /// Shown publicly
        reason: String,
        /// The stage's name or id
        #[arg(long)]
        stage: String,
    },
    /// Add one evaluation of a team to an evaluation day; without --confirm, only name the result it would replace
    ExtraTurn {
        /// The team's name or id
        team: String,
        /// The date of the day
        day: Date,
        /// Shown publicly
        reason: String,
        /// The stage's name or id
        #[arg(long)]
        stage: String,
        /// The team's name, as confirmation that a counting result is replaced
        #[arg(long, value_name = "TEAM")]
        confirm: Option<String>,
    },
}

pub(super) async fn run_action(
    client: &Client,
    json: bool,
    action: DayAction,
) -> anyhow::Result<()> {
    match action {
        DayAction::StartDay { stage } => {
            let stage = match stage {
                Some(stage) => Some(find_stage(client, &stage).await?.id),
                None => None,
            };
            let started = client.start_day(stage).await?;
            print(json, &started, |day| {
                let lines = [started_lines(day), missing_lines(day)];
                lines.concat().join("\n")
            })
        }
        DayAction::Freeze { stage, reason } => {
            let stage = find_stage(client, &stage).await?;
            let frozen = client.freeze(stage.id, reason).await?;
            print(json, &frozen, |frozen| {
                format!("the boards of {} are frozen", frozen.name)
            })
        }
        DayAction::Unfreeze { stage } => {
            let stage = find_stage(client, &stage).await?;
            let unfrozen = client.unfreeze(stage.id).await?;
            print(json, &unfrozen, |unfrozen| {
                format!("the boards of {} are live again", unfrozen.name)
            })
        }
        DayAction::MissedDay { day, reason, stage } => {
            let stage = find_stage(client, &stage).await?;
            let missed = MissedDay { day, reason };
            let started = client.start_missed_day(stage.id, &missed).await?;
            print(json, &started, |day| started_lines(day).join("\n"))
        }
        DayAction::ExtraTurn {
            team,
            day,
            reason,
            stage,
            confirm,
        } => {
            let stage_day = StageDay {
                stage: find_stage(client, &stage).await?.id,
                date: day,
            };
            let extra = NewExtraEvaluation {
                team: find_team(client, &team).await?,
                reason,
                confirm,
            };
            let evaluation = client.add_evaluation(stage_day, &extra).await?;
            print(json, &evaluation, evaluation_line)
        }
    }
}

/// The evaluations that a day has started.
fn started_lines(day: &DayView) -> Vec<String> {
    let started = format!("{}: {} evaluations started", day.day, day.evaluations.len());
    [vec![started], evaluation_lines(day)].concat()
}

/// The teams without an evaluation on that day.
fn missing_lines(day: &DayView) -> Vec<String> {
    let without_submission = day.without_submission.iter();
    let without_submission =
        without_submission.map(|team| format!("{:<40} no valid submission", team.name));
    let excluded = day.excluded.iter();
    without_submission
        .chain(excluded.map(|excluded| format!("{:<40} {}", excluded.team_name, excluded.reason)))
        .collect()
}
