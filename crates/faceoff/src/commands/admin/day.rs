//! `faceoff admin freeze`, `missed-day`, `extra-turn`: what the organiser does with boards and days beside the schedule.

use super::{find::find_team, lines::line};
use crate::{
    client::Client,
    commands::{find_stage::find_stage, output::print},
};
use clap::Subcommand;
use faceoff_api::requests::{ExtraTurn, MissedDay};
use faceoff_types::StageDay;
use jiff::civil::Date;

#[derive(Debug, Subcommand)]
pub(super) enum DayAction {
    /// Freeze the boards of a stage: they show what they show now, and say so; days go on
    Freeze {
        /// The stage's name or id
        stage: String,
        /// Shown to everybody
        reason: String,
    },
    /// Have the boards of a stage show everything again
    Unfreeze {
        /// The stage's name or id
        stage: String,
    },
    /// Play a day that was missed, a date that has passed without a cut, with what is active now
    MissedDay {
        /// Its date
        day: Date,
        /// Shown to everybody
        reason: String,
        /// The stage's name or id
        #[arg(long)]
        stage: String,
    },
    /// Give one team one more evaluation of a day; without --confirm, say what it would replace
    ExtraTurn {
        /// The team's name or id
        team: String,
        /// The day's date
        day: Date,
        /// Shown to everybody
        reason: String,
        /// The stage's name or id
        #[arg(long)]
        stage: String,
        /// The team's name, if a result that counts is to be replaced
        #[arg(long, value_name = "TEAM")]
        confirm: Option<String>,
    },
}

pub(super) async fn act(client: &Client, json: bool, action: DayAction) -> anyhow::Result<()> {
    match action {
        DayAction::Freeze { stage, reason } => {
            let stage = find_stage(client, &stage).await?;
            let frozen = client.freeze(stage.id, &reason).await?;
            print(json, &frozen, || {
                format!("the boards of {} are frozen", frozen.name)
            })
        }
        DayAction::Unfreeze { stage } => {
            let stage = find_stage(client, &stage).await?;
            let live = client.unfreeze(stage.id).await?;
            print(json, &live, || {
                format!("the boards of {} show everything", live.name)
            })
        }
        DayAction::MissedDay { day, reason, stage } => {
            let stage = find_stage(client, &stage).await?;
            let wanted = MissedDay { day, reason };
            let started = client.start_missed_day(stage.id, &wanted).await?;
            print(json, &started, || {
                let mut lines = vec![format!(
                    "{}: {} started",
                    started.day,
                    started.created.len()
                )];
                lines.extend(started.created.iter().map(line));
                lines.join("\n")
            })
        }
        DayAction::ExtraTurn {
            team,
            day,
            reason,
            stage,
            confirm,
        } => {
            let of = StageDay {
                stage: find_stage(client, &stage).await?.id,
                date: day,
            };
            let wanted = ExtraTurn {
                team: find_team(client, &team).await?,
                reason,
                confirm,
            };
            let turn = client.extra_turn(of, &wanted).await?;
            print(json, &turn, || line(&turn))
        }
    }
}
