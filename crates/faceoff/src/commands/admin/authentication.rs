//! The token that the organisers' commands use.

use crate::{
    client::Client,
    commands::{serve::ADMIN_TOKEN_FILE, server::Connection},
    config::Config,
    exit::NotSignedIn,
};
use anyhow::Context;
use std::{net::IpAddr, path::Path};

/// A client with the first token of: `--token` or `FACEOFF_ADMIN_TOKEN`; the host's, if `--data-dir` names its data
/// folder; the login to the server; the host's in the local data folder, if the server runs on this machine. The
/// host's token is never sent to another machine unless `--data-dir` asks for it.
pub(super) fn admin_client(
    server: Option<&str>,
    token: Option<&str>,
    data_dir: Option<&Path>,
    ca_file: Option<&Path>,
) -> anyhow::Result<Client> {
    let option = token.map(|token| (token, "FACEOFF_ADMIN_TOKEN"));
    let mut found = Connection::resolve(server, option, ca_file)?;
    let is_given = token.is_some() || (data_dir.is_none() && found.token.is_some());
    if !is_given {
        if data_dir.is_none() && !is_local(&found.server) {
            return Err(NotSignedIn(format!(
                "not signed in to {}: sign in with faceoff login, or give the token with --token or \
                FACEOFF_ADMIN_TOKEN, or name the server's data folder with --data-dir",
                found.server
            ))
            .into());
        }
        found.token = Some(read_host_token(data_dir)?.trim().to_owned());
    }
    found.client()
}

/// The server is on this machine.
fn is_local(server: &str) -> bool {
    let host = reqwest::Url::parse(server)
        .ok()
        .and_then(|url| url.host_str().map(str::to_owned));
    host.is_some_and(|host| {
        let address = host.trim_matches(['[', ']']).parse::<IpAddr>();
        host == "localhost" || address.is_ok_and(|address| address.is_loopback())
    })
}

/// Reads the host's token from the file that the server has created.
fn read_host_token(data_dir: Option<&Path>) -> anyhow::Result<String> {
    let data_dir = match data_dir {
        Some(data_dir) => data_dir.to_owned(),
        None => Config::load(None)?.server.data_dir,
    };
    let file = data_dir.join(ADMIN_TOKEN_FILE);
    std::fs::read_to_string(&file).with_context(|| {
        NotSignedIn(format!(
            "reading the organiser's token from {}; name the server's folder with --data-dir, sign in with faceoff login, or \
             give the token with --token or FACEOFF_ADMIN_TOKEN",
            file.display()
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_loopback_addresses_are_local() {
        for local in [
            "http://127.0.0.1:8080",
            "http://localhost/",
            "http://[::1]:80",
        ] {
            assert!(is_local(local), "{local}");
        }
        for remote in [
            "https://faceoff.example.org",
            "http://192.0.2.1",
            "localhost",
            "",
        ] {
            assert!(!is_local(remote), "{remote}");
        }
    }
}
