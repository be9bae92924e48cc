//! What streams and subjects are called. Each begins with the server's own name, so that several share one NATS.

use faceoff_store::WorkerName;

/// The names of one server's streams and subjects.
#[derive(Debug, Clone)]
pub(super) struct Names {
    server: String,
}

impl Names {
    /// Fails unless the name can be a part of all of them.
    pub(super) fn of(server: &str) -> anyhow::Result<Self> {
        anyhow::ensure!(
            is_word(server),
            "nats.name: expected 1 to 64 of a-z, A-Z, 0-9, - and _, got {server:?}"
        );
        Ok(Self {
            server: server.to_owned(),
        })
    }

    /// The stream of orders.
    pub(super) fn orders_stream(&self) -> String {
        format!("{}-orders", self.server)
    }

    /// Where orders are published.
    pub(super) fn orders(&self) -> String {
        format!("{}.orders", self.server)
    }

    /// The stream of what came of them.
    pub(super) fn outcomes_stream(&self) -> String {
        format!("{}-outcomes", self.server)
    }

    /// Where a worker publishes what came of an order; `*`: all of them.
    pub(super) fn outcomes(&self, worker: &str) -> String {
        format!("{}.outcomes.{worker}", self.server)
    }

    /// Where a worker asks; `*`: all of them.
    pub(super) fn asks(&self, worker: &str) -> String {
        format!("{}.asks.{worker}", self.server)
    }

    /// Where answers to who are sent: a prefix of subjects, without a dot at its end.
    pub(super) fn inbox(&self, who: &str) -> String {
        format!("_INBOX.{}.{who}", self.server)
    }

    /// Is it a subject on which this worker gets answers, and nobody else? Where workers have an account of their own, NATS has replaced it by one
    /// that it alone may name.
    pub(super) fn is_inbox_of(&self, worker: &WorkerName, subject: &str) -> bool {
        if subject.starts_with(BETWEEN_ACCOUNTS) {
            return true;
        }
        let rest = subject.strip_prefix(&self.inbox(worker.as_str()));
        rest.is_some_and(|rest| rest.starts_with('.') && !rest.contains(['*', '>']))
    }

    /// Where a worker tells of games under way; `*`: all of them.
    pub(super) fn shows(&self, worker: &str) -> String {
        format!("{}.shows.{worker}", self.server)
    }

    /// Where a worker tells that a slot has become free; `*`: all of them.
    pub(super) fn free(&self, worker: &str) -> String {
        format!("{}.free.{worker}", self.server)
    }
}

/// How subjects begin on which NATS passes answers on from one account to another; it refuses whoever says that they are to be answered there.
const BETWEEN_ACCOUNTS: &str = "_R_.";
/// What the server is called where workers have names.
pub(super) const SERVER: &str = "server";
/// What workers have in common when they take orders.
pub(super) const ORDERS_CONSUMER: &str = "workers";
/// The server, when it takes what came of them.
pub(super) const OUTCOMES_CONSUMER: &str = "server";
/// Every worker, where subjects name one.
pub(super) const ALL: &str = "*";
/// The holder of leases of orders that nobody has begun. No slot is called this.
pub(super) const WAITING: &str = "given out";

/// What the holders of leases of all slots elsewhere are below.
pub(super) const ELSEWHERE: &str = "remote";

/// What the queue calls a slot of a worker elsewhere.
pub(super) fn slot(worker: &WorkerName, slot: &str) -> String {
    format!("{}/{slot}", worker.holder())
}

/// Can it be a token of a subject, and a part of a stream's name?
pub(super) fn is_word(text: &str) -> bool {
    text.parse::<WorkerName>().is_ok()
}

/// The worker that a subject of its own names.
pub(super) fn worker_of(subject: &str) -> Option<WorkerName> {
    let (_, worker) = subject.rsplit_once('.')?;
    worker.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subjects_name_server_and_worker() {
        let names = Names::of("faceoff").unwrap();
        assert_eq!(names.asks("gpu-1"), "faceoff.asks.gpu-1");
        assert_eq!(worker_of(&names.asks("gpu-1")), "gpu-1".parse().ok());
        assert_eq!(worker_of(&names.asks(ALL)), None);
        let rack: WorkerName = "rack-1".parse().unwrap();
        assert!(names.is_inbox_of(&rack, "_INBOX.faceoff.rack-1.abc.1"));
        assert!(names.is_inbox_of(&rack, "_R_.abc.xyz"));
        for other in [
            "_INBOX.faceoff.rack-10.abc",
            "_INBOX.faceoff.rack-1",
            "_INBOX.faceoff.server.abc",
            "$JS.API.STREAM.PURGE.faceoff-outcomes",
            "faceoff.orders",
            "",
        ] {
            assert!(!names.is_inbox_of(&rack, other), "{other}");
        }
        for bad in ["", "a.b", "a b", "*", ">", &"x".repeat(65)] {
            assert!(Names::of(bad).is_err(), "{bad:?}");
        }
    }
}
