//! The units for systemd: systemd takes them, and the server's command does what its type promises.

use faceoff_tests::{
    program, repository,
    server::{PATIENCE, http},
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

const SERVER: &str = "faceoff.service";
const WORKER: &str = "faceoff-worker.service";
/// Where the units have the program.
const PROGRAM: &str = "/usr/local/bin/faceoff";

fn unit(name: &str) -> PathBuf {
    repository().join("docker/systemd").join(name)
}

fn text(name: &str) -> String {
    fs::read_to_string(unit(name)).expect("there is a unit")
}

/// The unit's text for the program that was built, in quotes: its path may have spaces.
fn with_program(name: &str) -> String {
    let program = format!("\"{}\"", program("faceoff").display());
    text(name).replace(PROGRAM, &program)
}

#[test]
fn systemd_takes_the_units() {
    for name in [SERVER, WORKER] {
        let scratch = tempfile::tempdir().expect("a scratch folder can be made");
        let file = scratch.path().join(name);
        fs::write(&file, with_program(name)).expect("a scratch file can be written");
        let verified = Command::new("systemd-analyze")
            .args(["verify", "--man=no", "--recursive-errors=no"])
            .arg(&file)
            .output()
            .expect("docker/setup.sh installs systemd-analyze");
        let told = String::from_utf8_lossy(&verified.stderr);
        assert!(verified.status.success(), "{name}: {told}");
        assert_eq!(told, "", "{name}: a warning is a mistake, too");
    }
}

/// What the server tells its service manager.
struct Manager {
    socket: UnixDatagram,
    server: Child,
}

impl Manager {
    /// Waits for a state of the notification protocol.
    fn wait_for(&mut self, state: &str) {
        let started = Instant::now();
        let mut message = [0; 4096];
        while started.elapsed() < PATIENCE {
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
                    let ended = self.server.try_wait().expect("a child can be asked");
                    assert!(ended.is_none(), "it ended with {ended:?} before {state}");
                }
                Err(error) => panic!("the socket: {error}"),
            }
        }
        panic!("still waiting for {state}");
    }
}

impl Drop for Manager {
    fn drop(&mut self) {
        // Already ended is fine.
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// The words of the unit's command, in a scratch folder in place of the system's.
fn command(scratch: &Path) -> Command {
    let unit = text(SERVER);
    let line = unit
        .lines()
        .find_map(|line| line.strip_prefix("ExecStart="));
    let line = line.expect("a unit has a command");
    let config = scratch.join("faceoff.toml");
    let text =
        "[server]\nlisten = \"127.0.0.1:0\"\n[workers]\nslots = 1\n[sandbox]\nresident_bytes = 0\n";
    fs::write(&config, text).expect("a scratch file can be written");
    let mut words = line.split(' ').map(|word| match word {
        PROGRAM => program("faceoff"),
        "/etc/faceoff/faceoff.toml" => config.clone(),
        "/var/lib/faceoff" => scratch.join("data"),
        word => PathBuf::from(word),
    });
    let mut command = Command::new(words.next().expect("a command has a program"));
    command.args(words);
    command
}

#[test]
fn the_units_command_tells_when_it_answers_and_when_it_ends() {
    assert!(text(SERVER).lines().any(|line| line == "Type=notify"));
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let address = scratch.path().join("notify");
    let socket = UnixDatagram::bind(&address).expect("a socket can be made");
    socket
        .set_read_timeout(Some(Duration::from_millis(200)))
        .expect("a socket has a time to wait");
    let server = command(scratch.path())
        .env("NOTIFY_SOCKET", &address)
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn();
    let mut manager = Manager {
        socket,
        server: server.expect("the program can be started"),
    };
    manager.wait_for("READY=1");
    let told = manager.server.stdout.take().expect("it is piped");
    let url = BufReader::new(told).lines().next();
    let url = url
        .expect("it tells its address")
        .expect("a pipe can be read");
    let client = http().timeout(PATIENCE).build().expect("a client");
    for path in ["/livez", "/readyz"] {
        let answer = client.get(format!("{url}{path}")).send();
        assert_eq!(answer.expect("it answers").status(), 200, "{path}");
    }
    let process = i32::try_from(manager.server.id()).expect("an id is small");
    let process = Pid::from_raw(process).expect("an id is not 0");
    kill_process(process, Signal::TERM).expect("a child can be told to end");
    let mut ended = None;
    // It may end between the two; what it said lies in the socket.
    let started = Instant::now();
    while ended.is_none() && started.elapsed() < PATIENCE {
        ended = manager.server.try_wait().expect("a child can be asked");
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(ended.expect("it ends").success());
    manager.wait_for("STOPPING=1");
}
