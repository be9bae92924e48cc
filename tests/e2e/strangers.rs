//! Connections of somebody who has no token and wants nothing but to hold them, on a host with few descriptors.

use crate::{
    Team,
    undisturbed::{CONFIG, assert_undisturbed},
};
use faceoff_tests::{
    repository,
    server::{PATIENCE, Server, http},
};
use rustix::{
    net::{AddressFamily, SocketType, bind, connect, socket, sockopt::set_socket_recv_buffer_size},
    process::{Pid, Resource, Rlimit, getrlimit, prlimit},
};
use std::{
    fs,
    io::{ErrorKind, Read, Write},
    net::{Ipv4Addr, SocketAddrV4, TcpStream},
    thread,
    time::{Duration, Instant},
};

/// As many as there were when evaluations failed for want of a descriptor.
const STRANGERS: usize = 190;
const DESCRIPTORS: u32 = 300;
/// The addresses that they come from: each gets a share of the places, and together they want all.
const ADDRESSES: u8 = 5;

/// How a stranger holds a connection.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Manner {
    HalfARequestLine,
    HeadersForEver,
    IdleAfterAnAnswer,
    ReadsNothing,
}

struct Stranger {
    stream: TcpStream,
    manner: Manner,
}

impl Stranger {
    /// From one of many addresses of the loopback network.
    fn connect(server: SocketAddrV4, number: usize, manner: Manner) -> Option<Self> {
        let last = 2 + u8::try_from(number % usize::from(ADDRESSES)).expect("it is small");
        let from = SocketAddrV4::new(Ipv4Addr::new(127, 0, 0, last), 0);
        let stream = socket(AddressFamily::INET, SocketType::STREAM, None).expect("a socket");
        if manner == Manner::ReadsNothing {
            set_socket_recv_buffer_size(&stream, 4096).expect("it can be made smaller");
        }
        bind(&stream, &from).expect("all of 127 is this host");
        connect(&stream, &server).ok()?;
        let mut stranger = Self {
            stream: TcpStream::from(stream),
            manner,
        };
        stranger.begin();
        Some(stranger)
    }

    /// Whoever is not let in sees that when it writes or reads, and does not mind.
    fn begin(&mut self) {
        let page = "GET /api/v1/openapi.json HTTP/1.1\r\nhost: x\r\n\r\n";
        let said = match self.manner {
            Manner::HalfARequestLine => "GET /api/v1/boa".to_owned(),
            Manner::HeadersForEver => "GET / HTTP/1.1\r\nhost: x\r\n".to_owned(),
            Manner::IdleAfterAnAnswer => {
                "GET /api/v1/season HTTP/1.1\r\nhost: x\r\n\r\n".to_owned()
            }
            Manner::ReadsNothing => page.repeat(100),
        };
        let _ = self.stream.write_all(said.as_bytes());
    }

    /// Another header, from one who has always one more.
    fn go_on(&mut self) {
        if self.manner == Manner::HeadersForEver {
            let _ = self.stream.write_all(b"x-more: of the same\r\n");
        }
    }

    /// Has the server let go of it?
    fn is_let_go(&self) -> bool {
        self.stream
            .set_nonblocking(true)
            .expect("a socket can be asked");
        let mut answer = [0; 4096];
        loop {
            match (&self.stream).read(&mut answer) {
                Ok(0) => return true,
                Ok(_) => {}
                Err(error) => return error.kind() != ErrorKind::WouldBlock,
            }
        }
    }
}

fn disturbed_by(manner: Manner) {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let config = format!(
        "{CONFIG}\n[connections]\nhead_s = 4.0\nleast_bytes_per_s = 10000\ngrace_s = 4.0\n"
    );
    let server = Server::start_with_descriptors(&scratch.path().join("data"), &config, DESCRIPTORS);
    let hold = repository().join("agents/hold");
    let team = Team::create(&server, "Honest");
    let submission = team.submit(&server, &hold);
    assert_eq!(submission["state"], "valid", "{submission:#}");

    let mut strangers: Vec<_> = (0..STRANGERS)
        .filter_map(|number| Stranger::connect(server.address(), number, manner))
        .collect();
    assert!(!strangers.is_empty());
    assert!(server.sockets() < DESCRIPTORS as usize / 2, "{manner:?}");
    // What the strangers are to disturb, from its beginning.
    let evaluation = team.evaluate(&server, &submission);
    let started = Instant::now();
    let mut all_gone = false;
    loop {
        for stranger in &mut strangers {
            stranger.go_on();
        }
        let state = server
            .get(&evaluation, Some(&team.token))
            .json::<serde_json::Value>()
            .expect("the API speaks JSON");
        let over = state["state"] == "finished";
        // The strangers have gone nowhere; it is the server that lets go of them. The last few of its sockets may be
        // theirs or ours. Who reads nothing cannot see it.
        all_gone |= server.sockets() <= 8
            && (manner == Manner::ReadsNothing || strangers.iter().all(Stranger::is_let_go));
        if over && all_gone {
            break;
        }
        assert!(started.elapsed() < PATIENCE, "{manner:?}: {state:#}");
        thread::sleep(Duration::from_millis(200));
    }
    // Whoever comes now is answered.
    let client = http().build().expect("a client needs nothing");
    let health = client.get(format!("{}/api/v1/health", server.url)).send();
    assert_eq!(health.expect("the server answers").status(), 200);
    assert_undisturbed(&server, &team, &evaluation, &hold, scratch.path());
}

#[test]
fn half_a_request_line_holds_no_evaluation_up() {
    disturbed_by(Manner::HalfARequestLine);
}

#[test]
fn headers_for_ever_hold_no_evaluation_up() {
    disturbed_by(Manner::HeadersForEver);
}

#[test]
fn idle_connections_hold_no_evaluation_up() {
    disturbed_by(Manner::IdleAfterAnAnswer);
}

#[test]
fn readers_that_read_nothing_hold_no_evaluation_up() {
    disturbed_by(Manner::ReadsNothing);
}

#[test]
fn one_address_has_a_share_and_is_told_so() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let config = format!("{CONFIG}\n[connections]\nper_address = 3\n");
    let server = Server::start(&scratch.path().join("data"), &config);
    // All from 127.0.0.2.
    let strangers: Vec<_> = (0..4)
        .map(|_| Stranger::connect(server.address(), 0, Manner::HalfARequestLine))
        .collect();
    let mut last = strangers
        .into_iter()
        .next_back()
        .flatten()
        .expect("the system lets it in");
    let mut told = Vec::new();
    // What it has said already may turn the end into a reset.
    let _ = last.stream.read_to_end(&mut told);
    let told = String::from_utf8(told).expect("an answer is text");
    if !told.is_empty() {
        assert!(told.starts_with("HTTP/1.1 429 "), "{told}");
        assert!(told.contains("too-many-connections"), "{told}");
    }
    // Others are not concerned.
    assert_eq!(server.get("/api/v1/health", None).status(), 200);
}

/// Sets the server's limits of descriptors; those that it had.
fn limit_descriptors(server: &Server, limits: Rlimit) -> Rlimit {
    let id = i32::try_from(server.process_id()).expect("a process number");
    let before = prlimit(Pid::from_raw(id), Resource::Nofile, limits);
    before.expect("whoever started it may limit it")
}

#[test]
fn without_a_free_descriptor_who_comes_waits_at_the_door() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    // The answer comes when the runtimes have been asked what they hold, which takes and gives back descriptors.
    assert_eq!(server.get("/api/v1/runtimes", None).status(), 200);
    let open = fs::read_dir(format!("/proc/{}/fd", server.process_id())).expect("it runs");
    let open: Vec<u64> = open
        .flatten()
        .filter_map(|entry| entry.file_name().to_string_lossy().parse().ok())
        .collect();
    let began = Instant::now();
    // What is open stays open; nothing is opened.
    let before = limit_descriptors(
        &server,
        Rlimit {
            current: (0..).find(|number| !open.contains(number)),
            maximum: getrlimit(Resource::Nofile).maximum,
        },
    );
    let mut stream = TcpStream::connect(server.address()).expect("the system takes it");
    let asked = b"GET /api/v1/health/live HTTP/1.1\r\nHost: faceoff\r\nConnection: close\r\n\r\n";
    stream.write_all(asked).expect("the system takes that, too");
    server.wait_for_log("no connection can be accepted", 1);

    limit_descriptors(&server, before);
    let mut answer = String::new();
    stream
        .read_to_string(&mut answer)
        .expect("it was waiting, not lost");
    assert!(answer.contains("alive"), "{answer}");
    assert_eq!(server.get("/api/v1/health", None).status(), 200);
    // However long it lasts, the log is short: once a minute.
    let log = server.log();
    let told = log.matches("no connection can be accepted").count();
    let minutes = began.elapsed().as_secs() / 60;
    assert!(told as u64 <= 1 + minutes, "{log}");
}
