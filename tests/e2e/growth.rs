//! What strangers read must not make the server's files grow.

use faceoff_tests::server::{PATIENCE, Server};
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

/// The bound that the server keeps, and what may come on top while it is at it.
pub(crate) const BOUND_BYTES: u64 = (16 + 4) << 20;

/// So many writes are more than twice the bound: each is some 20 KB of log.
const TEAMS: u32 = 2000;

const CONFIG: &str = concat!(
    include_str!("../patient.toml"),
    "[workers]\nslots = 1\n[season]\nname = \"Growth\"\n"
);

/// The log's size now.
fn log_bytes(data_dir: &Path) -> u64 {
    fs::metadata(data_dir.join("faceoff.sqlite3-wal")).map_or(0, |file| file.len())
}

/// Writes: a team, and the event that tells of it.
fn create_team(server: &Server, number: u32) {
    let new = json!({ "name": format!("Team {number}") });
    loop {
        let answer = server.post("/api/v1/teams", &server.admin_token, &new);
        // On a busy machine the server may lose its patience, and says so: a client tries again.
        match answer.status().as_u16() {
            503 => thread::sleep(Duration::from_millis(200)),
            status => {
                let text = answer.text().unwrap_or_default();
                return assert_eq!(status, 201, "{text}");
            }
        }
    }
}

/// Ends the readers, also when the test fails.
struct Over<'a>(&'a AtomicBool);

impl Drop for Over<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

#[test]
fn readers_that_never_pause_do_not_let_the_log_grow() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let data_dir = scratch.path().join("data");
    let server = Server::start(&data_dir, CONFIG);
    let over = AtomicBool::new(false);
    let longest = thread::scope(|scope| {
        let _over = Over(&over);
        for path in ["/", "/season", "/api/v1/evaluations", "/api/v1/board"] {
            let (server, over) = (&server, &over);
            scope.spawn(move || {
                while !over.load(Ordering::Relaxed) {
                    let answer = server.get(path, Some(&server.admin_token));
                    assert_eq!(answer.status(), 200, "{path}");
                }
            });
        }
        let after_each = (0..TEAMS).map(|number| {
            create_team(&server, number);
            log_bytes(&data_dir)
        });
        after_each.max()
    });
    let longest = longest.expect("there are teams");
    assert!(longest < BOUND_BYTES, "{longest} bytes");
}

/// Reads the database in one long transaction, until its standard input ends.
const LONG_READER: &str = r#"import sqlite3, sys
database = sqlite3.connect(f"file:{sys.argv[1]}?mode=ro", uri=True, isolation_level=None)
database.execute("BEGIN")
database.execute("SELECT COUNT(*) FROM events").fetchall()
print("reading", flush=True)
sys.stdin.read()
"#;

#[test]
fn a_backup_that_takes_long_holds_up_nobody_and_the_log_is_short_after_it() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let data_dir = scratch.path().join("data");
    let server = Server::start(&data_dir, CONFIG);
    create_team(&server, u32::MAX);
    let mut reader = Command::new("python3")
        .args(["-c", LONG_READER])
        .arg(data_dir.join("faceoff.sqlite3"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("there is a Python for agents");
    let mut told = String::new();
    let stdout = reader.stdout.take().expect("it is piped");
    BufReader::new(stdout)
        .read_line(&mut told)
        .expect("a pipe can be read");
    assert_eq!(told.trim(), "reading");

    let mut number = 0;
    while log_bytes(&data_dir) <= BOUND_BYTES {
        create_team(&server, number);
        number += 1;
        assert!(number < 20 * TEAMS, "the reader holds the log");
    }
    assert_eq!(
        server.log().matches("log cannot be emptied").count(),
        1,
        "told once: {}",
        server.log()
    );
    drop(reader.stdin.take());
    assert!(reader.wait().expect("a child can be reaped").success());

    let started = Instant::now();
    while log_bytes(&data_dir) > BOUND_BYTES {
        assert!(
            started.elapsed() < PATIENCE,
            "{} bytes",
            log_bytes(&data_dir)
        );
        create_team(&server, number);
        number += 1;
    }
    server.wait_for_log("log is emptied", 1);
}
