//! `faceoff register`: registers a team.

use super::{output::print, server::ServerArgs};
use clap::Args;
use faceoff_api::requests::{FoundedTeam, RegistrationRequest};
use faceoff_types::{DivisionName, TeamName};

/// Registers a team, if registration is open, and prints the link for its first member, which works after an
/// organiser's approval and is shown only once.
#[derive(Debug, Args)]
pub struct RegisterCommand {
    /// The team's name
    team: TeamName,
    /// Contact address, shown to organisers only
    #[arg(long)]
    contact: String,
    /// The team's affiliation
    #[arg(long)]
    affiliation: Option<String>,
    /// The team's web page
    #[arg(long, value_name = "URL")]
    link: Option<String>,
    /// The team's division
    #[arg(long)]
    division: Option<DivisionName>,
    /// The version of the terms that the team accepts, if the season has terms
    #[arg(long, value_name = "VERSION")]
    accept_terms: Option<u32>,
    #[command(flatten)]
    server: ServerArgs,
}

impl RegisterCommand {
    /// Registers the team.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        let registration = RegistrationRequest {
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
            let created = self
                .server
                .client_with_optional_token()?
                .register(&registration)
                .await?;
            print(self.server.json, &created, |created| {
                format!(
                    "registered; waiting for the approval of an organiser\n{}\nThe link is not shown again. It shows the state of the \
                    registration; after the approval, the first member joins with it (faceoff join LINK).",
                    created.join_link
                )
            })
        })
    }
}
