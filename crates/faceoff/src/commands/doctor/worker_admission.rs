//! Checks whether a worker on this host would get jobs from the server, to which it connects through a NATS message server.

use super::check::Check;
use crate::{
    commands::{reported_capabilities::own_capabilities, worker::host_name},
    config::Config,
};
use anyhow::Context as _;
use faceoff_worker::check_connection;

/// The oldest recommended version of nats-server, as major and minor number. Debian's older version works, too.
const RECOMMENDED_NATS: (u32, u32) = (2, 12);

/// Connects to NATS and asks the server whether a worker of this name on this host would get jobs. Empty if no NATS server is configured.
pub(super) fn check(config: &Config, name: Option<String>) -> anyhow::Result<Vec<Check>> {
    let Some(nats) = config.nats.connection() else {
        return Ok(Vec::new());
    };
    let name = name.map_or_else(host_name, Ok)?;
    let capabilities = own_capabilities(&config.agent_environment(), config.slots())?;
    let connection = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .context("starting the async runtime")?
        .block_on(check_connection(&nats, &name, &capabilities));
    let mut found = vec![match connection.nats {
        Ok(version) => Check {
            name: "NATS",
            fix: is_old(&version).then(|| {
                "it works, but 2.12 or later is recommended: see docs/workers.md, Versions of NATS".to_owned()
            }),
            found: format!("nats-server {version} at {}", nats.url),
        },
        Err(error) => Check {
            name: "NATS",
            found: format!("cannot be reached at {}: {error}", nats.url),
            fix: Some("start nats-server -js, or correct nats.url, nats.nkey_file and nats.ca_file".to_owned()),
        },
    }];
    if let Some(server) = connection.server {
        found.push(match server {
            Ok(()) => Check {
                name: "server",
                found: format!("would give jobs to a worker {name:?} on this host"),
                fix: None,
            },
            Err(error) => Check {
                name: "server",
                found: "would give no jobs".to_owned(),
                fix: Some(error),
            },
        });
    }
    Ok(found)
}

fn is_old(version: &str) -> bool {
    let mut parts = version.split('.').map(str::parse::<u32>);
    match (parts.next(), parts.next()) {
        (Some(Ok(major)), Some(Ok(minor))) => (major, minor) < RECOMMENDED_NATS,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_compared_as_numbers() {
        for (version, old) in [
            ("2.9.10", true),
            ("2.11.3", true),
            ("2.12.0", false),
            ("2.14.1-beta", false),
            ("3.0", false),
            ("unknown", false),
        ] {
            assert_eq!(is_old(version), old, "{version}");
        }
    }
}
