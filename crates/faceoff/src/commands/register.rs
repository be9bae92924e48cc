//! `faceoff register`: a team wants to take part.

use super::{output::print, server::ServerArgs};
use clap::Args;
use faceoff_api::requests::{FoundedTeam, Register};
use faceoff_types::{DivisionName, TeamName};

/// Registers a team, where the season takes registrations, and prints the link by which its first member joins once an
/// organiser has approved it, this once.
#[derive(Debug, Args)]
pub struct RegisterCommand {
    /// The team's name
    team: TeamName,
    /// How the organisers reach it; nobody else sees it
    #[arg(long)]
    contact: String,
    /// Where it is from
    #[arg(long)]
    affiliation: Option<String>,
    /// Its page
    #[arg(long, value_name = "URL")]
    link: Option<String>,
    /// The division that it wants to be in
    #[arg(long)]
    division: Option<DivisionName>,
    /// The version of the terms that it accepts, if there are terms
    #[arg(long, value_name = "VERSION")]
    accept_terms: Option<u32>,
    #[command(flatten)]
    server: ServerArgs,
}

impl RegisterCommand {
    /// Registers it.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        let wanted = Register {
            team: FoundedTeam {
                name: self.team,
                affiliation: self.affiliation,
                link: self.link,
                division: self.division,
            },
            contact: self.contact,
            accepted_terms: self.accept_terms,
        };
        super::block_on(async {
            let made = self.server.anybody()?.register(&wanted).await?;
            print(self.server.json, &made, || {
                format!(
                    "registered; an organiser looks at it\n{}\nThe link is not shown again: it says where the registration stands, \
                     and once it is approved the first member joins there (faceoff join LINK).",
                    made.join_link
                )
            })
        })
    }
}
