//! `faceoff whoami`: whom a token speaks for.

use super::{
    output::print,
    server::{ServerArgs, Source},
};
use clap::Args;
use faceoff_api::views::person::WhoView;
use serde::Serialize;

/// Says whom the token speaks for, to which server, and where both come from.
#[derive(Debug, Args)]
pub struct WhoamiCommand {
    #[command(flatten)]
    server: ServerArgs,
}

/// What is printed with `--json`.
#[derive(Debug, Serialize)]
struct Me<'a> {
    #[serde(flatten)]
    who: &'a WhoView,
    server: &'a str,
    server_from: Source,
    token_from: Source,
}

impl WhoamiCommand {
    /// Asks the server.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async {
            let found = self.server.found()?;
            let who = self.server.client()?.whoami().await?;
            let me = Me {
                who: &who,
                server: &found.server,
                server_from: found.server_from,
                token_from: found.token_from,
            };
            print(self.server.json, &me, || {
                format!(
                    "{}\nserver {} ({}), token by {}",
                    text(&who),
                    me.server,
                    me.server_from.words("--server", "FACEOFF_SERVER"),
                    me.token_from.words("--token", "FACEOFF_TOKEN")
                )
            })
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
