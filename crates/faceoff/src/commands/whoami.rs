//! `faceoff whoami`: prints the account of a token.

use super::{
    output::print,
    server::{ServerArgs, Source},
};
use clap::Args;
use faceoff_api::views::user::CallerView;
use serde::Serialize;

/// Shows the account of the token, the server, and the sources of both settings.
#[derive(Debug, Args)]
pub struct WhoamiCommand {
    #[command(flatten)]
    server: ServerArgs,
}

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct WhoamiView<'a> {
    #[serde(flatten)]
    caller: &'a CallerView,
    server: &'a str,
    server_from: Source,
    token_from: Source,
}

impl WhoamiCommand {
    /// Requests the account and prints it.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async {
            let connection = self.server.connection()?;
            let caller = self.server.client()?.whoami().await?;
            let view = WhoamiView {
                caller: &caller,
                server: &connection.server,
                server_from: connection.server_source,
                token_from: connection.token_source,
            };
            print(self.server.json, &view, |view| {
                format!(
                    "{}\nserver {} ({}), token from {}",
                    whoami_text(&caller),
                    view.server,
                    view.server_from.text("--server", "FACEOFF_SERVER"),
                    view.token_from.text("--token", "FACEOFF_TOKEN")
                )
            })
        })
    }
}

/// User, role, team and token as one line.
pub(super) fn whoami_text(caller: &CallerView) -> String {
    let team = caller.team.as_ref();
    let of_team = team.map(|team| format!(" of the team {} ({})", team.name, team.id));
    let role = match caller.role.as_str() {
        // Roles by their names in the API: a token of a team belongs to no user, `host` is the operator.
        "team" => "API client",
        "host" => "operator, with the rights of an organiser",
        "organiser" => "organiser",
        role => role,
    };
    let person = match &caller.person {
        Some(person) => format!("{} ({}), ", person.name, person.id),
        None => String::new(),
    };
    format!(
        "{person}{role}{}, with the token “{}” ({})",
        of_team.unwrap_or_default(),
        caller.token.name,
        caller.token.id
    )
}
