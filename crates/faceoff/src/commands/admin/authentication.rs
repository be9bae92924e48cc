//! The token that the organisers' commands use. The *operator's token* has all rights of an organiser; the server writes it to its
//! data folder when it first starts.

use crate::{
    client::{Client, is_this_machine, server_address},
    commands::{
        serve::ADMIN_TOKEN_FILE,
        server::{Connection, Source},
    },
    config::Config,
    exit::NotSignedIn,
};
use anyhow::Context;
use std::{
    net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr},
    path::Path,
};

/// A client with the first token that exists of:
///
/// 1. `token`: that of `--token` or `FACEOFF_ADMIN_TOKEN`,
/// 2. the operator's token in the folder of `--data-dir`,
/// 3. the token of `faceoff login` to this server,
/// 4. the operator's token in the configured data folder, if the server runs on this machine.
///
/// Without an option, a variable and a login, the server is the one of this machine that `faceoff.toml` in the working folder configures.
///
/// The operator's token is sent to another machine only if `--data-dir` names its folder.
pub(super) fn admin_client(
    server: Option<&str>,
    token: Option<&str>,
    data_dir: Option<&Path>,
    ca_file: Option<&Path>,
) -> anyhow::Result<Client> {
    let explicit_token = token.map(|token| (token, "FACEOFF_ADMIN_TOKEN"));
    let mut connection = Connection::resolve(server, explicit_token, ca_file)?;
    if connection.server_source == Source::Default && token.is_none() {
        let configured = configured_server(Config::load(None)?.server.listen);
        // A token must not go to another machine because of a file in the working folder.
        if is_local(&configured) {
            connection = Connection::resolve(Some(&configured), None, ca_file)?;
        }
    }
    let has_token = token.is_some() || (data_dir.is_none() && connection.token.is_some());
    if !has_token {
        if data_dir.is_none() && !is_local(&connection.server) {
            return Err(NotSignedIn(format!(
                "not signed in to {}: sign in with faceoff login, or give the token with --token or \
                FACEOFF_ADMIN_TOKEN, or name the server's data folder with --data-dir",
                connection.server
            ))
            .into());
        }
        connection.token = Some(read_operator_token(data_dir)?.trim().to_owned());
    }
    connection.client()
}

/// The address of a server on this machine that listens there. One that listens on all addresses also listens on the loopback's.
fn configured_server(mut listen: SocketAddr) -> String {
    if listen.ip().is_unspecified() {
        listen.set_ip(match listen.ip() {
            IpAddr::V4(_) => Ipv4Addr::LOCALHOST.into(),
            IpAddr::V6(_) => Ipv6Addr::LOCALHOST.into(),
        });
    }
    format!("http://{listen}")
}

/// Is the server on this machine?
fn is_local(server: &str) -> bool {
    let host = reqwest::Url::parse(&server_address(server))
        .ok()
        .and_then(|url| url.host_str().map(str::to_owned));
    host.is_some_and(|host| is_this_machine(&host))
}

/// Reads the operator's token from the file that the server has created.
fn read_operator_token(data_dir: Option<&Path>) -> anyhow::Result<String> {
    let data_dir = match data_dir {
        Some(data_dir) => data_dir.to_owned(),
        None => Config::load(None)?.server.data_dir,
    };
    let file = data_dir.join(ADMIN_TOKEN_FILE);
    std::fs::read_to_string(&file).with_context(|| {
        NotSignedIn(format!(
            "reading the operator's token from {}; name the server's folder with --data-dir, sign in with faceoff login, or \
             give the token with --token or FACEOFF_ADMIN_TOKEN",
            file.display()
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn configured_server_is_reached_on_this_machine() {
        for (listen, address) in [
            ("127.0.0.1:8080", "http://127.0.0.1:8080"),
            ("0.0.0.0:9000", "http://127.0.0.1:9000"),
            ("[::]:9000", "http://[::1]:9000"),
            ("192.0.2.7:80", "http://192.0.2.7:80"),
        ] {
            assert_eq!(configured_server(listen.parse().unwrap()), address);
        }
    }

    #[test]
    fn only_loopback_addresses_are_local() {
        for local in [
            "http://127.0.0.1:8080",
            "http://localhost/",
            "http://[::1]:80",
            "localhost",
        ] {
            assert!(is_local(local), "{local}");
        }
        for remote in [
            "https://faceoff.example.org",
            "http://192.0.2.1",
            "localhost:8080@192.0.2.1",
            "",
        ] {
            assert!(!is_local(remote), "{remote}");
        }
    }
}
