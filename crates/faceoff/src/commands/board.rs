//! `faceoff board`: prints a *board*, the ranking of the teams of a stage by their results. A board that an organiser has
//! *frozen* keeps its results, while new evaluations continue.

pub(super) mod table;

use super::{output::print, server::ServerArgs, stage_lookup::find_stage};
use crate::competition::parse_task;
use clap::{Args, ValueEnum};
use faceoff_api::requests::{BoardBy, BoardQuery};
use faceoff_types::{DivisionName, Task};
use jiff::civil::Date;

/// Shows a board: overall, or of one task.
#[derive(Debug, Args)]
pub struct BoardCommand {
    /// hit, defend or prepare [default: overall]
    #[arg(value_parser = parse_task)]
    task: Option<Task>,
    /// The stage's name or id [default: the open stage, or the nearest]
    #[arg(long)]
    stage: Option<String>,
    /// Only the teams of this division, ranked among themselves
    #[arg(long)]
    division: Option<DivisionName>,
    /// Revision of the stage's rules [default: the newest with results]
    #[arg(long, value_name = "N")]
    revision: Option<u32>,
    /// The board after this evaluation day, e.g. 2026-03-01
    #[arg(long, value_name = "DAY")]
    day: Option<Date>,
    /// Rank by each team's best or latest result instead of the stage's own rule
    #[arg(long)]
    by: Option<RankBy>,
    /// For organisers: show the live results of a frozen board
    #[arg(long)]
    live: bool,
    /// Print CSV with a header line; rates are fractions, the score is in percent
    #[arg(long, conflicts_with = "json")]
    csv: bool,
    #[command(flatten)]
    server: ServerArgs,
}

/// The result that ranks a team.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum RankBy {
    Best,
    Latest,
}

impl RankBy {
    const fn to_api(self) -> BoardBy {
        match self {
            Self::Best => BoardBy::Best,
            Self::Latest => BoardBy::Latest,
        }
    }
}

impl BoardCommand {
    /// Requests the board and prints it.
    ///
    /// # Errors
    /// If the server cannot be reached, or has no such stage or division.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async {
            let client = self.server.client_with_optional_token()?;
            let stage = match &self.stage {
                Some(stage) => Some(find_stage(&client, stage).await?.id),
                None => None,
            };
            let query = BoardQuery {
                stage,
                revision: self.revision,
                division: self.division,
                day: self.day,
                by: self.by.map(RankBy::to_api),
                live: self.live,
                format: None,
            };
            if self.csv {
                print!("{}", client.board_csv(self.task, &query).await?);
                return Ok(());
            }
            let board = client.board(self.task, &query).await?;
            print(self.server.json, &board, table::board_text)
        })
    }
}
