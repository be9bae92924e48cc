//! Uploads that could take upload slots, disk space or time from other teams: slow, refused and oversized ones. Meanwhile the
//! evaluation of another team, the honest team, gets its undisturbed result. A *bundle* is the archive with a team's agent.

use crate::{
    Team, commands,
    reference_result::{CONFIG, assert_undisturbed},
};
use faceoff_tests::{
    bundle::{pack, python_agent, python_bundle},
    relay::{ConnectionBreaks, Relay},
    repository,
    server::{Server, TIMEOUT},
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
/// The first bytes of a gzip archive.
const GZIP_START: [u8; 4] = [0x1f, 0x8b, 8, 0];

/// The folder of an agent that holds still.
fn hold_folder() -> PathBuf {
    repository().join("agents/hold")
}

/// Waits for a condition; the pause between checks keeps the CPU for the evaluation.
fn wait_until(condition: &str, mut is_met: impl FnMut() -> bool) {
    let started = Instant::now();
    while !is_met() {
        assert!(started.elapsed() < TIMEOUT, "still waiting: {condition}");
        thread::sleep(Duration::from_millis(20));
    }
}

/// The number of files below a folder.
fn count_files(folder: &Path) -> usize {
    let Ok(entries) = fs::read_dir(folder) else {
        return 0;
    };
    entries
        .map(|entry| {
            let path = entry.expect("a folder can be read").path();
            if path.is_dir() { count_files(&path) } else { 1 }
        })
        .sum()
}

/// A team whose evaluation must not be disturbed.
struct HonestTeam {
    team: Team,
    submission: Value,
}

impl HonestTeam {
    fn create(server: &Server) -> Self {
        let team = Team::create(server, "Honest");
        let submission = team.submit(server, &hold_folder());
        assert_eq!(submission["state"], "valid", "{submission:#}");
        Self { team, submission }
    }

    /// Starts the day, on which no other team has an active submission.
    fn start_evaluation(&self, server: &Server) -> String {
        self.team.evaluate(server, &self.submission)
    }

    fn assert_undisturbed(&self, server: &Server, evaluation: &str, scratch: &Path) {
        assert_undisturbed(server, &self.team, evaluation, &hold_folder(), scratch);
    }
}

/// How a client slows its upload down.
#[derive(Debug, Clone, Copy)]
enum Slowness {
    /// Single bytes with pauses.
    ByteByByte,
    /// The header of the request, and then nothing.
    NothingAfterHeader,
    /// Continuously, but below the minimum rate.
    BelowMinRate,
}

/// An upload of a megabyte that never ends.
struct SlowUpload {
    stream: TcpStream,
    slowness: Slowness,
}

impl SlowUpload {
    fn begin(server: &Server, token: &str, slowness: Slowness) -> Self {
        let mut stream = TcpStream::connect(server.address()).expect("the server listens");
        let head = format!(
            "POST /api/v1/submissions HTTP/1.1\r\nhost: x\r\nauthorization: Bearer {token}\r\n\
             content-length: {MIB}\r\n\r\n"
        );
        stream
            .write_all(head.as_bytes())
            .expect("the server reads it");
        if !matches!(slowness, Slowness::NothingAfterHeader) {
            stream.write_all(&GZIP_START).expect("the server reads it");
        }
        Self { stream, slowness }
    }

    /// Continues until the server closes the connection; returns its response.
    fn run(mut self) -> String {
        let (chunk, pause) = match self.slowness {
            Slowness::ByteByByte => (vec![0; 1], Duration::from_millis(700)),
            Slowness::NothingAfterHeader => (Vec::new(), Duration::from_secs(1)),
            Slowness::BelowMinRate => (vec![0; 2000], Duration::from_millis(200)),
        };
        let mut answer = Vec::new();
        let mut buffer = [0; 4096];
        self.stream
            .set_read_timeout(Some(pause))
            .expect("the pause is not zero");
        loop {
            match self.stream.read(&mut buffer) {
                Ok(0) => break,
                Ok(read) => answer.extend_from_slice(&buffer[..read]),
                Err(error)
                    if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) =>
                {
                    // After its response the server reads no more.
                    let _ = self.stream.write_all(&chunk);
                }
                Err(_) => break,
            }
        }
        String::from_utf8(answer).expect("an answer is text")
    }
}

#[test]
fn slow_uploads_time_out_without_blocking_other_teams() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let data_dir = scratch.path().join("data");
    let config =
        format!("{CONFIG}\n[uploads]\nat_once = 2\nleast_bytes_per_s = 65536\ngrace_s = 10.0\n");
    let server = Server::start(&data_dir, &config);
    let honest = HonestTeam::create(&server);

    // Eighteen uploads, two per team. An earlier version had a limit of sixteen uploads of all teams together.
    let variants = [
        Slowness::ByteByByte,
        Slowness::NothingAfterHeader,
        Slowness::BelowMinRate,
    ];
    let slow_teams: Vec<_> = (0..9)
        .map(|number| Team::create(&server, &format!("Slow {number}")))
        .collect();
    let mut slow_uploads = Vec::new();
    for (number, team) in slow_teams.iter().enumerate() {
        for upload in 0..2 {
            let slowness = variants[(number + upload) % variants.len()];
            slow_uploads.push(SlowUpload::begin(&server, &team.token, slowness));
        }
    }
    let upload_threads: Vec<_> = slow_uploads
        .into_iter()
        .map(|upload| thread::spawn(move || upload.run()))
        .collect();
    let evaluation = honest.start_evaluation(&server);

    // Other teams can upload; a slow team cannot. On a slow host, its upload slots may be free again by now.
    let id = honest.team.upload(&server, pack(&hold_folder()));
    let verdict = honest.team.verdict(&server, &id);
    assert_eq!(verdict["state"], "valid", "{verdict:#}");
    let third_upload = server.upload(&slow_teams[0].token, pack(&hold_folder()));
    if third_upload.status() != 201 {
        assert_eq!(third_upload.status(), 429);
        assert!(third_upload.headers().contains_key("retry-after"));
        let problem: Value = third_upload.json().expect("a problem is JSON");
        assert_eq!(problem["type"], "/problems#too-many-uploads", "{problem:#}");
    }

    for thread in upload_threads {
        let answer = thread.join().expect("a client does not panic");
        assert!(answer.starts_with("HTTP/1.1 408 "), "{answer}");
        assert!(
            answer.contains("minimum rate of 65536 bytes per second"),
            "{answer}"
        );
    }
    wait_until("the partial files are removed", || {
        count_files(&data_dir.join("uploads")) == 0
    });
    for team in &slow_teams[1..] {
        let own = server.get("/api/v1/submissions", Some(&team.token));
        assert_eq!(own.json::<Value>().expect("a list"), json!([]));
    }
    honest.assert_undisturbed(&server, &evaluation, scratch.path());
}

/// The bytes of a tar archive.
struct Tar(Vec<u8>);

impl Tar {
    /// An archive with the manifest of a bundle.
    fn new() -> Self {
        let manifest = b"name = \"long\"\ncommand = [\"python3\"]\nruntime = \"python3\"\n";
        Self(Vec::new()).entry(EntryType::Regular, "agent.toml", manifest)
    }

    /// Appends an entry, even one whose kind must not have content.
    fn entry(mut self, kind: EntryType, name: &str, content: &[u8]) -> Self {
        let mut header = Header::new_gnu();
        let field = &mut header.as_gnu_mut().expect("a GNU header").name;
        field[..name.len()].copy_from_slice(name.as_bytes());
        header.set_entry_type(kind);
        header.set_mode(0o644);
        header.set_size(content.len() as u64);
        header.set_cksum();
        self.0.extend_from_slice(header.as_bytes());
        self.0.extend_from_slice(content);
        self.0.resize(self.0.len().next_multiple_of(512), 0);
        self
    }

    /// Ends the archive and compresses it.
    fn compress(mut self) -> Vec<u8> {
        self.0.extend_from_slice(&[0; 1024]);
        let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
        encoder
            .write_all(&self.0)
            .expect("writing to memory does not fail");
        encoder.finish().expect("writing to memory does not fail")
    }
}

/// A pax header (metadata of a tar entry) with a comment of almost a MiB.
fn pax_comment() -> Vec<u8> {
    let length = MIB - 8;
    let mut record = format!("{length} comment=").into_bytes();
    record.resize(length - 1, b'x');
    record.push(b'\n');
    record
}

/// A zip with this many folders.
fn many_folders(folders: u32) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default();
    for folder in 0..folders {
        zip.add_directory(format!("f{folder}"), options)
            .expect("writing to memory does not fail");
    }
    zip.finish()
        .expect("writing to memory does not fail")
        .into_inner()
}

#[test]
fn oversized_archive_structures_are_refused() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let data_dir = scratch.path().join("data");
    let config = format!("{CONFIG}\n[bundle]\nfiles = 1000\n");
    let server = Server::start(&data_dir, &config);
    let honest = HonestTeam::create(&server);
    let team = Team::create(&server, "Endless");
    let evaluation = honest.start_evaluation(&server);
    // Each archive compresses to less than 2 MiB. It has up to 350 MiB that belong to no file, such as headers, or a structure that is
    // refused, such as thousands of folders.
    let repeated_entries = |kind, content: &[u8]| {
        let tar = (0..350).fold(Tar::new(), |tar, _| tar.entry(kind, "long", content));
        tar.compress()
    };
    let empty_stream = GzEncoder::new(Vec::new(), Compression::fast());
    let mut many_streams = empty_stream
        .finish()
        .expect("writing to memory does not fail")
        .repeat(70_000);
    many_streams.extend(Tar::new().compress());
    let too_much_overhead = "more bytes than its files explain";
    let archives = [
        (
            repeated_entries(EntryType::XHeader, &pax_comment()),
            too_much_overhead,
        ),
        (
            repeated_entries(EntryType::GNULongName, &vec![b'n'; MIB]),
            too_much_overhead,
        ),
        (
            Tar::new()
                .entry(EntryType::Directory, "d", &vec![0; 350 * MIB])
                .compress(),
            too_much_overhead,
        ),
        (many_streams, "compressed streams"),
        (
            Tar::new().entry(EntryType::GNUSparse, "s", b"").compress(),
            "sparse",
        ),
        (many_folders(3000), "more than 1000 folders"),
    ];
    for (archive, reason) in archives {
        assert!(archive.len() < 2 * MIB, "{} bytes", archive.len());
        let id = team.upload(&server, archive);
        let verdict = team.verdict(&server, &id);
        assert_eq!(verdict["state"], "invalid", "{verdict:#}");
        let text = verdict["reason"].as_str().expect("a refusal has a reason");
        assert!(text.contains(reason), "{text}");
    }
    let folder = data_dir.join("artifacts/bundles");
    wait_until("only the honest team's bundle is kept", || {
        count_files(&folder) == 1
    });
    honest.assert_undisturbed(&server, &evaluation, scratch.path());
}

#[test]
fn refused_uploads_are_removed_from_disk() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let data_dir = scratch.path().join("data");
    let server = Server::start(&data_dir, CONFIG);
    let honest = HonestTeam::create(&server);
    let team = Team::create(&server, "Refused");
    let evaluation = honest.start_evaluation(&server);
    let bundle =
        |name: &str, on_step: &str| python_bundle(scratch.path(), name, &python_agent(on_step));
    let invalid_manifest = bundle("invalid-manifest", "say(hold)");
    fs::write(invalid_manifest.join("agent.toml"), "name = 3\n")
        .expect("a scratch file can be written");
    let crashing = bundle("crashing", "sys.stderr.write('I crash\\n')\nsys.exit(9)");
    let no_tar = {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder
            .write_all(&[7; 5000])
            .expect("writing to memory does not fail");
        encoder.finish().expect("writing to memory does not fail")
    };
    let bundles = data_dir.join("artifacts/bundles");
    let mut refused_submissions = Vec::new();
    for (archive, reason, log) in [
        (pack(&invalid_manifest), "agent.toml", ""),
        (no_tar, "damaged", ""),
        (pack(&crashing), "status 9", "I crash"),
    ] {
        let id = team.upload(&server, archive);
        let verdict = team.verdict(&server, &id);
        assert_eq!(verdict["state"], "invalid", "{verdict:#}");
        for (part, field) in [(reason, "reason"), (log, "log")] {
            let text = verdict[field].as_str().expect("a refusal has this field");
            assert!(text.contains(part), "{verdict:#}");
        }
        wait_until("the archive is removed", || count_files(&bundles) == 1);
        refused_submissions.push((id, verdict));
    }
    // A body that is no archive, and uploads whose client disconnects, in the middle or before the first byte.
    assert_eq!(
        server.upload(&team.token, b"#!/bin/sh".to_vec()).status(),
        415
    );
    for slowness in [Slowness::BelowMinRate, Slowness::NothingAfterHeader] {
        let upload = SlowUpload::begin(&server, &team.token, slowness);
        wait_until("the upload has started", || {
            count_files(&data_dir.join("uploads")) == 1
        });
        drop(upload);
        wait_until("its partial file is removed", || {
            count_files(&data_dir.join("uploads")) == 0
        });
    }
    assert_eq!(count_files(&bundles), 1);
    honest.assert_undisturbed(&server, &evaluation, scratch.path());
    server.kill();

    // The next start removes bundles that an earlier version or a kill has left: here one that no submission names.
    let folder_of_honest_team = fs::read_dir(&bundles)
        .expect("there are bundles")
        .map(|entry| entry.expect("a folder can be read").path())
        .find(|folder| count_files(folder) == 1)
        .expect("the honest team's folder");
    let leftover = folder_of_honest_team.join("0190-unreferenced.tar.gz");
    let file = fs::File::create(&leftover).expect("a scratch file can be written");
    let long_ago = SystemTime::now() - Duration::from_secs(7 * 24 * 3600);
    file.set_modified(long_ago).expect("a file has a time");
    let server = Server::start(&data_dir, CONFIG);
    wait_until("the leftover file is removed", || !leftover.exists());
    assert_eq!(count_files(&bundles), 1);
    for (id, mut verdict) in refused_submissions {
        let path = format!("/api/v1/submissions/{id}");
        let mut current: Value = server
            .get(&path, Some(&team.token))
            .json()
            .expect("the API speaks JSON");
        // The bundle may have been removed before or after the verdict was read. Both fields report it; the second is deprecated.
        for view in [&mut current, &mut verdict] {
            let fields = view.as_object_mut().expect("a submission is an object");
            for name in ["bundle_removed", "archive_removed"] {
                fields.remove(name);
            }
        }
        assert_eq!(current, verdict, "the reason and the log stay");
    }
}

#[test]
fn upload_quota_is_per_team_and_reported_in_bytes() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let bundle = pack(&hold_folder());
    let bundle_bytes = bundle.len();
    // Five bundles a day, and two stored ones.
    let (day_bytes, stored_bytes) = (5 * bundle_bytes, 2 * bundle_bytes + bundle_bytes / 2);
    let config =
        format!("{CONFIG}\n[uploads]\nday_bytes = {day_bytes}\nstored_bytes = {stored_bytes}\n");
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
    let assert_refused =
        |answer: reqwest::blocking::Response, status: u16, kind: &str, limit: usize| {
            assert_eq!(answer.status(), status);
            let problem: Value = answer.json().expect("a problem is JSON");
            assert_eq!(problem["type"], format!("/problems#{kind}"), "{problem:#}");
            assert_eq!(problem["limit_bytes"], limit, "{problem:#}");
            let detail = problem["detail"].as_str().expect("a problem has a detail");
            assert!(detail.contains(&limit.to_string()), "{detail}");
        };
    let over_quota = server.upload(&greedy.token, bundle.clone());
    assert_refused(over_quota, 409, "stored-quota-spent", stored_bytes);
    // The same upload without Content-Length.
    let without_length = server
        .request(Method::POST, "/api/v1/submissions", &greedy.token)
        .header("content-type", "application/octet-stream")
        .body(reqwest::blocking::Body::new(std::io::Cursor::new(
            bundle.clone(),
        )))
        .send()
        .expect("the server answers");
    assert_refused(without_length, 409, "stored-quota-spent", stored_bytes);

    // Invalid bundles do not count as stored, but count for the day.
    let mut truncated = bundle.clone();
    truncated.truncate(bundle_bytes / 2);
    for _ in 0..3 {
        let id = other.upload(&server, truncated.clone());
        let verdict = other.verdict(&server, &id);
        assert_eq!(verdict["state"], "invalid", "{verdict:#}");
    }
    for _ in 0..2 {
        let id = other.upload(&server, bundle.clone());
        let verdict = other.verdict(&server, &id);
        assert_eq!(verdict["state"], "valid", "{verdict:#}");
    }
    // Of the day's five bundles, the invalid ones (three halves) and two valid ones leave less than two. The daily quota is
    // checked before that of stored bundles.
    let over_day = server.upload(&other.token, bundle.repeat(2));
    assert_refused(over_day, 429, "day-quota-spent", day_bytes);
}

/// Runs `faceoff submit` through a relay, which breaks connections.
fn submit_through(relay: &Relay, token: &str, bundle: &Path) -> commands::CommandOutput {
    let address = format!("http://{}", relay.address());
    let bundle = bundle.to_str().expect("a scratch path is text");
    let args = [
        "submit", "--server", &address, "--token", token, "--json", bundle,
    ];
    commands::faceoff(&args, "")
}

#[test]
fn submit_goes_on_after_broken_connections() {
    const BUNDLE_BYTES: usize = 2 << 20;
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let data_dir = scratch.path().join("data");
    let server = Server::start(&data_dir, CONFIG);
    let team = Team::create(&server, "Alpha");
    let agent = python_bundle(scratch.path(), "agent", &python_agent("say(hold)"));
    let mut noise = vec![0; BUNDLE_BYTES];
    let mut generator = blake3::Hasher::new().finalize_xof();
    generator.fill(&mut noise);
    fs::write(agent.join("weights"), noise).expect("a scratch file can be written");
    let relay = Relay::start();
    relay.set_target(server.address().into());
    relay.set_breaks(ConnectionBreaks {
        seed: 1,
        refused_percent: 10,
        max_bytes: 1 << 20,
    });
    let submission = submit_through(&relay, &team.token, &agent).json();
    assert_eq!(submission["state"], "valid", "{submission:#}");
    assert!(
        relay.broken_connections() >= 3,
        "the test breaks some connections"
    );
    let list: Value = server
        .get("/api/v1/submissions", Some(&team.token))
        .json()
        .expect("the API speaks JSON");
    assert_eq!(list.as_array().map(Vec::len), Some(1), "{list:#}");
    assert_eq!(list[0]["blake3"], submission["blake3"]);
    assert_eq!(count_files(&data_dir.join("uploads")), 0);
}
