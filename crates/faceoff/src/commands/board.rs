//! `faceoff board`: who stands where.

pub(super) mod table;

use super::{find_stage::find_stage, output::print, server::ServerArgs};
use clap::{Args, ValueEnum};
use faceoff_api::requests::{BoardBy, BoardQuery};
use faceoff_types::{DivisionName, Task};
use jiff::civil::Date;

/// Shows a board: the overall one, or that of one task.
#[derive(Debug, Args)]
pub struct BoardCommand {
    /// hit, defend or prepare [default: all of them together]
    task: Option<Task>,
    /// The stage's name or id [default: the one that is open, or the nearest]
    #[arg(long)]
    stage: Option<String>,
    /// The teams of this division alone, ranked among themselves
    #[arg(long)]
    division: Option<DivisionName>,
    /// By which of the stage's rules [default: the newest with results]
    #[arg(long, value_name = "N")]
    revision: Option<u32>,
    /// As it stood by the results of the days up to this one, as 2026-03-01
    #[arg(long, value_name = "DAY")]
    day: Option<Date>,
    /// By each team's best result, or by its latest, whatever the stage counts in the end
    #[arg(long)]
    by: Option<By>,
    /// As an organiser: of a frozen board what it would show
    #[arg(long)]
    live: bool,
    /// Print it as CSV, with a line of names: rates are fractions, the score is in percent
    #[arg(long, conflicts_with = "json")]
    csv: bool,
    #[command(flatten)]
    server: ServerArgs,
}

/// Which result of a team its row is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum By {
    Best,
    Latest,
}

impl By {
    const fn asked(self) -> BoardBy {
        match self {
            Self::Best => BoardBy::Best,
            Self::Latest => BoardBy::Latest,
        }
    }
}

impl BoardCommand {
    /// Asks the server.
    ///
    /// # Errors
    /// If it cannot be reached, or there is no such stage or division.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async {
            let client = self.server.anybody()?;
            let stage = match &self.stage {
                Some(stage) => Some(find_stage(&client, stage).await?.id),
                None => None,
            };
            let wanted = BoardQuery {
                stage,
                revision: self.revision,
                division: self.division,
                day: self.day,
                by: self.by.map(By::asked),
                live: self.live,
                format: None,
            };
            if self.csv {
                print!("{}", client.board_csv(self.task, &wanted).await?);
                return Ok(());
            }
            let board = client.board(self.task, &wanted).await?;
            print(self.server.json, &board, || table::whole(&board))
        })
    }
}
