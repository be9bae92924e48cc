//! A real `faceoff worker` as a child process.

use crate::{
    program,
    server::{Log, Process},
};
use std::{
    fs,
    path::Path,
    process::{Command, Stdio},
};

/// A worker. Dropping it ends it at once, as a power cut would (SIGKILL).
#[derive(Debug)]
pub struct Worker {
    process: Process,
    log: Log,
}

impl Worker {
    /// Starts a worker of this name, whose folder is below `scratch`, with `config` (the text of a configuration file).
    ///
    /// # Panics
    /// If it cannot be started.
    #[must_use]
    pub fn start(scratch: &Path, name: &str, config: &str) -> Self {
        Self::start_with(scratch, name, config, &[])
    }

    /// Likewise, with more words on its command line.
    ///
    /// # Panics
    /// As [`start`](Self::start).
    #[must_use]
    pub fn start_with(scratch: &Path, name: &str, config: &str, words: &[&str]) -> Self {
        let command = Command::new(program("faceoff"));
        Self::start_by(command, scratch, name, config, words)
    }

    /// Likewise, by a command that becomes the program when it is given the program's words.
    ///
    /// # Panics
    /// As [`start`](Self::start).
    #[must_use]
    pub fn start_by(
        mut command: Command,
        scratch: &Path,
        name: &str,
        config: &str,
        words: &[&str],
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
            .args(words)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn();
        let mut process = Process(child.expect("the program can be started"));
        let log = Log::collect(process.0.stderr.take().expect("standard error is piped"));
        Self { process, log }
    }

    /// Waits until its log has `words`, `times` times.
    ///
    /// # Panics
    /// After [`PATIENCE`](crate::server::PATIENCE), with the log.
    pub fn wait_for_log(&self, words: &str, times: usize) {
        self.log.wait_for(words, times);
    }

    /// What it has logged so far.
    ///
    /// # Panics
    /// If the thread that reads the log did.
    #[must_use]
    pub fn log(&self) -> String {
        self.log.so_far()
    }

    /// Asks it to end, and waits until it has.
    ///
    /// # Panics
    /// If it ends with an error.
    pub fn end(self) {
        self.ask_to_end();
        self.ends();
    }

    /// Asks it to end (SIGTERM).
    ///
    /// # Panics
    /// If it was reaped.
    pub fn ask_to_end(&self) {
        let id = rustix::process::Pid::from_child(&self.process.0);
        rustix::process::kill_process(id, rustix::process::Signal::TERM)
            .expect("a child can be signalled");
    }

    /// Waits until it has ended by itself.
    ///
    /// # Panics
    /// If it ends with an error.
    pub fn ends(mut self) {
        let status = self.process.0.wait().expect("a child can be reaped");
        assert!(status.success(), "{status}:\n{}", self.log.so_far());
    }
}
