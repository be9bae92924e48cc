//! A real `faceoff worker` (a process that runs jobs of a server) as a child process.

use crate::{
    program,
    server::{Log, Process, TIMEOUT},
};
use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process, waitid};
use std::{
    fs,
    path::Path,
    process::{Command, Stdio},
    thread,
    time::{Duration, Instant},
};

/// A remote worker. Dropping it kills it (SIGKILL).
#[derive(Debug)]
pub struct Worker {
    name: String,
    process: Process,
    log: Log,
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.log.show_on_failure(&self.name);
    }
}

impl Worker {
    /// Starts a worker with this name, a folder below `scratch`, and `config` (the text of a configuration file).
    ///
    /// # Panics
    /// If it cannot be started.
    #[must_use]
    pub fn start(scratch: &Path, name: &str, config: &str) -> Self {
        Self::start_with_arguments(scratch, name, config, &[])
    }

    /// Starts a worker with additional arguments.
    ///
    /// # Panics
    /// As [`start`](Self::start).
    #[must_use]
    pub fn start_with_arguments(
        scratch: &Path,
        name: &str,
        config: &str,
        arguments: &[&str],
    ) -> Self {
        let command = Command::new(program("faceoff"));
        Self::start_with_command(command, scratch, name, config, arguments)
    }

    /// Starts a worker by a command to which the program's arguments are added.
    ///
    /// # Panics
    /// As [`start`](Self::start).
    #[must_use]
    pub fn start_with_command(
        mut command: Command,
        scratch: &Path,
        name: &str,
        config: &str,
        arguments: &[&str],
    ) -> Self {
        let folder = scratch.join(name);
        fs::create_dir_all(&folder).expect("a scratch folder can be made");
        let file = folder.join("faceoff.toml");
        fs::write(&file, config).expect("a scratch file can be written");
        let child = command
            .args(["worker", "--name", name, "--config"])
            .arg(&file)
            .arg("--scratch-dir")
            .arg(folder.join("scratch"))
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn();
        let mut process = Process(child.expect("the program can be started"));
        let log = Log::collect(process.0.stderr.take().expect("standard error is piped"));
        let name = name.to_owned();
        Self { name, process, log }
    }

    /// Waits until the log contains `text` this many times.
    ///
    /// # Panics
    /// After [`TIMEOUT`](crate::server::TIMEOUT), with the log.
    pub fn wait_for_log(&self, text: &str, times: usize) {
        self.log.wait_for(text, times);
    }

    /// The log so far.
    ///
    /// # Panics
    /// If the thread that reads the log has panicked.
    #[must_use]
    pub fn log(&self) -> String {
        self.log.text()
    }

    /// Asks the worker to stop (SIGTERM), and waits until it has.
    ///
    /// # Panics
    /// If it ends with an error.
    pub fn stop(self) {
        self.request_stop();
        self.wait_for_exit();
    }

    /// Asks the worker to stop (SIGTERM).
    ///
    /// # Panics
    /// If it was reaped.
    pub fn request_stop(&self) {
        kill_process(self.id(), Signal::TERM).expect("a child can be signalled");
    }

    /// Waits until the worker has ended without a further signal.
    ///
    /// # Panics
    /// If it ends with an error, or not within [`TIMEOUT`].
    pub fn wait_for_exit(mut self) {
        let started = Instant::now();
        while !self.has_ended() {
            assert!(
                started.elapsed() < TIMEOUT,
                "the worker {} does not end",
                self.name
            );
            thread::sleep(Duration::from_millis(10));
        }
        let status = self.process.0.wait().expect("a child can be reaped");
        assert!(status.success(), "{status}");
    }

    /// Has the process ended? The check does not reap it.
    ///
    /// # Panics
    /// If it was reaped.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        let status = waitid(WaitId::Pid(self.id()), options);
        status.expect("a child can be waited for").is_some()
    }

    fn id(&self) -> Pid {
        Pid::from_child(&self.process.0)
    }
}
