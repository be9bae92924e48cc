//! Limits against idle and slow connections of clients without a token, for a server that may open few file descriptors:
//! evaluations and other clients are not affected.

use crate::{
    Team,
    reference_result::{CONFIG, assert_undisturbed},
};
use faceoff_tests::{
    repository,
    server::{Server, TIMEOUT, http},
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

/// Number of idle or slow connections: as many as once made evaluations fail for lack of descriptors.
const CONNECTIONS: usize = 190;
/// The server's limit of open file descriptors.
const DESCRIPTORS: u32 = 370;
/// Number of addresses from which the clients connect. Each address may have a share of the server's connections; together
/// they try to use all.
const ADDRESSES: u8 = 5;

/// How a client keeps a connection open.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Behaviour {
    PartialRequestLine,
    EndlessHeaders,
    IdleAfterResponse,
    ReadsNothing,
}

/// A client that keeps its connection open by its [`Behaviour`], and never sends or reads anything useful.
struct IdleClient {
    stream: TcpStream,
    behaviour: Behaviour,
}

impl IdleClient {
    /// Connects from a loopback address that `number` selects, and sends the first bytes. `None` if the connection is refused.
    fn connect(server: SocketAddrV4, number: usize, behaviour: Behaviour) -> Option<Self> {
        let last_byte = 2 + u8::try_from(number % usize::from(ADDRESSES)).expect("it is small");
        let client = SocketAddrV4::new(Ipv4Addr::new(127, 0, 0, last_byte), 0);
        let stream = socket(AddressFamily::INET, SocketType::STREAM, None).expect("a socket");
        if behaviour == Behaviour::ReadsNothing {
            set_socket_recv_buffer_size(&stream, 4096).expect("it can be made smaller");
        }
        bind(&stream, &client).expect("each address 127.x.x.x is this host");
        connect(&stream, &server).ok()?;
        let mut client = Self {
            stream: TcpStream::from(stream),
            behaviour,
        };
        client.send_first_bytes();
        Some(client)
    }

    /// Sends the first bytes. Errors are ignored: the server may have refused the connection.
    fn send_first_bytes(&mut self) {
        let large_request = "GET /api/v1/openapi.json HTTP/1.1\r\nhost: x\r\n\r\n";
        let request = match self.behaviour {
            Behaviour::PartialRequestLine => "GET /api/v1/boa".to_owned(),
            Behaviour::EndlessHeaders => "GET / HTTP/1.1\r\nhost: x\r\n".to_owned(),
            Behaviour::IdleAfterResponse => {
                "GET /api/v1/season HTTP/1.1\r\nhost: x\r\n\r\n".to_owned()
            }
            Behaviour::ReadsNothing => large_request.repeat(100),
        };
        let _ = self.stream.write_all(request.as_bytes());
    }

    /// Sends another header, if the client never ends its headers.
    fn continue_headers(&mut self) {
        if self.behaviour == Behaviour::EndlessHeaders {
            let _ = self.stream.write_all(b"x-more: and more\r\n");
        }
    }

    /// Whether the server has closed the connection.
    fn is_closed(&self) -> bool {
        self.stream
            .set_nonblocking(true)
            .expect("a socket can be made non-blocking");
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

/// Asserts that clients of this behaviour do not affect an evaluation, and that the server closes their connections.
fn check_evaluation_beside(behaviour: Behaviour) {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    // The server closes a connection whose request head takes 4 s, and one that for 4 s is slower than 10 kB/s.
    let config = format!(
        "{CONFIG}\n[connections]\nhead_s = 4.0\nleast_bytes_per_s = 10000\ngrace_s = 4.0\n"
    );
    let server = Server::start_with_descriptors(&scratch.path().join("data"), &config, DESCRIPTORS);
    let hold = repository().join("agents/hold");
    let team = Team::create(&server, "Honest");
    let submission = team.submit(&server, &hold);
    assert_eq!(submission["state"], "valid", "{submission:#}");

    let mut clients: Vec<_> = (0..CONNECTIONS)
        .filter_map(|number| IdleClient::connect(server.address(), number, behaviour))
        .collect();
    assert!(!clients.is_empty());
    assert!(server.sockets() < DESCRIPTORS as usize / 2, "{behaviour:?}");
    // The evaluation starts while all connections are open.
    let evaluation = team.evaluate(&server, &submission);
    let started = Instant::now();
    let mut all_closed = false;
    loop {
        for client in &mut clients {
            client.continue_headers();
        }
        let evaluation_state = server
            .get(&evaluation, Some(&team.token))
            .json::<serde_json::Value>()
            .expect("the API speaks JSON");
        let is_finished = evaluation_state["state"] == "finished";
        // The clients keep their connections; the server closes them. A few sockets may belong to this test's own requests. A client
        // that reads nothing cannot see the end of its connection.
        all_closed |= server.sockets() <= 8
            && (behaviour == Behaviour::ReadsNothing || clients.iter().all(IdleClient::is_closed));
        if is_finished && all_closed {
            break;
        }
        assert!(
            started.elapsed() < TIMEOUT,
            "{behaviour:?}: {evaluation_state:#}"
        );
        thread::sleep(Duration::from_millis(200));
    }
    // A new client is answered.
    let client = http().build().expect("an HTTP client can be made");
    let health = client.get(format!("{}/api/v1/health", server.url)).send();
    assert_eq!(health.expect("the server answers").status(), 200);
    assert_undisturbed(&server, &team, &evaluation, &hold, scratch.path());
}

#[test]
fn partial_request_lines_do_not_affect_evaluation() {
    check_evaluation_beside(Behaviour::PartialRequestLine);
}

#[test]
fn endless_headers_do_not_affect_evaluation() {
    check_evaluation_beside(Behaviour::EndlessHeaders);
}

#[test]
fn idle_connections_do_not_affect_evaluation() {
    check_evaluation_beside(Behaviour::IdleAfterResponse);
}

#[test]
fn clients_that_read_nothing_do_not_affect_evaluation() {
    check_evaluation_beside(Behaviour::ReadsNothing);
}

#[test]
fn address_over_its_connection_share_gets_429() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let config = format!("{CONFIG}\n[connections]\nper_address = 3\n");
    let server = Server::start(&scratch.path().join("data"), &config);
    // With the number 0 all connections come from 127.0.0.2.
    let clients: Vec<_> = (0..4)
        .map(|_| IdleClient::connect(server.address(), 0, Behaviour::PartialRequestLine))
        .collect();
    let mut refused = clients
        .into_iter()
        .next_back()
        .flatten()
        .expect("the system accepts the connection");
    let mut answer = Vec::new();
    // The server has not read the request, so the connection may end with a reset and without the answer.
    let _ = refused.stream.read_to_end(&mut answer);
    let answer = String::from_utf8(answer).expect("an answer is text");
    if !answer.is_empty() {
        assert!(answer.starts_with("HTTP/1.1 429 "), "{answer}");
        assert!(answer.contains("too-many-connections"), "{answer}");
    }
    // Other addresses are not affected.
    assert_eq!(server.get("/api/v1/health", None).status(), 200);
}

/// Sets the server's soft and hard limit of descriptors; returns the previous ones.
fn limit_descriptors(server: &Server, limits: Rlimit) -> Rlimit {
    let id = i32::try_from(server.process_id()).expect("a process id is small");
    let previous = prlimit(Pid::from_raw(id), Resource::Nofile, limits);
    previous.expect("a parent may set limits of its child")
}

#[test]
fn connection_waits_while_server_lacks_descriptors() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    // This request waits until the server has listed its runtimes, which opens and closes descriptors.
    assert_eq!(server.get("/api/v1/runtimes", None).status(), 200);
    let entries = fs::read_dir(format!("/proc/{}/fd", server.process_id()));
    let open_descriptors: Vec<u64> = entries
        .expect("the server runs")
        .flatten()
        .filter_map(|entry| entry.file_name().to_string_lossy().parse().ok())
        .collect();
    let started = Instant::now();
    // Open descriptors stay open, and no new one can be opened.
    let previous = limit_descriptors(
        &server,
        Rlimit {
            current: (0..).find(|number| !open_descriptors.contains(number)),
            maximum: getrlimit(Resource::Nofile).maximum,
        },
    );
    let mut stream =
        TcpStream::connect(server.address()).expect("the system accepts the connection");
    let request = b"GET /api/v1/health/live HTTP/1.1\r\nHost: faceoff\r\nConnection: close\r\n\r\n";
    stream
        .write_all(request)
        .expect("the system buffers the request");
    server.wait_for_log("no connection can be accepted", 1);

    limit_descriptors(&server, previous);
    let mut answer = String::new();
    stream
        .read_to_string(&mut answer)
        .expect("the connection was kept waiting");
    assert!(answer.contains("alive"), "{answer}");
    assert_eq!(server.get("/api/v1/health", None).status(), 200);
    // The log has the message at most once a minute.
    let log = server.log();
    let messages = log.matches("no connection can be accepted").count();
    let minutes = started.elapsed().as_secs() / 60;
    assert!(messages as u64 <= 1 + minutes, "{log}");
}
