//! Starts the threads of slots. A slot is the place in a worker that runs one job at a time.
//!
//! A thread inherits the CPUs and the priority of the thread that starts it, and may not raise its priority. A server
//! answers requests on threads of low priority, so it starts its slots from a separate thread.

use std::{
    io,
    sync::mpsc::{self, Receiver, Sender},
    thread,
};

/// A request to start a thread.
#[derive(Debug)]
struct StartRequest {
    name: String,
    body: ThreadBody,
    /// Where the result is sent.
    reply: Sender<io::Result<()>>,
}

/// A thread's closure, with a `Debug` implementation.
struct ThreadBody(Box<dyn FnOnce() + Send>);

impl std::fmt::Debug for ThreadBody {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("…")
    }
}

/// Starts threads; may be used from any thread.
#[derive(Debug, Clone)]
pub struct SlotThreads(Starter);

#[derive(Debug, Clone)]
enum Starter {
    CallingThread,
    StarterThread(Sender<StartRequest>),
}

/// Receives the requests to start threads. It [runs](Self::run) on the thread whose CPUs and priority the slots inherit.
#[derive(Debug)]
pub struct SlotStarter(Receiver<StartRequest>);

impl SlotThreads {
    /// Threads are started by the thread that calls [`Self::start`].
    #[must_use]
    pub const fn from_caller() -> Self {
        Self(Starter::CallingThread)
    }

    /// Threads are started by the thread that runs the returned [`SlotStarter`].
    #[must_use]
    pub fn from_starter() -> (Self, SlotStarter) {
        let (requests, receiver) = mpsc::channel();
        (
            Self(Starter::StarterThread(requests)),
            SlotStarter(receiver),
        )
    }

    /// Starts a named thread.
    pub(crate) fn start(
        &self,
        name: String,
        body: impl FnOnce() + Send + 'static,
    ) -> io::Result<()> {
        match &self.0 {
            Starter::CallingThread => spawn(name, body),
            Starter::StarterThread(requests) => {
                let starter_ended = || io::Error::other("the thread that starts slots has ended");
                let (reply, started) = mpsc::channel();
                let body = ThreadBody(Box::new(body));
                let request = StartRequest { name, body, reply };
                requests.send(request).map_err(|_| starter_ended())?;
                started.recv().map_err(|_| starter_ended())?
            }
        }
    }
}

impl SlotStarter {
    /// Starts the requested threads until all [`SlotThreads`] are dropped.
    pub fn run(self) {
        for StartRequest { name, body, reply } in self.0 {
            // The requester may have ended.
            let _ = reply.send(spawn(name, body.0));
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
        let cpus = affinity::allowed_cpus().unwrap();
        let requester = thread::spawn(move || {
            affinity::lower_priority(&cpus[..1]).unwrap();
            let (sender, receiver) = mpsc::channel();
            threads
                .start("requested".into(), move || {
                    let inherited = (
                        affinity::allowed_cpus().unwrap(),
                        affinity::niceness().unwrap(),
                    );
                    sender.send(inherited).unwrap();
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
