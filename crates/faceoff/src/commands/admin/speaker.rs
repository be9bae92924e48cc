//! As whom an organiser's commands speak.

use crate::{
    client::Client,
    commands::{serve::ADMIN_TOKEN_FILE, server::Found},
    config::Config,
    exit::NotSignedIn,
};
use anyhow::Context;
use std::{net::IpAddr, path::Path};

/// Whom the token of --token or FACEOFF_ADMIN_TOKEN speaks for; without one the host, if its data folder is named; who has
/// signed in to the server; and otherwise the host of a server on this machine, whose data folder is here. The token of
/// a folder that happens to be here goes to no other machine.
pub(super) fn client(
    server: Option<&str>,
    token: Option<&str>,
    data_dir: Option<&Path>,
    ca_file: Option<&Path>,
) -> anyhow::Result<Client> {
    let named = token.map(|token| (token, "FACEOFF_ADMIN_TOKEN"));
    let mut found = Found::of(server, named, ca_file)?;
    let is_given = token.is_some() || (data_dir.is_none() && found.token.is_some());
    if !is_given {
        if data_dir.is_none() && !is_here(&found.server) {
            return Err(NotSignedIn(format!(
                "nobody is signed in to {}: sign in with faceoff login, or give the token with --token or \
                 FACEOFF_ADMIN_TOKEN, or name the folder that has it with --data-dir",
                found.server
            ))
            .into());
        }
        found.token = Some(of_host(data_dir)?.trim().to_owned());
    }
    found.client()
}

/// Is it a server on this machine?
fn is_here(server: &str) -> bool {
    let host = reqwest::Url::parse(server)
        .ok()
        .and_then(|url| url.host_str().map(str::to_owned));
    host.is_some_and(|host| {
        let address = host.trim_matches(['[', ']']).parse::<IpAddr>();
        host == "localhost" || address.is_ok_and(|address| address.is_loopback())
    })
}

/// The token from the file that the server made.
fn of_host(data_dir: Option<&Path>) -> anyhow::Result<String> {
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
    fn a_server_elsewhere_is_not_here() {
        for here in [
            "http://127.0.0.1:8080",
            "http://localhost/",
            "http://[::1]:80",
        ] {
            assert!(is_here(here), "{here}");
        }
        for elsewhere in [
            "https://faceoff.example.org",
            "http://192.0.2.1",
            "localhost",
            "",
        ] {
            assert!(!is_here(elsewhere), "{elsewhere}");
        }
    }
}
