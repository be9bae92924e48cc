use faceoff_types::{EvaluationId, SubmissionId};
use tokio::sync::{broadcast, watch};

/// Something that a page or a waiting client may want to look at again. Events are hints: they are
/// sent after the commit, within this process only, and a slow receiver misses some.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Event {
    /// A submission was made or changed its state.
    Submission(SubmissionId),
    /// An evaluation was made, advanced or changed its state.
    Evaluation(EvaluationId),
}

/// How many events a receiver may be behind before it misses the oldest.
const BACKLOG: usize = 256;

/// Sends hints to this process's listeners.
#[derive(Debug)]
pub(crate) struct Signals {
    events: broadcast::Sender<Event>,
    work: watch::Sender<u64>,
}

impl Signals {
    pub(crate) fn new() -> Self {
        Self {
            events: broadcast::Sender::new(BACKLOG),
            work: watch::Sender::new(0),
        }
    }

    /// Tells that something changed.
    pub(crate) fn changed(&self, event: Event) {
        // no listener is no fault
        let _ = self.events.send(event);
    }

    /// Tells idle workers that a unit may be claimed.
    pub(crate) fn work_added(&self) {
        self.work
            .send_modify(|count| *count = count.wrapping_add(1));
    }

    pub(crate) fn events(&self) -> broadcast::Receiver<Event> {
        self.events.subscribe()
    }

    pub(crate) fn work(&self) -> watch::Receiver<u64> {
        self.work.subscribe()
    }
}
