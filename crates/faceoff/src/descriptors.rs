//! File descriptors: how many this process may have, and how many of them are for whom.

use faceoff_http::ConnectionLimits;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use serde::Serialize;

/// No more than this are asked for: enough for all connections that a server could want, while a table of
/// millions, as some hosts allow, costs whoever walks it.
const MOST: u64 = 1 << 16;
/// What the service itself holds open: database, log, runtime, listener.
const SERVICE: u64 = 64;
/// What a slot holds open at most: of each of two agents the sockets, the kernel's counters (two files for each of
/// its first 16 threads) and what ends it; a bundle that is unpacked, recordings and datasets that are written.
const PER_SLOT: u64 = 160;
/// A connection, and the file that is sent over it, or received by one handle and stored by another.
const PER_CONNECTION: u64 = 3;
/// Fewer connections than this are no service.
const FEWEST: usize = 8;
/// One address gets no more than this part of the connections, so that it cannot take all.
const SHARE: usize = 4;

/// How the descriptors are divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Descriptors {
    /// Open at the same time, at most.
    pub limit: u64,
    /// Kept for evaluations and the service itself.
    pub reserved: u64,
    /// Connections at the same time.
    pub connections: usize,
    pub per_address: usize,
}

impl Descriptors {
    /// How many this process may have once it has raised its soft limit.
    #[must_use]
    pub fn available() -> u64 {
        let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
        let soft = current.unwrap_or(MOST);
        soft.max(maximum.unwrap_or(MOST).min(MOST))
    }

    /// Raises the soft limit to the hard one; agents have a limit of their own. Returns what there is.
    #[must_use]
    pub fn raise() -> u64 {
        let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
        let wanted = Self::available();
        let raised = Rlimit {
            current: Some(wanted),
            maximum,
        };
        match setrlimit(Resource::Nofile, raised) {
            Ok(()) => wanted,
            Err(error) => {
                tracing::warn!(%error, "the soft limit of file descriptors stays as it is");
                current.unwrap_or(MOST)
            }
        }
    }

    /// Divides `limit` among `slots` worker slots and connections.
    ///
    /// # Errors
    /// If too few are left for connections.
    pub fn divide(limit: u64, slots: usize, wanted: &ConnectionLimits) -> anyhow::Result<Self> {
        let reserved = SERVICE + PER_SLOT * slots as u64;
        let left = limit.saturating_sub(reserved) / PER_CONNECTION;
        let connections = usize::try_from(left).unwrap_or(usize::MAX).min(wanted.open);
        anyhow::ensure!(
            connections >= FEWEST,
            "{limit} file descriptors are too few: evaluations in {slots} slot(s) and the service keep \
             {reserved}, and {FEWEST} connections need {} more; raise the limit (ulimit -n, LimitNOFILE= of \
             systemd) or set fewer workers.slots",
            FEWEST as u64 * PER_CONNECTION
        );
        Ok(Self {
            limit,
            reserved,
            connections,
            per_address: wanted.per_address.min((connections / SHARE).max(1)),
        })
    }

    /// The limits with which connections are accepted.
    #[must_use]
    pub fn limits(self, wanted: ConnectionLimits) -> ConnectionLimits {
        ConnectionLimits {
            open: self.connections,
            per_address: self.per_address,
            ..wanted
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn evaluations_come_first_and_nobody_gets_all_of_the_rest() {
        let wanted = ConnectionLimits::default();
        let divide = |limit, slots| Descriptors::divide(limit, slots, &wanted);
        let plenty = divide(65_536, 4).unwrap();
        assert_eq!((plenty.connections, plenty.per_address), (1024, 64));
        let few = divide(300, 1).unwrap();
        assert_eq!(
            (few.reserved, few.connections, few.per_address),
            (224, 25, 6)
        );
        let error = divide(240, 1).unwrap_err().to_string();
        assert!(error.contains("ulimit -n"), "{error}");
        assert!(divide(300, 2).is_err());
    }
}
