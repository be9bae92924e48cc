//! A real `faceoff serve` as a child process.

use crate::program;
use reqwest::{
    Method,
    blocking::{Client, RequestBuilder, Response},
};
use serde_json::Value;
use std::{
    fs,
    io::{self, BufRead, BufReader},
    path::Path,
    process::{Child, Command, Stdio},
    sync::{Arc, Mutex, PoisonError, mpsc},
    thread,
    time::{Duration, Instant},
};

/// How long a test waits for something that should happen before it calls it lost: so long that only a
/// dead machine is called that.
pub const PATIENCE: Duration = Duration::from_secs(1800);
/// The smallest pipe that Linux offers: a page.
const PAGE_BYTES: usize = 4096;

/// A process that does not outlive the test, however that ends.
#[derive(Debug)]
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        // Already ended is fine.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A running server. Dropping it ends the process at once, as a power cut would (SIGKILL).
#[derive(Debug)]
pub struct Server {
    process: Process,
    /// `http://127.0.0.1:PORT`
    pub url: String,
    /// The organiser's bearer token.
    pub admin_token: String,
    client: Client,
    log: Log,
}

/// What a server has logged so far.
type Log = Arc<Mutex<String>>;

impl Server {
    /// Starts the server on a free port with `config` (the text of a configuration file) and waits
    /// until it answers.
    ///
    /// # Panics
    /// If it does not start; the panic shows its log.
    #[must_use]
    pub fn start(data_dir: &Path, config: &str) -> Self {
        let child = command(data_dir, config).stdout(Stdio::piped()).spawn();
        let mut process = Process(child.expect("the program can be started"));
        let child = &mut process.0;
        let (log, ended) = collect(child.stderr.take().expect("standard error is piped"));
        let client = Client::builder()
            .timeout(PATIENCE)
            .build()
            .expect("a client needs nothing");
        // The only line on its standard output is its address; none comes if it ends before.
        let mut told =
            BufReader::new(child.stdout.take().expect("standard output is piped")).lines();
        let Some(url) = told.next().transpose().expect("a pipe can be read") else {
            let status = child.wait().expect("a child can be reaped");
            // Its last words come with its end.
            let _ = ended.recv();
            panic!("the server ended with {status}:\n{}", so_far(&log));
        };
        let admin_token = fs::read_to_string(data_dir.join("admin-token"))
            .expect("the server leaves the organiser's token in its folder")
            .trim()
            .to_owned();
        Self {
            process,
            url,
            admin_token,
            client,
            log,
        }
    }

    /// What it has logged so far.
    #[must_use]
    pub fn log(&self) -> String {
        so_far(&self.log)
    }

    /// Its process id.
    #[must_use]
    pub fn pid(&self) -> u32 {
        self.process.0.id()
    }

    /// Ends the server, as dropping it does.
    pub fn kill(self) {
        drop(self);
    }

    /// Starts the server and ends it as [`kill`](Self::kill) does, `later` after `reached` has said yes
    /// to an entry of its log. The log tells every statement of the database, and goes through a
    /// pipe of one page: however quick the server and however slow this thread, the server is at most
    /// a page of log further than what `reached` has seen.
    ///
    /// # Panics
    /// If it cannot be started, or ends by itself.
    pub fn start_and_kill(
        data_dir: &Path,
        config: &str,
        mut reached: impl FnMut(&Value) -> bool,
        later: Duration,
    ) {
        let (log, writer) = io::pipe().expect("there are pipes");
        rustix::pipe::fcntl_setpipe_size(&log, PAGE_BYTES).expect("a pipe can be made smaller");
        let child = command(data_dir, config)
            .args(["--log-format", "json"])
            .env("RUST_LOG", "info,sqlx::query=debug")
            .stdout(Stdio::null())
            .stderr(writer)
            .spawn();
        let process = Process(child.expect("the program can be started"));
        // A reader that reads ahead would let the server run ahead.
        let mut log = BufReader::with_capacity(1, log);
        let mut line = String::new();
        loop {
            line.clear();
            let length = log.read_line(&mut line).expect("a log is text");
            assert!(length > 0, "the server ended by itself");
            let entry = serde_json::from_str(&line)
                .unwrap_or_else(|error| panic!("a line of the log: {error}: {line}"));
            if reached(&entry) {
                break;
            }
        }
        // Not to wait for something: the moment that was drawn.
        thread::sleep(later);
        // While its log is still held: nothing would hold the server back.
        drop(process);
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

    /// A request of any kind, to be sent by the caller.
    pub fn request(&self, method: Method, path: &str, token: &str) -> RequestBuilder {
        let url = format!("{}{path}", self.url);
        self.client.request(method, url).bearer_auth(token)
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

/// The server on any free port, with its log on a pipe.
fn command(data_dir: &Path, config: &str) -> Command {
    fs::create_dir_all(data_dir).expect("a scratch folder can be made");
    let config_file = data_dir.join("faceoff.toml");
    fs::write(&config_file, config).expect("a scratch file can be written");
    let mut command = Command::new(program("faceoff"));
    command
        .arg("serve")
        .args(["--listen", "127.0.0.1:0"])
        .arg("--data-dir")
        .arg(data_dir)
        .arg("--config")
        .arg(&config_file)
        .stdin(Stdio::null())
        .stderr(Stdio::piped());
    command
}

/// Drains a child's log so that it never blocks; the receiver hears of its end.
fn collect(stderr: impl io::Read + Send + 'static) -> (Log, mpsc::Receiver<()>) {
    let (ending, ended) = mpsc::channel::<()>();
    let log = Log::default();
    let collected = Arc::clone(&log);
    thread::spawn(move || {
        let _ending = ending;
        for line in BufReader::new(stderr).lines().map_while(Result::ok) {
            let mut log = collected.lock().unwrap_or_else(PoisonError::into_inner);
            log.push_str(&line);
            log.push('\n');
        }
    });
    (log, ended)
}

fn so_far(log: &Log) -> String {
    log.lock().unwrap_or_else(PoisonError::into_inner).clone()
}
