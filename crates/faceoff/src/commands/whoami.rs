//! `faceoff whoami`: whom a token speaks for.

use super::{output::print, team_server::TeamServer};
use clap::Args;
use faceoff_http::views::person::WhoView;

/// Says whom the token speaks for.
#[derive(Debug, Args)]
pub struct WhoamiCommand {
    #[command(flatten)]
    server: TeamServer,
    /// Print the server's answer as JSON
    #[arg(long)]
    json: bool,
}

impl WhoamiCommand {
    /// Asks the server.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async {
            let who = self.server.client()?.whoami().await?;
            print(self.json, &who, || text(&who))
        })
    }
}

/// Who it is, in words.
pub(super) fn text(who: &WhoView) -> String {
    let team = who.team.as_ref();
    let of_team = team.map(|team| format!(" of the team {} ({})", team.name, team.id));
    let role = match who.role.as_str() {
        "team" => "a program",
        "host" => "the host, which may do what organisers may",
        "organiser" => "organiser",
        role => role,
    };
    let person = match &who.person {
        Some(person) => format!("{} ({}), ", person.name, person.id),
        None => String::new(),
    };
    format!(
        "{person}{role}{}, by the token {} ({})",
        of_team.unwrap_or_default(),
        who.token.name,
        who.token.id
    )
}
