//! File descriptors: the limit of this process, and its division between connections and worker slots, each of which runs one
//! evaluation or game at a time.

use faceoff_http::ConnectionLimits;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use serde::Serialize;

/// Largest limit to request: enough for all connections of a server. Some hosts allow millions, and programs that
/// iterate over all descriptors would become slow.
const MAX_LIMIT: u64 = 1 << 16;
/// Descriptors of the server itself: database, log, async runtime, listener.
const SERVER_DESCRIPTORS: u64 = 64;
/// Most descriptors of a slot. Each of its two agents has sockets, kernel counters (two files for each of its first 16
/// threads), files for its termination and up to 32 files for whose locks it waits. The slot has an unpacked bundle, recordings
/// and datasets.
const DESCRIPTORS_PER_SLOT: u64 = 230;
/// Descriptors per connection: the socket, and a file that is sent, or two handles of a file that is received.
const DESCRIPTORS_PER_CONNECTION: u64 = 3;
/// With fewer connections, the server is not usable.
const MIN_CONNECTIONS: usize = 8;
/// One address gets at most the connections divided by this number, so that it cannot occupy all of them.
const ADDRESS_DIVISOR: usize = 4;

/// Division of the descriptors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Descriptors {
    /// Limit of open descriptors.
    pub limit: u64,
    /// Reserved for slots and the server itself.
    pub reserved: u64,
    /// Most open connections.
    pub connections: usize,
    /// Most open connections of one address.
    pub per_address: usize,
}

impl Descriptors {
    /// The limit of this process after its soft limit is raised.
    #[must_use]
    pub fn available() -> u64 {
        let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
        let soft = current.unwrap_or(MAX_LIMIT);
        soft.max(maximum.unwrap_or(MAX_LIMIT).min(MAX_LIMIT))
    }

    /// Raises the soft limit to the hard one and returns the new limit. Agents have a separate limit.
    #[must_use]
    pub fn raise() -> u64 {
        let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
        let limit = Self::available();
        let raised = Rlimit {
            current: Some(limit),
            maximum,
        };
        match setrlimit(Resource::Nofile, raised) {
            Ok(()) => limit,
            Err(error) => {
                tracing::warn!(%error, "cannot raise the soft limit of file descriptors");
                current.unwrap_or(MAX_LIMIT)
            }
        }
    }

    /// Divides `limit` among `slots` worker slots and connections.
    ///
    /// # Errors
    /// If too few are left for connections.
    pub fn divide(limit: u64, slots: usize, requested: &ConnectionLimits) -> anyhow::Result<Self> {
        let reserved = SERVER_DESCRIPTORS + DESCRIPTORS_PER_SLOT * slots as u64;
        let possible = limit.saturating_sub(reserved) / DESCRIPTORS_PER_CONNECTION;
        let connections = usize::try_from(possible)
            .unwrap_or(usize::MAX)
            .min(requested.open);
        anyhow::ensure!(
            connections >= MIN_CONNECTIONS,
            "{limit} file descriptors are too few: evaluations in {slots} slot(s) and the service need \
             {reserved}, and {MIN_CONNECTIONS} connections need {} more; raise the limit (ulimit -n, LimitNOFILE= of \
             systemd) or set fewer workers.slots",
            MIN_CONNECTIONS as u64 * DESCRIPTORS_PER_CONNECTION
        );
        Ok(Self {
            limit,
            reserved,
            connections,
            per_address: requested
                .per_address
                .min((connections / ADDRESS_DIVISOR).max(1)),
        })
    }

    /// The requested limits, reduced to the available descriptors.
    #[must_use]
    pub fn limits(self, requested: ConnectionLimits) -> ConnectionLimits {
        ConnectionLimits {
            open: self.connections,
            per_address: self.per_address,
            ..requested
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slots_are_reserved_first_and_addresses_are_limited() {
        let requested = ConnectionLimits::default();
        let divide = |limit, slots| Descriptors::divide(limit, slots, &requested);
        let large = divide(65_536, 4).unwrap();
        assert_eq!((large.connections, large.per_address), (1024, 64));
        // 370 - 64 - 230 descriptors remain for 25 connections, of which an address gets a quarter.
        let small = divide(370, 1).unwrap();
        assert_eq!(
            (small.reserved, small.connections, small.per_address),
            (294, 25, 6)
        );
        let error = divide(310, 1).unwrap_err().to_string();
        assert!(error.contains("ulimit -n"), "{error}");
        assert!(divide(370, 2).is_err());
    }
}
