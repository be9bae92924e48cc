//! Would a worker of this host get work of a server elsewhere?

use super::checked::Checked;
use crate::{
    commands::{introduction::introduction, worker::host_name},
    config::Config,
};
use anyhow::Context as _;
use faceoff_worker::examine;

/// The first version of nats-server that is recommended; Debian has an older one, with which everything works.
const MAINTAINED: (u32, u32) = (2, 12);

/// Nothing where no NATS is named.
pub(super) fn ask(config: &Config, name: Option<String>) -> anyhow::Result<Vec<Checked>> {
    let Some(nats) = config.nats.connection() else {
        return Ok(Vec::new());
    };
    let name = name.map_or_else(host_name, Ok)?;
    let own = introduction(&config.agent_environment(), config.slots())?;
    let examined = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .context("starting the async runtime")?
        .block_on(examine(&nats, &name, &own));
    let mut found = vec![match examined.nats {
        Ok(version) => Checked {
            name: "NATS",
            cure: is_old(&version).then(|| {
                "it works; for operation 2.12 or later is recommended: see docs/operating.md, Work on other machines".to_owned()
            }),
            found: format!("nats-server {version} at {}", nats.url),
        },
        Err(why) => Checked {
            name: "NATS",
            found: format!("not reached at {}: {why}", nats.url),
            cure: Some("start nats-server -js, or correct nats.url, nats.nkey_file and nats.ca_file".to_owned()),
        },
    }];
    if let Some(server) = examined.server {
        found.push(match server {
            Ok(()) => Checked {
                name: "server",
                found: format!("would give work to a worker {name:?} of this host"),
                cure: None,
            },
            Err(why) => Checked {
                name: "server",
                found: "would give no work".to_owned(),
                cure: Some(why),
            },
        });
    }
    Ok(found)
}

fn is_old(version: &str) -> bool {
    let mut parts = version.split('.').map(str::parse::<u32>);
    match (parts.next(), parts.next()) {
        (Some(Ok(major)), Some(Ok(minor))) => (major, minor) < MAINTAINED,
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
