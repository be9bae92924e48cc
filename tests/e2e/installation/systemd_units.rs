//! The systemd units in `docker/systemd`: systemd accepts them, and the server notifies systemd when it is ready and when it
//! stops, as the unit's `Type=notify` requires.

use faceoff_tests::{
    program, repository,
    server::{TIMEOUT, http},
};
use rustix::process::{Pid, Signal, kill_process};
use std::{
    fs,
    io::{BufRead, BufReader, ErrorKind},
    os::unix::net::UnixDatagram,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

const SERVER_UNIT: &str = "faceoff.service";
const WORKER_UNIT: &str = "faceoff-worker.service";
/// Path of the program `faceoff` in the units.
const INSTALLED_PROGRAM: &str = "/usr/local/bin/faceoff";

fn unit_path(name: &str) -> PathBuf {
    repository().join("docker/systemd").join(name)
}

fn unit_text(name: &str) -> String {
    fs::read_to_string(unit_path(name)).expect("there is a unit")
}

/// The unit's text with the path of the program under test, in quotes, since it may have spaces.
fn with_tested_program(name: &str) -> String {
    let program = format!("\"{}\"", program("faceoff").display());
    unit_text(name).replace(INSTALLED_PROGRAM, &program)
}

#[test]
fn systemd_accepts_units_without_warnings() {
    for name in [SERVER_UNIT, WORKER_UNIT] {
        let scratch = tempfile::tempdir().expect("a scratch folder can be made");
        let file = scratch.path().join(name);
        fs::write(&file, with_tested_program(name)).expect("a scratch file can be written");
        let verified = Command::new("systemd-analyze")
            .args(["verify", "--man=no", "--recursive-errors=no"])
            .arg(&file)
            .output()
            .expect("docker/setup.sh installs systemd-analyze");
        let warnings = String::from_utf8_lossy(&verified.stderr);
        assert!(verified.status.success(), "{name}: {warnings}");
        assert_eq!(warnings, "", "{name}: a warning is a mistake, too");
    }
}

/// The part of systemd that these tests imitate: it has started the server and receives its notifications.
struct ServiceManager {
    socket: UnixDatagram,
    server: Child,
}

impl ServiceManager {
    /// Waits for a state of the notification protocol, such as `READY=1`.
    fn wait_for(&mut self, state: &str) {
        let started = Instant::now();
        let mut message = [0; 4096];
        while started.elapsed() < TIMEOUT {
            match self.socket.recv(&mut message) {
                Ok(length) => {
                    let text = String::from_utf8_lossy(&message[..length]);
                    if text.lines().any(|line| line == state) {
                        return;
                    }
                }
                Err(error)
                    if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) =>
                {
                    let ended = self
                        .server
                        .try_wait()
                        .expect("the state of a child can be read");
                    assert!(
                        ended.is_none(),
                        "the server ended with {ended:?} before {state}"
                    );
                }
                Err(error) => panic!("reading notifications: {error}"),
            }
        }
        panic!("still waiting for {state}");
    }
}

impl Drop for ServiceManager {
    fn drop(&mut self) {
        // The process may have ended already.
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// The command of the server's unit, with its paths replaced by ones in a scratch folder.
fn server_command(scratch: &Path) -> Command {
    let unit = unit_text(SERVER_UNIT);
    let line = unit
        .lines()
        .find_map(|line| line.strip_prefix("ExecStart="));
    let line = line.expect("a unit has a command");
    let config_file = scratch.join("faceoff.toml");
    let config =
        "[server]\nlisten = \"127.0.0.1:0\"\n[workers]\nslots = 1\n[sandbox]\nresident_bytes = 0\n";
    fs::write(&config_file, config).expect("a scratch file can be written");
    let mut words = line.split(' ').map(|word| match word {
        INSTALLED_PROGRAM => program("faceoff"),
        "/etc/faceoff/faceoff.toml" => config_file.clone(),
        "/var/lib/faceoff" => scratch.join("data"),
        word => PathBuf::from(word),
    });
    let mut command = Command::new(words.next().expect("a command has a program"));
    command.args(words);
    command
}

#[test]
fn server_unit_notifies_ready_and_stopping() {
    assert!(
        unit_text(SERVER_UNIT)
            .lines()
            .any(|line| line == "Type=notify")
    );
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let socket_path = scratch.path().join("notify");
    let socket = UnixDatagram::bind(&socket_path).expect("a socket can be made");
    socket
        .set_read_timeout(Some(Duration::from_millis(200)))
        .expect("a read timeout can be set");
    let server = server_command(scratch.path())
        .env("NOTIFY_SOCKET", &socket_path)
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn();
    let mut manager = ServiceManager {
        socket,
        server: server.expect("the program can be started"),
    };
    manager.wait_for("READY=1");
    let output = manager.server.stdout.take().expect("it is piped");
    let url = BufReader::new(output).lines().next();
    let url = url
        .expect("the server prints its address")
        .expect("a pipe can be read");
    let client = http()
        .timeout(TIMEOUT)
        .build()
        .expect("an HTTP client can be made");
    for path in ["/livez", "/readyz"] {
        let answer = client.get(format!("{url}{path}")).send();
        assert_eq!(answer.expect("the server answers").status(), 200, "{path}");
    }
    let process = i32::try_from(manager.server.id()).expect("an id is small");
    let process = Pid::from_raw(process).expect("an id is not 0");
    kill_process(process, Signal::TERM).expect("a child can be signalled");
    // The server may end before the test reads the notification; the socket keeps the notification.
    let mut ended = None;
    let started = Instant::now();
    while ended.is_none() && started.elapsed() < TIMEOUT {
        ended = manager
            .server
            .try_wait()
            .expect("the state of a child can be read");
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(ended.expect("the server ends").success());
    manager.wait_for("STOPPING=1");
}
