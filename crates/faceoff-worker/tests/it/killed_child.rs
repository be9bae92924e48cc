//! A child process that runs jobs until it is killed (`kill -9`).

use crate::server::Server;
use std::{
    env,
    io::{self, BufRead as _, BufReader, Write as _},
    path::Path,
    process::{Command, Stdio},
};

/// Environment of the child process: the server's folder, and the id of what it runs.
const FOLDER: &str = "FACEOFF_WORKER_TEST_FOLDER";
const ID: &str = "FACEOFF_WORKER_TEST_ID";
/// The line that the child process prints for each event.
const EVENT_LINE: &str = "an event";

/// Runs jobs until the process is killed or `is_over` is true for the id that [`run_and_kill`] got, and prints a line for each
/// event. Does nothing in a process that was started otherwise.
pub async fn run_jobs(slots: usize, is_over: impl AsyncFn(&Server, &str) -> bool) {
    let (Ok(folder), Ok(id)) = (env::var(FOLDER), env::var(ID)) else {
        return;
    };
    let server = Server::at(Path::new(&folder)).await;
    let mut events = server.store.events();
    let worker = server.start_worker(slots);
    while !is_over(&server, &id).await {
        let _ = events.recv().await;
        let mut out = io::stdout().lock();
        writeln!(out, "\n{EVENT_LINE}")
            .and_then(|()| out.flush())
            .unwrap();
    }
    worker.stop().await;
}

/// Runs an ignored test, which calls [`run_jobs`], in a child process on the server's folder, and kills the process after it has
/// reported `events_to_live` events. Returns how many it reported, which is less if it ended before.
pub fn run_and_kill(server: &Server, test: &str, id: &str, events_to_live: usize) -> usize {
    let mut child = Command::new(env::current_exe().unwrap())
        .args(["--exact", test, "--ignored", "--nocapture"])
        .env(FOLDER, server.path())
        .env(ID, id)
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let lines = BufReader::new(child.stdout.take().unwrap())
        .lines()
        .map_while(Result::ok);
    let seen = lines
        .filter(|line| line == EVENT_LINE)
        .take(events_to_live)
        .count();
    child.kill().unwrap();
    child.wait().unwrap();
    seen
}
