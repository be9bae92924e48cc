//! Starts the threads of slots.
//!
//! A thread inherits the CPUs and the priority of the thread that starts it, and may not raise its priority. A server
//! answers requests on threads of low priority, so it starts its slots from a separate thread.

use std::{
    io,
    sync::mpsc::{self, Receiver, Sender},
    thread,
};

type Body = Box<dyn FnOnce() + Send>;

#[derive(Debug)]
struct Request {
    name: String,
    body: BodyOf,
    started: Sender<io::Result<()>>,
}

/// A thread's closure, with a `Debug` implementation.
struct BodyOf(Body);

impl std::fmt::Debug for BodyOf {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("…")
    }
}

/// Starts threads; may be used from any thread.
#[derive(Debug, Clone)]
pub struct SlotThreads(Starter);

#[derive(Debug, Clone)]
enum Starter {
    Caller,
    Other(Sender<Request>),
}

/// [Runs](Self::run) on the thread whose CPUs and priority the slots inherit.
#[derive(Debug)]
pub struct SlotStarter(Receiver<Request>);

impl SlotThreads {
    /// Threads are started by the calling thread.
    #[must_use]
    pub const fn from_caller() -> Self {
        Self(Starter::Caller)
    }

    /// Threads are started by the thread that runs the returned [`SlotStarter`].
    #[must_use]
    pub fn from_starter() -> (Self, SlotStarter) {
        let (requests, starter) = mpsc::channel();
        (Self(Starter::Other(requests)), SlotStarter(starter))
    }

    /// Starts a named thread.
    pub(crate) fn start(
        &self,
        name: String,
        body: impl FnOnce() + Send + 'static,
    ) -> io::Result<()> {
        match &self.0 {
            Starter::Caller => spawn(name, body),
            Starter::Other(requests) => {
                let gone = || io::Error::other("the thread that starts slots has ended");
                let (started, answer) = mpsc::channel();
                let body = BodyOf(Box::new(body));
                let request = Request {
                    name,
                    body,
                    started,
                };
                requests.send(request).map_err(|_| gone())?;
                answer.recv().map_err(|_| gone())?
            }
        }
    }
}

impl SlotStarter {
    /// Starts the requested threads until all [`SlotThreads`] are dropped.
    pub fn run(self) {
        for Request {
            name,
            body,
            started,
        } in self.0
        {
            // The requester may be gone.
            let _ = started.send(spawn(name, body.0));
        }
    }
}

fn spawn(name: String, body: impl FnOnce() + Send + 'static) -> io::Result<()> {
    thread::Builder::new().name(name).spawn(body).map(drop)
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_sandbox::affinity;

    #[test]
    fn slot_threads_inherit_from_the_starter() {
        let (threads, starter) = SlotThreads::from_starter();
        let all = affinity::allowed_cpus().unwrap();
        let requester = thread::spawn(move || {
            affinity::lower_priority(&all[..1]).unwrap();
            let (sender, receiver) = mpsc::channel();
            threads
                .start("requested".into(), move || {
                    let seen = (
                        affinity::allowed_cpus().unwrap(),
                        affinity::niceness().unwrap(),
                    );
                    sender.send(seen).unwrap();
                })
                .unwrap();
            (receiver.recv().unwrap(), affinity::niceness().unwrap())
        });
        starter.run();
        let ((cpus, nice), requester_nice) = requester.join().unwrap();
        assert_eq!(cpus, affinity::allowed_cpus().unwrap());
        assert_eq!(nice, affinity::niceness().unwrap());
        assert!(requester_nice > nice, "{requester_nice} > {nice}");
    }
}
