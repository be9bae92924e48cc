//! A real `faceoff serve` as a child process.

use crate::program;
use reqwest::{
    Method,
    blocking::{Client, ClientBuilder, RequestBuilder, Response},
};
use serde_json::Value;
use std::{
    fs,
    io::{self, BufRead, BufReader},
    net::SocketAddrV4,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::{Arc, Mutex},
    thread,
    time::{Duration, Instant},
};

/// How long a test waits for an expected event before it fails: long enough for slow machines, and short enough that it fails, with
/// the logs, before nextest ends it.
pub const TIMEOUT: Duration = Duration::from_secs(1200);
/// Size of the smallest pipe on Linux: one page.
const PAGE_BYTES: usize = 4096;

/// A builder for HTTP clients. They use no TLS, so the machine's certificate authorities are not read.
pub fn http() -> ClientBuilder {
    let no_authorities = rustls::ClientConfig::builder()
        .with_root_certificates(rustls::RootCertStore::empty())
        .with_no_client_auth();
    Client::builder().tls_backend_preconfigured(no_authorities)
}

/// A child process that is killed when the test ends, even by a panic.
#[derive(Debug)]
pub(crate) struct Process(pub(crate) Child);

impl Process {
    pub(crate) fn kill(&mut self) {
        // The process may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.kill();
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.log.show_on_failure("server");
    }
}

/// A running server. Dropping it kills the process (SIGKILL).
#[derive(Debug)]
pub struct Server {
    process: Process,
    log: Log,
    /// `http://127.0.0.1:PORT`
    pub url: String,
    /// The operator's token, which has an organiser's rights.
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
        Self::start_command(command(data_dir, config), |_| data_dir.to_owned())
    }

    /// Starts the server with these environment variables.
    ///
    /// # Panics
    /// As [`start`](Self::start).
    #[must_use]
    pub fn start_with_environment(
        data_dir: &Path,
        config: &str,
        variables: &[(&str, String)],
    ) -> Self {
        let mut server = command(data_dir, config);
        server.envs(variables.iter().map(|(name, value)| (*name, value)));
        Self::start_command(server, |_| data_dir.to_owned())
    }

    /// Starts the server with this limit of file descriptors.
    ///
    /// # Panics
    /// As [`start`](Self::start).
    #[must_use]
    pub fn start_with_descriptors(data_dir: &Path, config: &str, descriptors: u32) -> Self {
        let server = command(data_dir, config);
        let mut shell = Command::new("sh");
        shell
            .args([
                "-c",
                &format!("ulimit -n {descriptors}; exec \"$0\" \"$@\""),
            ])
            .arg(server.get_program())
            .args(server.get_args())
            .stdin(Stdio::null())
            .stderr(Stdio::piped());
        Self::start_command(shell, |_| data_dir.to_owned())
    }

    /// Starts the command and waits until the server answers. `data_dir` returns the path under which the test sees the data
    /// folder of a process.
    pub(crate) fn start_command(mut command: Command, data_dir: impl Fn(u32) -> PathBuf) -> Self {
        let child = command.stdout(Stdio::piped()).spawn();
        let mut process = Process(child.expect("the program can be started"));
        let child = &mut process.0;
        let log = Log::collect(child.stderr.take().expect("standard error is piped"));
        let client = http()
            .timeout(TIMEOUT)
            .build()
            .expect("a client needs nothing");
        // The server prints one line, its address. There is none if it ends before.
        let mut output =
            BufReader::new(child.stdout.take().expect("standard output is piped")).lines();
        let Some(url) = output.next().transpose().expect("a pipe can be read") else {
            let status = child.wait().expect("a child can be reaped");
            panic!("the server ended with {status}:\n{}", log.into_text());
        };
        let admin_token = fs::read_to_string(data_dir(child.id()).join("admin-token"))
            .expect("the server writes the operator's token to its folder")
            .trim()
            .to_owned();
        Self {
            process,
            log,
            url,
            admin_token,
            client,
        }
    }

    #[must_use]
    pub fn process_id(&self) -> u32 {
        self.process.0.id()
    }

    /// The log so far.
    ///
    /// # Panics
    /// If the thread that reads the log has panicked.
    #[must_use]
    pub fn log(&self) -> String {
        self.log.text()
    }

    /// Waits until the log contains `text` this many times.
    ///
    /// # Panics
    /// After [`TIMEOUT`], with the log.
    pub fn wait_for_log(&self, text: &str, times: usize) {
        self.log.wait_for(text, times);
    }

    /// The number of open sockets: connections and the listener.
    ///
    /// # Panics
    /// If the server has ended.
    #[must_use]
    pub fn sockets(&self) -> usize {
        let folder = format!("/proc/{}/fd", self.process.0.id());
        let open = fs::read_dir(folder).expect("the server runs");
        let is_socket = |entry: &io::Result<fs::DirEntry>| {
            // A descriptor may have been closed meanwhile.
            let target = entry.as_ref().ok().map(|entry| fs::read_link(entry.path()));
            target
                .and_then(Result::ok)
                .is_some_and(|target| target.to_string_lossy().starts_with("socket:"))
        };
        open.filter(is_socket).count()
    }

    /// The server's address and port.
    ///
    /// # Panics
    /// If it listens on anything but IPv4.
    #[must_use]
    pub fn address(&self) -> SocketAddrV4 {
        let address = self.url.trim_start_matches("http://");
        address
            .parse()
            .expect("it listens on the loopback interface")
    }

    /// Kills the server, as dropping it does.
    pub fn kill(self) {
        drop(self);
    }

    /// [`kill`](Self::kill) for a caller that replaces the server afterwards.
    pub(crate) fn kill_process(&mut self) {
        self.process.kill();
    }

    /// Starts the server, and kills it `delay` after `is_moment` has returned true for an entry of its log. This log has each
    /// statement of the database and goes through a pipe of one page. So the server is at most one page of log ahead of
    /// the entry that `is_moment` has seen.
    ///
    /// # Panics
    /// If the server cannot be started, or ends before.
    pub fn start_and_kill(
        data_dir: &Path,
        config: &str,
        mut is_moment: impl FnMut(&Value) -> bool,
        delay: Duration,
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
        // A larger buffer would let the server run ahead.
        let mut log = BufReader::with_capacity(1, log);
        let mut line = String::new();
        loop {
            line.clear();
            let length = log.read_line(&mut line).expect("a log is text");
            assert!(length > 0, "the server ended before it was killed");
            let entry = serde_json::from_str(&line)
                .unwrap_or_else(|error| panic!("a line of the log: {error}: {line}"));
            if is_moment(&entry) {
                break;
            }
        }
        thread::sleep(delay);
        // The log was not read during the delay. So its pipe is full, and the server has waited to log its next entry.
        drop(process);
    }

    /// Sends `GET`, with a token if one is given.
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

    /// A request with any method, which the caller sends.
    pub fn request(&self, method: Method, path: &str, token: &str) -> RequestBuilder {
        let url = format!("{}{path}", self.url);
        self.client.request(method, url).bearer_auth(token)
    }

    /// Sends `POST` with a JSON body.
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

    /// Uploads an archive as a submission.
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

    /// Repeats `GET path` until `is_done` returns true; returns the last response. With `|_| true` it is a single request.
    ///
    /// # Panics
    /// After [`TIMEOUT`], with the last answer.
    #[must_use]
    pub fn poll(&self, path: &str, token: &str, is_done: impl Fn(&Value) -> bool) -> Value {
        let started = Instant::now();
        loop {
            let answer: Value = self
                .get(path, Some(token))
                .json()
                .expect("the API speaks JSON");
            if is_done(&answer) {
                return answer;
            }
            assert!(
                started.elapsed() < TIMEOUT,
                "still waiting for {path}: {answer:#}"
            );
            // The pause keeps the CPU for the evaluation and for other tests.
            let waited = started.elapsed() / 10;
            thread::sleep(waited.clamp(Duration::from_millis(20), Duration::from_millis(250)));
        }
    }
}

/// The command for a server on a free port, with its log on a pipe.
fn command(data_dir: &Path, config: &str) -> Command {
    fs::create_dir_all(data_dir).expect("a scratch folder can be made");
    let config_file = data_dir.join("faceoff.toml");
    fs::write(&config_file, config).expect("a scratch file can be written");
    let mut command = Command::new(program("faceoff"));
    add_serve_arguments(&mut command, data_dir, &config_file);
    command
}

/// Adds the arguments of `faceoff serve`.
pub(crate) fn add_serve_arguments(command: &mut Command, data_dir: &Path, config_file: &Path) {
    command
        .arg("serve")
        .args(["--listen", "127.0.0.1:0"])
        .arg("--data-dir")
        .arg(data_dir)
        .arg("--config")
        .arg(config_file)
        .stdin(Stdio::null())
        .stderr(Stdio::piped());
}

/// A child's log, read continuously so that the child never blocks.
#[derive(Debug)]
pub(crate) struct Log {
    text: Arc<Mutex<String>>,
    reader: thread::JoinHandle<()>,
}

impl Log {
    pub(crate) fn collect(stderr: impl std::io::Read + Send + 'static) -> Self {
        let text = Arc::new(Mutex::new(String::new()));
        let reader = thread::spawn({
            let text = Arc::clone(&text);
            move || {
                for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                    let mut text = text
                        .lock()
                        .expect("no thread panics while it holds the log");
                    text.push_str(&line);
                    text.push('\n');
                }
            }
        });
        Self { text, reader }
    }

    pub(crate) fn text(&self) -> String {
        self.text
            .lock()
            .expect("no thread panics while it holds the log")
            .clone()
    }

    pub(crate) fn wait_for(&self, text: &str, times: usize) {
        let started = Instant::now();
        while self.text().matches(text).count() < times {
            assert!(
                started.elapsed() < TIMEOUT,
                "still waiting for {text:?}:\n{}",
                self.text()
            );
            // The pause keeps the CPU for the server.
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// Prints the log if the test has failed.
    pub(crate) fn show_on_failure(&self, process: &str) {
        if thread::panicking() {
            #[expect(clippy::print_stderr, reason = "a panic shows its own message only")]
            {
                eprintln!("log of the {process}:\n{}", self.text());
            }
        }
    }

    /// The complete log of a child that has ended.
    fn into_text(self) -> String {
        let Self { text, reader } = self;
        reader.join().expect("the log is read to its end");
        let text = text
            .lock()
            .expect("no thread panics while it holds the log");
        text.clone()
    }
}
