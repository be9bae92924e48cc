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

/// How long a test waits for something that should happen before it calls it lost: so long that only a
/// dead machine is called that.
pub const PATIENCE: Duration = Duration::from_secs(1800);
/// The smallest pipe that Linux offers: a page.
const PAGE_BYTES: usize = 4096;

/// Of whatever makes clients. None speaks TLS, so none asks for the machine's certificate authorities.
pub fn http() -> ClientBuilder {
    let nobody = rustls::ClientConfig::builder()
        .with_root_certificates(rustls::RootCertStore::empty())
        .with_no_client_auth();
    Client::builder().tls_backend_preconfigured(nobody)
}

/// A process that does not outlive the test, however that ends.
#[derive(Debug)]
pub(crate) struct Process(pub(crate) Child);

impl Process {
    pub(crate) fn end(&mut self) {
        // Already ended is fine.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.end();
    }
}

/// A running server. Dropping it ends the process at once, as a power cut would (SIGKILL).
#[derive(Debug)]
pub struct Server {
    process: Process,
    log: Log,
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
        Self::answering(command(data_dir, config), |_| data_dir.to_owned())
    }

    /// Starts it with these variables in its environment.
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
        Self::answering(server, |_| data_dir.to_owned())
    }

    /// Starts it on a host that allows it so many file descriptors and no more.
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
        Self::answering(shell, |_| data_dir.to_owned())
    }

    /// Waits until the started program answers. `data_dir` tells of its process where this one sees
    /// its data folder.
    pub(crate) fn answering(mut command: Command, data_dir: impl Fn(u32) -> PathBuf) -> Self {
        let child = command.stdout(Stdio::piped()).spawn();
        let mut process = Process(child.expect("the program can be started"));
        let child = &mut process.0;
        let log = Log::collect(child.stderr.take().expect("standard error is piped"));
        let client = http()
            .timeout(PATIENCE)
            .build()
            .expect("a client needs nothing");
        // The only line on its standard output is its address; none comes if it ends before.
        let mut told =
            BufReader::new(child.stdout.take().expect("standard output is piped")).lines();
        let Some(url) = told.next().transpose().expect("a pipe can be read") else {
            let status = child.wait().expect("a child can be reaped");
            panic!("the server ended with {status}:\n{}", log.whole());
        };
        let admin_token = fs::read_to_string(data_dir(child.id()).join("admin-token"))
            .expect("the server leaves the organiser's token in its folder")
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

    /// The id of its process.
    #[must_use]
    pub fn process_id(&self) -> u32 {
        self.process.0.id()
    }

    /// What it has logged so far.
    ///
    /// # Panics
    /// If the thread that reads the log did.
    #[must_use]
    pub fn log(&self) -> String {
        self.log.so_far()
    }

    /// Waits until the log has `words`, `times` times.
    ///
    /// # Panics
    /// After [`PATIENCE`], with the log.
    pub fn wait_for_log(&self, words: &str, times: usize) {
        self.log.wait_for(words, times);
    }

    /// How many sockets it has open: connections, and the one that listens.
    ///
    /// # Panics
    /// If the system does not tell.
    #[must_use]
    pub fn sockets(&self) -> usize {
        let folder = format!("/proc/{}/fd", self.process.0.id());
        let open = fs::read_dir(folder).expect("the server runs");
        let is_socket = |entry: &io::Result<fs::DirEntry>| {
            // One that was closed meanwhile is none.
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

    /// Ends the server, as dropping it does.
    pub fn kill(self) {
        drop(self);
    }

    /// [`kill`](Self::kill), for who replaces it.
    pub(crate) fn end(&mut self) {
        self.process.end();
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
            // Polling is what a client of this API does; the pause keeps the CPU for the evaluation, and for other tests.
            let waited = started.elapsed() / 10;
            thread::sleep(waited.clamp(Duration::from_millis(20), Duration::from_millis(250)));
        }
    }
}

/// The server on any free port, with its log on a pipe.
fn command(data_dir: &Path, config: &str) -> Command {
    fs::create_dir_all(data_dir).expect("a scratch folder can be made");
    let config_file = data_dir.join("faceoff.toml");
    fs::write(&config_file, config).expect("a scratch file can be written");
    let mut command = Command::new(program("faceoff"));
    serve(&mut command, data_dir, &config_file);
    command
}

/// The arguments of the program.
pub(crate) fn serve(command: &mut Command, data_dir: &Path, config_file: &Path) {
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

/// A child's log, drained so that the child never blocks.
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
                    let mut text = text.lock().expect("nobody panics with the log");
                    text.push_str(&line);
                    text.push('\n');
                }
            }
        });
        Self { text, reader }
    }

    pub(crate) fn so_far(&self) -> String {
        self.text
            .lock()
            .expect("nobody panics with the log")
            .clone()
    }

    pub(crate) fn wait_for(&self, words: &str, times: usize) {
        let started = Instant::now();
        while self.so_far().matches(words).count() < times {
            assert!(
                started.elapsed() < PATIENCE,
                "still waiting for {words:?}:\n{}",
                self.so_far()
            );
            // A log is looked at, as people do.
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// Of a child that has ended.
    fn whole(self) -> String {
        let Self { text, reader } = self;
        reader.join().expect("the log is read to its end");
        let text = text.lock().expect("nobody panics with the log");
        text.clone()
    }
}
