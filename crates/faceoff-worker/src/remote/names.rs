//! Names of NATS streams (stored messages) and subjects (addresses of messages). Each begins with the server's name, so that
//! several servers can share one NATS. The words in them (`orders`, `asks` …) are fixed: workers, NATS permissions and stored
//! streams use them.

use faceoff_types::WorkerName;

/// The names of one server's streams and subjects.
#[derive(Debug, Clone)]
pub(super) struct Names {
    server: String,
}

impl Names {
    /// Fails unless the server's name is valid in subjects and stream names.
    pub(super) fn new(server: &str) -> anyhow::Result<Self> {
        anyhow::ensure!(
            is_subject_token(server),
            "nats.name: expected 1 to 64 of a-z, A-Z, 0-9, - and _, got {server:?}"
        );
        Ok(Self {
            server: server.to_owned(),
        })
    }

    /// The stream of jobs.
    pub(super) fn jobs_stream(&self) -> String {
        format!("{}-orders", self.server)
    }

    /// The subject of jobs.
    pub(super) fn jobs(&self) -> String {
        format!("{}.orders", self.server)
    }

    /// The stream of results.
    pub(super) fn results_stream(&self) -> String {
        format!("{}-outcomes", self.server)
    }

    /// The subject of a worker's results; `*`: of all workers.
    pub(super) fn results(&self, worker: &str) -> String {
        format!("{}.outcomes.{worker}", self.server)
    }

    /// The subject of a worker's requests; `*`: of all workers.
    pub(super) fn requests(&self, worker: &str) -> String {
        format!("{}.asks.{worker}", self.server)
    }

    /// The prefix of subjects on which a client gets responses, without a trailing dot.
    pub(super) fn inbox(&self, client: &str) -> String {
        format!("_INBOX.{}.{client}", self.server)
    }

    /// Is `subject` one on which only this worker gets responses? If workers have their own NATS account, NATS replaces the
    /// subject by one that no client may name.
    pub(super) fn is_inbox_of(&self, worker: &WorkerName, subject: &str) -> bool {
        if subject.starts_with(BETWEEN_ACCOUNTS) {
            return true;
        }
        let rest = subject.strip_prefix(&self.inbox(worker.as_str()));
        rest.is_some_and(|rest| rest.starts_with('.') && !rest.contains(['*', '>']))
    }

    /// The subject of a worker's live updates of games; `*`: of all workers.
    pub(super) fn live_games(&self, worker: &str) -> String {
        format!("{}.shows.{worker}", self.server)
    }

    /// The subject on which a worker reports a free slot; `*`: of all workers.
    pub(super) fn free_slots(&self, worker: &str) -> String {
        format!("{}.free.{worker}", self.server)
    }
}

/// Prefix of the subjects by which NATS forwards responses between accounts. It refuses clients that name one.
const BETWEEN_ACCOUNTS: &str = "_R_.";
/// Client name of the server.
pub(super) const SERVER: &str = "server";
/// The consumer of jobs, shared by all workers.
pub(super) const JOBS_CONSUMER: &str = "workers";
/// The consumer of results, used by the server.
pub(super) const RESULTS_CONSUMER: &str = "server";
/// All workers, in subjects.
pub(super) const ALL: &str = "*";
/// Lease holder of a published job that no worker has started. Jobs in the database have this text, and no slot can have this name.
pub(super) const NOT_STARTED: &str = "given out";

/// Is the text valid as a token of a subject and as a part of a stream's name?
pub(super) fn is_subject_token(text: &str) -> bool {
    text.parse::<WorkerName>().is_ok()
}

/// The worker whose subject this is.
pub(super) fn worker_of(subject: &str) -> Option<WorkerName> {
    let (_, worker) = subject.rsplit_once('.')?;
    worker.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subjects_name_server_and_worker() {
        let names = Names::new("faceoff").unwrap();
        assert_eq!(names.requests("gpu-1"), "faceoff.asks.gpu-1");
        assert_eq!(worker_of(&names.requests("gpu-1")), "gpu-1".parse().ok());
        assert_eq!(worker_of(&names.requests(ALL)), None);
        let rack: WorkerName = "rack-1".parse().unwrap();
        assert!(names.is_inbox_of(&rack, "_INBOX.faceoff.rack-1.abc.1"));
        assert!(names.is_inbox_of(&rack, "_R_.abc.xyz"));
        for foreign in [
            "_INBOX.faceoff.rack-10.abc",
            "_INBOX.faceoff.rack-1",
            "_INBOX.faceoff.server.abc",
            "$JS.API.STREAM.PURGE.faceoff-outcomes",
            "faceoff.orders",
            "",
        ] {
            assert!(!names.is_inbox_of(&rack, foreign), "{foreign}");
        }
        for invalid in ["", "a.b", "a b", "*", ">", &"x".repeat(65)] {
            assert!(Names::new(invalid).is_err(), "{invalid:?}");
        }
    }
}
