//! The size of the database's write-ahead log (WAL) stays bounded, whatever clients read. SQLite appends each write to this file
//! and can empty it only while no transaction reads from it.

use faceoff_tests::server::{Server, TIMEOUT};
use serde_json::json;
use std::{
    fs,
    io::{BufRead as _, BufReader},
    path::Path,
    process::{Command, Stdio},
    sync::atomic::{AtomicBool, Ordering},
    thread,
    time::{Duration, Instant},
};

/// The server's limit of 16 MiB for the WAL, plus 4 MiB that may be written while the server empties the WAL.
pub(crate) const WAL_LIMIT_BYTES: u64 = (16 + 4) << 20;

/// Number of writes whose total exceeds the limit: each adds about 70 KB to the WAL.
const WRITES: u32 = 350;

const CONFIG: &str = concat!(
    include_str!("../long_time_limits.toml"),
    "[workers]\nslots = 1\n[season]\nname = \"Growth\"\n"
);

fn wal_bytes(data_dir: &Path) -> u64 {
    fs::metadata(data_dir.join("faceoff.sqlite3-wal")).map_or(0, |file| file.len())
}

/// One write: new terms of the season, almost as long as the limit of 20,000 characters allows. Each character has three bytes.
fn publish_terms(server: &Server, version: u32) {
    let terms = json!({ "text": format!("{version}{}", "\u{2460}".repeat(19_990)) });
    loop {
        let answer = server.post("/api/v1/terms", &server.admin_token, &terms);
        // On a busy machine the server may time out with 503; a client tries again.
        match answer.status().as_u16() {
            503 => thread::sleep(Duration::from_millis(200)),
            status => {
                let text = answer.text().unwrap_or_default();
                return assert_eq!(status, 201, "{text}");
            }
        }
    }
}

/// Tells the reading threads to stop, even if the test fails.
struct StopGuard<'a>(&'a AtomicBool);

impl Drop for StopGuard<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

#[test]
fn wal_stays_bounded_under_continuous_reads() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let data_dir = scratch.path().join("data");
    let server = Server::start(&data_dir, CONFIG);
    let stop = AtomicBool::new(false);
    let max_wal_bytes = thread::scope(|scope| {
        let _guard = StopGuard(&stop);
        for path in ["/", "/season", "/api/v1/evaluations", "/api/v1/board"] {
            let (server, stop) = (&server, &stop);
            scope.spawn(move || {
                while !stop.load(Ordering::Relaxed) {
                    let answer = server.get(path, Some(&server.admin_token));
                    assert_eq!(answer.status(), 200, "{path}");
                }
            });
        }
        let sizes_after_writes = (0..WRITES).map(|version| {
            publish_terms(&server, version);
            wal_bytes(&data_dir)
        });
        sizes_after_writes.max()
    });
    let max_wal_bytes = max_wal_bytes.expect("there are writes");
    assert!(max_wal_bytes < WAL_LIMIT_BYTES, "{max_wal_bytes} bytes");
}

/// A Python program that reads the database in one transaction, which lasts until its standard input ends.
const LONG_READER: &str = r#"import sqlite3, sys
database = sqlite3.connect(f"file:{sys.argv[1]}?mode=ro", uri=True, isolation_level=None)
database.execute("BEGIN")
database.execute("SELECT COUNT(*) FROM events").fetchall()
print("reading", flush=True)
sys.stdin.read()
"#;

#[test]
fn long_read_delays_no_write_and_wal_shrinks_afterwards() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let data_dir = scratch.path().join("data");
    let server = Server::start(&data_dir, CONFIG);
    publish_terms(&server, 0);
    let mut reader = Command::new("python3")
        .args(["-c", LONG_READER])
        .arg(data_dir.join("faceoff.sqlite3"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("Python is installed, as agents need it");
    let mut line = String::new();
    let stdout = reader.stdout.take().expect("it is piped");
    BufReader::new(stdout)
        .read_line(&mut line)
        .expect("a pipe can be read");
    assert_eq!(line.trim(), "reading");

    let mut writes = 1;
    while wal_bytes(&data_dir) <= WAL_LIMIT_BYTES {
        publish_terms(&server, writes);
        writes += 1;
        assert!(writes < 20 * WRITES, "the WAL grows while the reader runs");
    }
    assert_eq!(
        server.log().matches("log cannot be emptied").count(),
        1,
        "the server logs it once: {}",
        server.log()
    );
    drop(reader.stdin.take());
    assert!(reader.wait().expect("a child can be reaped").success());

    let started = Instant::now();
    while wal_bytes(&data_dir) > WAL_LIMIT_BYTES {
        assert!(
            started.elapsed() < TIMEOUT,
            "{} bytes",
            wal_bytes(&data_dir)
        );
        publish_terms(&server, writes);
        writes += 1;
    }
    server.wait_for_log("log is emptied", 1);
}
