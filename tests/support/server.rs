//! A real `faceoff serve` as a child process.

use crate::program;
use reqwest::blocking::{Client, Response};
use serde_json::Value;
use std::{
    fs,
    io::{BufRead, BufReader},
    net::TcpListener,
    path::Path,
    process::{Child, Command, Stdio},
    sync::mpsc,
    thread,
    time::{Duration, Instant},
};

/// How long a test waits for something that should happen before it calls it lost.
pub const PATIENCE: Duration = Duration::from_secs(180);

/// A running server. Dropping it ends the process.
#[derive(Debug)]
pub struct Server {
    child: Child,
    /// `http://127.0.0.1:PORT`
    pub url: String,
    /// The organiser's bearer token.
    pub admin_token: String,
    client: Client,
}

impl Server {
    /// Starts the server on a free port with `config` (the text of a configuration file) and waits
    /// until it answers.
    ///
    /// # Panics
    /// If it does not start; the panic shows its log.
    #[must_use]
    pub fn start(data_dir: &Path, config: &str) -> Self {
        let port = TcpListener::bind("127.0.0.1:0")
            .and_then(|listener| listener.local_addr())
            .expect("a port is free")
            .port();
        let mut child = spawn(data_dir, config, port);
        let log = collect(child.stderr.take().expect("standard error is piped"));
        let client = Client::builder()
            .timeout(Duration::from_secs(60))
            .build()
            .expect("a client needs nothing");
        let url = format!("http://127.0.0.1:{port}");
        let started = Instant::now();
        loop {
            if client.get(format!("{url}/api/v1/health")).send().is_ok() {
                break;
            }
            if let Some(status) = child.try_wait().expect("a child can be asked") {
                panic!(
                    "the server ended with {status}:\n{}",
                    log.recv().unwrap_or_default()
                );
            }
            assert!(started.elapsed() < PATIENCE, "the server does not answer");
            thread::yield_now();
        }
        let admin_token = fs::read_to_string(data_dir.join("admin-token"))
            .expect("the server leaves the organiser's token in its folder")
            .trim()
            .to_owned();
        Self {
            child,
            url,
            admin_token,
            client,
        }
    }

    /// Ends the server at once, as a power cut would (SIGKILL), and reaps it.
    ///
    /// # Panics
    /// If the process is not ours to kill.
    pub fn kill(mut self) {
        self.child.kill().expect("a child can be killed");
        self.child.wait().expect("a child can be reaped");
    }

    /// Starts the server and ends it as [`kill`](Self::kill) does, `lifetime` after the process began:
    /// it may not have come as far as to answer.
    ///
    /// # Panics
    /// If it cannot be started.
    pub fn start_and_kill(data_dir: &Path, config: &str, lifetime: Duration) {
        let mut child = spawn(data_dir, config, 0);
        let _log = collect(child.stderr.take().expect("standard error is piped"));
        thread::sleep(lifetime);
        child.kill().expect("a child can be killed");
        child.wait().expect("a child can be reaped");
    }

    /// `GET`, with a token if one is given.
    ///
    /// # Panics
    /// If the server does not answer.
    #[must_use]
    pub fn get(&self, path: &str, token: Option<&str>) -> Response {
        let mut request = self.client.get(format!("{}{path}", self.url));
        if let Some(token) = token {
            request = request.bearer_auth(token);
        }
        request.send().expect("the server answers")
    }

    /// `POST` of a JSON body.
    ///
    /// # Panics
    /// If the server does not answer.
    #[must_use]
    pub fn post(&self, path: &str, token: &str, body: &Value) -> Response {
        self.client
            .post(format!("{}{path}", self.url))
            .bearer_auth(token)
            .json(body)
            .send()
            .expect("the server answers")
    }

    /// `POST` of an archive.
    ///
    /// # Panics
    /// If the server does not answer.
    #[must_use]
    pub fn upload(&self, token: &str, archive: Vec<u8>) -> Response {
        self.client
            .post(format!("{}/api/v1/submissions", self.url))
            .bearer_auth(token)
            .header("content-type", "application/octet-stream")
            .body(archive)
            .send()
            .expect("the server answers")
    }

    /// Asks `path` until `done` says so, and returns the last answer.
    ///
    /// # Panics
    /// After [`PATIENCE`], with the last answer.
    #[must_use]
    pub fn poll(&self, path: &str, token: &str, done: impl Fn(&Value) -> bool) -> Value {
        let started = Instant::now();
        loop {
            let answer: Value = self
                .get(path, Some(token))
                .json()
                .expect("the API speaks JSON");
            if done(&answer) {
                return answer;
            }
            assert!(
                started.elapsed() < PATIENCE,
                "still waiting for {path}: {answer:#}"
            );
            // Polling is what a client of this API does; the pause keeps the CPU for the evaluation.
            thread::sleep(Duration::from_millis(50));
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // Already ended is fine: the process must only not outlive the test.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The process, with its log on a pipe. Port 0 is any free one.
fn spawn(data_dir: &Path, config: &str, port: u16) -> Child {
    fs::create_dir_all(data_dir).expect("a scratch folder can be made");
    let config_file = data_dir.join("faceoff.toml");
    fs::write(&config_file, config).expect("a scratch file can be written");
    Command::new(program("faceoff"))
        .arg("serve")
        .args(["--listen", &format!("127.0.0.1:{port}")])
        .arg("--data-dir")
        .arg(data_dir)
        .arg("--config")
        .arg(&config_file)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program can be started")
}

/// Drains a child's log so that it never blocks, and hands it over when the child ends.
fn collect(stderr: impl std::io::Read + Send + 'static) -> mpsc::Receiver<String> {
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || {
        let mut log = String::new();
        for line in BufReader::new(stderr).lines().map_while(Result::ok) {
            log.push_str(&line);
            log.push('\n');
        }
        let _ = sender.send(log);
    });
    receiver
}
