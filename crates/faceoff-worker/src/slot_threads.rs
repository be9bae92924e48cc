//! Who starts the slots' threads. A thread inherits the CPUs and the priority of the one that starts it, and
//! may not raise its priority again: so a server that answers requests on threads of low priority starts
//! its slots from another one.

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

/// A thread's work, which says nothing of itself.
struct BodyOf(Body);

impl std::fmt::Debug for BodyOf {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("…")
    }
}

/// Starts threads, wherever it is called from.
#[derive(Debug, Clone)]
pub struct SlotThreads(Starter);

#[derive(Debug, Clone)]
enum Starter {
    Caller,
    Other(Sender<Request>),
}

/// To be [tended](Self::tend) by the thread whose CPUs and priority the slots inherit.
#[derive(Debug)]
pub struct SlotStarter(Receiver<Request>);

impl SlotThreads {
    /// Each thread is started by the one that asks for it.
    #[must_use]
    pub const fn of_the_caller() -> Self {
        Self(Starter::Caller)
    }

    /// Each thread is started by the one that tends the other half.
    #[must_use]
    pub fn of_another() -> (Self, SlotStarter) {
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
    /// Starts what is asked for until nobody is left who could ask.
    pub fn tend(self) {
        for Request {
            name,
            body,
            started,
        } in self.0
        {
            // Who has asked and is gone is told nothing.
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
    fn a_thread_inherits_from_the_one_that_starts_it_and_not_from_the_one_that_asks() {
        let (threads, starter) = SlotThreads::of_another();
        let all = affinity::allowed().unwrap();
        let asking = thread::spawn(move || {
            affinity::give_way(&all[..1]).unwrap();
            let (tell, told) = mpsc::channel();
            threads
                .start("asked for".into(), move || {
                    let seen = (affinity::allowed().unwrap(), affinity::niceness().unwrap());
                    tell.send(seen).unwrap();
                })
                .unwrap();
            (told.recv().unwrap(), affinity::niceness().unwrap())
        });
        starter.tend();
        let ((cpus, nice), asking) = asking.join().unwrap();
        assert_eq!(cpus, affinity::allowed().unwrap());
        assert_eq!(nice, affinity::niceness().unwrap());
        assert!(asking > nice, "{asking} > {nice}");
    }
}
