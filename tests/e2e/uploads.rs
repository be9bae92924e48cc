//! Uploads that take places, disk or time from others: slow ones, refused ones, archives without an end. All the
//! while another team's evaluation goes on to the result that it has on a quiet host.

use crate::{
    Team,
    undisturbed::{CONFIG, assert_undisturbed},
};
use faceoff_tests::{
    bundle::{packed, python_agent, python_bundle},
    repository,
    server::{PATIENCE, Server},
};
use flate2::{Compression, write::GzEncoder};
use reqwest::Method;
use serde_json::{Value, json};
use std::{
    fs,
    io::{ErrorKind, Read, Write},
    net::TcpStream,
    path::{Path, PathBuf},
    thread,
    time::{Duration, Instant, SystemTime},
};
use tar::{EntryType, Header};

const MIB: usize = 1 << 20;
const GZIP: [u8; 4] = [0x1f, 0x8b, 8, 0];

fn hold() -> PathBuf {
    repository().join("agents/hold")
}

/// Polls for what must come true; the pause keeps the CPU for the evaluation.
fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    let started = Instant::now();
    while !is_so() {
        assert!(started.elapsed() < PATIENCE, "still waiting: {what}");
        thread::sleep(Duration::from_millis(20));
    }
}

/// How many files are below a folder.
fn files(folder: &Path) -> usize {
    let Ok(entries) = fs::read_dir(folder) else {
        return 0;
    };
    entries
        .map(|entry| {
            let path = entry.expect("a folder can be read").path();
            if path.is_dir() { files(&path) } else { 1 }
        })
        .sum()
}

/// A team with an agent that is to play.
struct Honest {
    team: Team,
    submission: Value,
}

impl Honest {
    fn enter(server: &Server) -> Self {
        let team = Team::create(server, "Honest");
        let submission = team.submit(server, &hold());
        assert_eq!(submission["state"], "valid", "{submission:#}");
        Self { team, submission }
    }

    /// Starts the day, on which nobody else has anything to play.
    fn play(&self, server: &Server) -> String {
        self.team.evaluate(server, &self.submission)
    }

    fn assert_undisturbed(&self, server: &Server, evaluation: &str, scratch: &Path) {
        assert_undisturbed(server, &self.team, evaluation, &hold(), scratch);
    }
}

/// How a client makes an upload last.
#[derive(Debug, Clone, Copy)]
enum Dribble {
    /// A byte now and then.
    ByteByByte,
    /// The head, and then nothing.
    NothingAfterTheHead,
    /// Steadily, but below the least rate.
    Steadily,
}

/// An upload of a megabyte that never comes to its end.
struct Slow {
    stream: TcpStream,
    dribble: Dribble,
}

impl Slow {
    fn begin(server: &Server, token: &str, dribble: Dribble) -> Self {
        let mut stream = TcpStream::connect(server.address()).expect("the server listens");
        let head = format!(
            "POST /api/v1/submissions HTTP/1.1\r\nhost: x\r\nauthorization: Bearer {token}\r\n\
             content-length: {MIB}\r\n\r\n"
        );
        stream.write_all(head.as_bytes()).expect("it is taken");
        if !matches!(dribble, Dribble::NothingAfterTheHead) {
            stream.write_all(&GZIP).expect("it is taken");
        }
        Self { stream, dribble }
    }

    /// Goes on until the server has had enough, and returns its answer.
    fn go_on(mut self) -> String {
        let (piece, pause) = match self.dribble {
            Dribble::ByteByByte => (vec![0; 1], Duration::from_millis(700)),
            Dribble::NothingAfterTheHead => (Vec::new(), Duration::from_secs(1)),
            Dribble::Steadily => (vec![0; 2000], Duration::from_millis(200)),
        };
        let mut answer = Vec::new();
        let mut buffer = [0; 4096];
        self.stream
            .set_read_timeout(Some(pause))
            .expect("a pause is no zero");
        loop {
            match self.stream.read(&mut buffer) {
                Ok(0) => break,
                Ok(read) => answer.extend_from_slice(&buffer[..read]),
                Err(error)
                    if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) =>
                {
                    // After its answer the server takes no more.
                    let _ = self.stream.write_all(&piece);
                }
                Err(_) => break,
            }
        }
        String::from_utf8(answer).expect("an answer is text")
    }
}

#[test]
fn slow_uploads_take_nobodys_place_and_end() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let data_dir = scratch.path().join("data");
    let config =
        format!("{CONFIG}\n[uploads]\nat_once = 2\nleast_bytes_per_s = 65536\ngrace_s = 10.0\n");
    let server = Server::start(&data_dir, &config);
    let honest = Honest::enter(&server);

    // More than the sixteen that once were all places: of one team, and of many.
    let variants = [
        Dribble::ByteByByte,
        Dribble::NothingAfterTheHead,
        Dribble::Steadily,
    ];
    let slow_teams: Vec<_> = (0..9)
        .map(|number| Team::create(&server, &format!("Slow {number}")))
        .collect();
    let mut slow = Vec::new();
    for (number, team) in slow_teams.iter().enumerate() {
        for place in 0..2 {
            let dribble = variants[(number + place) % variants.len()];
            slow.push(Slow::begin(&server, &team.token, dribble));
        }
    }
    let under_way: Vec<_> = slow
        .into_iter()
        .map(|slow| thread::spawn(move || slow.go_on()))
        .collect();
    let evaluation = honest.play(&server);

    // Everybody else's go on, a slow team's other ones do not. (By now, on a slow host, its places may be free
    // again.)
    let id = honest.team.upload(&server, packed(&hold()));
    let verdict = honest.team.verdict(&server, &id);
    assert_eq!(verdict["state"], "valid", "{verdict:#}");
    let third = server.upload(&slow_teams[0].token, packed(&hold()));
    if third.status() != 201 {
        assert_eq!(third.status(), 429);
        assert!(third.headers().contains_key("retry-after"));
        let problem: Value = third.json().expect("a problem is JSON");
        assert_eq!(problem["type"], "/problems#too-many-uploads", "{problem:#}");
    }

    for ended in under_way {
        let answer = ended.join().expect("a client does not panic");
        assert!(answer.starts_with("HTTP/1.1 408 "), "{answer}");
        assert!(
            answer.contains("least rate of 65536 bytes per second"),
            "{answer}"
        );
    }
    wait_until("what came of them is removed", || {
        files(&data_dir.join("uploads")) == 0
    });
    for team in &slow_teams[1..] {
        let own = server.get("/api/v1/submissions", Some(&team.token));
        assert_eq!(own.json::<Value>().expect("a list"), json!([]));
    }
    honest.assert_undisturbed(&server, &evaluation, scratch.path());
}

/// A tar archive of one kind of entry.
struct Tar(Vec<u8>);

impl Tar {
    fn new() -> Self {
        let manifest = b"name = \"long\"\ncommand = [\"python3\"]\nruntime = \"python3\"\n";
        Self(Vec::new()).entry(EntryType::Regular, "agent.toml", manifest)
    }

    fn entry(mut self, kind: EntryType, name: &str, content: &[u8]) -> Self {
        let mut header = Header::new_gnu();
        let place = &mut header.as_gnu_mut().expect("it is GNU's").name;
        place[..name.len()].copy_from_slice(name.as_bytes());
        header.set_entry_type(kind);
        header.set_mode(0o644);
        header.set_size(content.len() as u64);
        header.set_cksum();
        self.0.extend_from_slice(header.as_bytes());
        self.0.extend_from_slice(content);
        self.0.resize(self.0.len().next_multiple_of(512), 0);
        self
    }

    fn gz(mut self) -> Vec<u8> {
        self.0.extend_from_slice(&[0; 1024]);
        let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
        encoder.write_all(&self.0).expect("memory takes it");
        encoder.finish().expect("memory takes it")
    }
}

/// An extension header's worth of a comment.
fn pax_comment() -> Vec<u8> {
    let length = MIB - 8;
    let mut record = format!("{length} comment=").into_bytes();
    record.resize(length - 1, b'x');
    record.push(b'\n');
    record
}

/// A zip whose directory says more entries than it has room for files.
fn many_entries(entries: u32) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default();
    for entry in 0..entries {
        zip.add_directory(format!("f{entry}"), options)
            .expect("memory takes it");
    }
    zip.finish().expect("memory takes it").into_inner()
}

#[test]
fn archives_without_an_end_are_refused_soon() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let data_dir = scratch.path().join("data");
    let config = format!("{CONFIG}\n[bundle]\nfiles = 1000\n");
    let server = Server::start(&data_dir, &config);
    let honest = Honest::enter(&server);
    let team = Team::create(&server, "Endless");
    let evaluation = honest.play(&server);
    let long = |kind, content: &[u8]| {
        let tar = (0..350).fold(Tar::new(), |tar, _| tar.entry(kind, "long", content));
        tar.gz()
    };
    let empty = GzEncoder::new(Vec::new(), Compression::fast());
    let mut members = empty.finish().expect("memory takes it").repeat(70_000);
    members.extend(Tar::new().gz());
    let too_much = "more than its files explain";
    let archives = [
        (long(EntryType::XHeader, &pax_comment()), too_much),
        (long(EntryType::GNULongName, &vec![b'n'; MIB]), too_much),
        (
            Tar::new()
                .entry(EntryType::Directory, "d", &vec![0; 350 * MIB])
                .gz(),
            too_much,
        ),
        (members, "compressed streams"),
        (
            Tar::new().entry(EntryType::GNUSparse, "s", b"").gz(),
            "sparse",
        ),
        (many_entries(3000), "more than 1000 folders"),
    ];
    for (archive, reason) in archives {
        assert!(archive.len() < 2 * MIB, "{} bytes", archive.len());
        let id = team.upload(&server, archive);
        let verdict = team.verdict(&server, &id);
        assert_eq!(verdict["state"], "invalid", "{verdict:#}");
        let told = verdict["reason"].as_str().expect("a refusal has a reason");
        assert!(told.contains(reason), "{told}");
    }
    let folder = data_dir.join("artifacts/bundles");
    wait_until("only the honest team's bundle is kept", || {
        files(&folder) == 1
    });
    honest.assert_undisturbed(&server, &evaluation, scratch.path());
}

#[test]
fn what_is_refused_is_not_kept() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let data_dir = scratch.path().join("data");
    let server = Server::start(&data_dir, CONFIG);
    let honest = Honest::enter(&server);
    let team = Team::create(&server, "Refused");
    let evaluation = honest.play(&server);
    let bundle =
        |name: &str, on_step: &str| python_bundle(scratch.path(), name, &python_agent(on_step));
    let wrong = bundle("wrong", "say(hold)");
    fs::write(wrong.join("agent.toml"), "name = 3\n").expect("a scratch file can be written");
    let falls = bundle("falls", "sys.stderr.write('I fall\\n')\nsys.exit(9)");
    let no_tar = {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(&[7; 5000]).expect("memory takes it");
        encoder.finish().expect("memory takes it")
    };
    let kept = data_dir.join("artifacts/bundles");
    let mut refused = Vec::new();
    for (archive, reason, log) in [
        (packed(&wrong), "agent.toml", ""),
        (no_tar, "damaged", ""),
        (packed(&falls), "status 9", "I fall"),
    ] {
        let id = team.upload(&server, archive);
        let verdict = team.verdict(&server, &id);
        assert_eq!(verdict["state"], "invalid", "{verdict:#}");
        for (part, field) in [(reason, "reason"), (log, "log")] {
            let told = verdict[field].as_str().expect("it is told");
            assert!(told.contains(part), "{verdict:#}");
        }
        wait_until("the archive is removed", || files(&kept) == 1);
        refused.push((id, verdict));
    }
    // What is no archive at all, and what breaks off, in the middle or before its first byte.
    assert_eq!(
        server.upload(&team.token, b"#!/bin/sh".to_vec()).status(),
        415
    );
    for dribble in [Dribble::Steadily, Dribble::NothingAfterTheHead] {
        let broken = Slow::begin(&server, &team.token, dribble);
        wait_until("it has begun", || files(&data_dir.join("uploads")) == 1);
        drop(broken);
        wait_until("it has left nothing", || {
            files(&data_dir.join("uploads")) == 0
        });
    }
    assert_eq!(files(&kept), 1);
    honest.assert_undisturbed(&server, &evaluation, scratch.path());
    server.kill();

    // What an older version kept, or a kill between two steps has left, goes at the next start: the refused
    // team's, as it were, and one that no submission ever named.
    let owner = fs::read_dir(&kept)
        .expect("there are bundles")
        .map(|entry| entry.expect("a folder can be read").path())
        .find(|folder| files(folder) == 1)
        .expect("the honest team's folder");
    let left = owner.join("0190-of-nobody.tar.gz");
    let file = fs::File::create(&left).expect("a scratch file can be written");
    let long_ago = SystemTime::now() - Duration::from_secs(7 * 24 * 3600);
    file.set_modified(long_ago).expect("a file has a time");
    let server = Server::start(&data_dir, CONFIG);
    wait_until("what is left is removed", || !left.exists());
    assert_eq!(files(&kept), 1);
    for (id, mut verdict) in refused {
        let path = format!("/api/v1/submissions/{id}");
        let mut told: Value = server
            .get(&path, Some(&team.token))
            .json()
            .expect("the API speaks JSON");
        // Its archive may have gone after the verdict was read, or before.
        for view in [&mut told, &mut verdict] {
            let fields = view.as_object_mut().expect("a submission is an object");
            fields.remove("archive_removed");
        }
        assert_eq!(told, verdict, "its reason and log stay");
    }
}

#[test]
fn a_teams_quota_is_told_in_numbers_and_is_its_own() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let bundle = packed(&hold());
    let size = bundle.len();
    let config = format!(
        "{CONFIG}\n[uploads]\nday_bytes = {}\nstored_bytes = {}\n",
        5 * size,
        2 * size + size / 2
    );
    let server = Server::start(&scratch.path().join("data"), &config);
    let (greedy, other) = (
        Team::create(&server, "Greedy"),
        Team::create(&server, "Other"),
    );
    for _ in 0..2 {
        let id = greedy.upload(&server, bundle.clone());
        let verdict = greedy.verdict(&server, &id);
        assert_eq!(verdict["state"], "valid", "{verdict:#}");
    }
    let refused = |answer: reqwest::blocking::Response, status: u16, kind: &str, limit: usize| {
        assert_eq!(answer.status(), status);
        let problem: Value = answer.json().expect("a problem is JSON");
        assert_eq!(problem["type"], format!("/problems#{kind}"), "{problem:#}");
        assert_eq!(problem["limit_bytes"], limit, "{problem:#}");
        let detail = problem["detail"].as_str().expect("it is told");
        assert!(detail.contains(&limit.to_string()), "{detail}");
    };
    let full = server.upload(&greedy.token, bundle.clone());
    refused(full, 409, "stored-quota-spent", 2 * size + size / 2);
    // The same without an announced length.
    let unannounced = server
        .request(Method::POST, "/api/v1/submissions", &greedy.token)
        .header("content-type", "application/octet-stream")
        .body(reqwest::blocking::Body::new(std::io::Cursor::new(
            bundle.clone(),
        )))
        .send()
        .expect("the server answers");
    refused(unannounced, 409, "stored-quota-spent", 2 * size + size / 2);

    // What is refused is not stored, but it came.
    let mut bad = bundle.clone();
    bad.truncate(size / 2);
    for _ in 0..3 {
        let id = other.upload(&server, bad.clone());
        let verdict = other.verdict(&server, &id);
        assert_eq!(verdict["state"], "invalid", "{verdict:#}");
    }
    for _ in 0..2 {
        let id = other.upload(&server, bundle.clone());
        let verdict = other.verdict(&server, &id);
        assert_eq!(verdict["state"], "valid", "{verdict:#}");
    }
}
