//! A backup of a server that goes on, and a server that goes on from a backup.

use crate::{
    CONFIG, Team,
    commands::{FAILED, faceoff},
    upgrade::unpack,
};
use faceoff_tests::{bundle, program, repository, server::Server};
use serde_json::Value;
use std::{
    fs,
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

fn text(path: &Path) -> &str {
    path.to_str().expect("scratch paths are text")
}

/// All files below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder can be read") {
        let path = entry.expect("a folder can be read").path();
        match path.is_dir() {
            true => found.extend(files(&path)),
            false => found.push(path),
        }
    }
    found.sort();
    found
}

/// Backs up and says what was printed.
fn back_up(data: &Path, to: &Path) -> String {
    faceoff(&["backup", text(to), "--data-dir", text(data)], "").done()
}

fn board_row(server: &Server) -> Value {
    let board = server.poll("/api/v1/board", &server.admin_token, |_| true);
    board["rows"][0].clone()
}

#[test]
fn a_server_goes_on_from_a_backup_that_was_made_in_the_middle_of_an_evaluation() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let at = |name: &str| scratch.path().join(name);
    let server = Server::start(&at("data"), CONFIG);
    let team = Team::create(&server, "Phoenix");
    let submission = team.submit(&server, &bundle::reference("striker", scratch.path()));
    let evaluation = team.evaluate(&server, &submission);
    let _ = server.poll(&evaluation, &team.token, |answer| {
        answer["progress"]["episodes_done"].as_u64() >= Some(2)
    });
    let told = back_up(&at("data"), &at("backup"));
    assert!(told.contains("the database is whole"), "{told}");
    for path in files(&at("backup")) {
        let mode = path.metadata().expect("it is there").permissions().mode();
        assert_eq!(mode & 0o077, 0, "{}", path.display());
    }
    // The server went on, and knows more than the backup.
    let expected = team.finished(&server, &evaluation);
    let season = server.poll("/api/v1/season", &server.admin_token, |_| true);
    let row = board_row(&server);
    server.kill();
    fs::remove_dir_all(at("data")).expect("the disk is lost");

    let checked = faceoff(&["restore", text(&at("backup")), "--check"], "").done();
    assert!(checked.contains("is whole"), "{checked}");
    let restored = faceoff(
        &[
            "restore",
            text(&at("backup")),
            "--data",
            text(&at("restored")),
        ],
        "",
    )
    .done();
    assert!(restored.contains("faceoff serve --data-dir"), "{restored}");
    let mode = at("restored")
        .metadata()
        .expect("it is there")
        .permissions()
        .mode();
    assert_eq!(mode & 0o777, 0o700);
    let server = Server::start(&at("restored"), CONFIG);
    let finished = team.finished(&server, &evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    // By the same secret: the same episodes, whatever had been played by then.
    assert_eq!(
        finished["result"]["tasks"]["hit"]["successes"],
        expected["result"]["tasks"]["hit"]["successes"]
    );
    let again = server.poll("/api/v1/season", &server.admin_token, |_| true);
    assert_eq!(again["commitment"], season["commitment"]);
    for field in ["rank", "team", "evaluation"] {
        assert_eq!(board_row(&server)[field], row[field], "{row:#}");
    }
}

#[test]
fn a_second_server_on_a_data_folder_touches_nothing() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let data = scratch.path().join("data");
    let server = Server::start(&data, CONFIG);
    // What an upload under way would have there.
    let upload = data.join("uploads/under-way");
    fs::write(&upload, "half").expect("a scratch file");
    let config = scratch.path().join("faceoff.toml");
    fs::write(&config, CONFIG).expect("a scratch file");
    let serve = [
        "serve",
        "--listen",
        "127.0.0.1:0",
        "--config",
        text(&config),
        "--data-dir",
        text(&data),
    ];
    let holder = format!("in use by process {}", server.process_id());
    let refused = faceoff(&serve, "").failed(FAILED);
    assert!(refused.contains(&holder), "{refused}");
    assert_eq!(
        fs::read_to_string(&upload).expect("it is still there"),
        "half"
    );
    let back = scratch.path().join("backup");
    back_up(&data, &back);
    let restore = ["restore", text(&back), "--data", text(&data), "--replace"];
    faceoff(&restore, "").not_done(FAILED, &[&holder]);
    let health = server.get("/api/v1/health", None);
    assert_eq!(health.status(), 200, "the first one goes on");
}

#[test]
fn what_is_not_whole_is_neither_restored_nor_called_so() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let at = |name: &str| scratch.path().join(name);
    let server = Server::start(&at("data"), CONFIG);
    let team = Team::create(&server, "Alpha");
    let submission = team.submit(&server, &repository().join("agents/hold"));
    let evaluation = team.evaluate(&server, &submission);
    let _ = team.finished(&server, &evaluation);
    server.kill();
    back_up(&at("data"), &at("backup"));
    let backup = |args: &[&str]| faceoff(args, "");

    // Folders that hold something are left alone.
    backup(&[
        "backup",
        text(&at("backup")),
        "--data-dir",
        text(&at("data")),
    ])
    .not_done(FAILED, &["is not empty"]);
    backup(&["restore", text(&at("backup")), "--data", text(&at("data"))])
        .not_done(FAILED, &["is not empty", "--replace"]);
    backup(&[
        "backup",
        text(&at("new")),
        "--data-dir",
        text(&at("nowhere")),
    ])
    .not_done(FAILED, &["no data folder of a server"]);
    backup(&["restore", text(&at("data")), "--check"]).not_done(FAILED, &["no backup that"]);
    let inside = at("data").join("artifacts/backup");
    backup(&["backup", text(&inside), "--data-dir", text(&at("data"))])
        .not_done(FAILED, &["inside the data folder"]);
    // What is no data folder is never moved, and a link is not followed.
    let home = at("home");
    fs::create_dir(&home).expect("a scratch folder");
    fs::write(home.join("letter"), "Dear").expect("a scratch file");
    backup(&[
        "restore",
        text(&at("backup")),
        "--data",
        text(&home),
        "--replace",
    ])
    .not_done(FAILED, &["holds no faceoff.sqlite3"]);
    assert_eq!(files(&home), [home.join("letter")]);
    let link = at("link");
    fs::create_dir(at("empty")).expect("a scratch folder");
    std::os::unix::fs::symlink(at("empty"), &link).expect("a scratch link");
    backup(&["restore", text(&at("backup")), "--data", text(&link)])
        .not_done(FAILED, &["is a link"]);

    // In place of a folder: what was there, its log of the database too, is beside it.
    fs::write(at("data").join("faceoff.sqlite3-wal"), "stale").expect("a scratch file");
    let told = backup(&[
        "restore",
        text(&at("backup")),
        "--data",
        text(&at("data")),
        "--replace",
    ])
    .done();
    assert!(!at("data").join("faceoff.sqlite3-wal").exists(), "{told}");
    let aside = fs::read_dir(scratch.path())
        .expect("a folder can be read")
        .map(|entry| entry.expect("a folder can be read").path())
        .find(|path| text(path).contains("data.replaced-"))
        .unwrap_or_else(|| panic!("{told}"));
    assert_eq!(
        fs::read_to_string(aside.join("faceoff.sqlite3-wal")).expect("it is there"),
        "stale"
    );
    // Whoever followed the server before knows ids that the copy does not have; none of them is given again.
    let next = "SELECT seq > 100000000 FROM sqlite_sequence WHERE name = 'events'";
    let told = Command::new("sqlite3")
        .arg(at("data").join("faceoff.sqlite3"))
        .arg(next)
        .output()
        .expect("sqlite3 starts");
    assert_eq!(told.stdout, b"1\n");

    // A data folder that has lost a file: the backup is made, and says so.
    let lost = files(&at("data").join("artifacts/datasets")).remove(0);
    fs::remove_file(&lost).expect("a scratch file");
    let told =
        backup(&["backup", text(&at("poor")), "--data-dir", text(&at("data"))]).failed(FAILED);
    assert!(told.contains("missing: artifacts/datasets/"), "{told}");
    assert!(at("poor").join("backup.json").exists());
    let told = backup(&["restore", text(&at("poor")), "--check"]).failed(FAILED);
    assert!(told.contains("was made without 1 of what"), "{told}");

    // Files of a backup that are not what they were, one by one.
    let all = files(&at("backup"));
    assert!(all.len() >= 4, "{all:?}");
    for file in all.iter().filter(|file| !file.ends_with("backup.json")) {
        let whole = fs::read(file).expect("it is there");
        let mut damaged = whole.clone();
        let middle = damaged.len() / 2;
        match damaged.get_mut(middle) {
            Some(byte) => *byte ^= 1,
            None => damaged.push(1),
        }
        fs::write(file, &damaged).expect("a scratch file");
        backup(&["restore", text(&at("backup")), "--data", text(&at("never"))])
            .not_done(FAILED, &["is not what was backed up"]);
        backup(&["restore", text(&at("backup")), "--check"])
            .not_done(FAILED, &["is not what was backed up"]);
        fs::write(file, &whole).expect("a scratch file");
    }
    assert!(!at("never").exists() && !at("never.restoring").exists());
}

/// Runs SQL on a database that nobody has open.
fn sql(database: &Path, statements: &str) {
    let done = Command::new("sqlite3")
        .arg(database)
        .arg(statements)
        .stdin(Stdio::null())
        .status()
        .expect("sqlite3 starts");
    assert!(done.success(), "{statements}");
}

#[test]
fn a_database_of_a_later_version_is_refused_in_words() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (data, back) = (scratch.path().join("data"), scratch.path().join("backup"));
    Server::start(&data, CONFIG).kill();
    back_up(&data, &back);
    let later =
        "INSERT INTO _sqlx_migrations (version, description, success, checksum, execution_time)
                 VALUES (9999, 'later', 1, x'00', 0);
                 INSERT INTO programs (id, version, schema) VALUES (77, '7.8.9', 9999);";
    sql(&data.join("faceoff.sqlite3"), later);
    let words = [
        "a later version of Faceoff: 7.8.9 has its migration 9999",
        "restore a backup from before it",
    ];
    let serve = Command::new(program("faceoff"))
        .args([
            "serve",
            "--listen",
            "127.0.0.1:0",
            "--data-dir",
            text(&data),
        ])
        .output()
        .expect("the program starts");
    let told = String::from_utf8_lossy(&serve.stderr).into_owned();
    assert_eq!(serve.status.code(), Some(FAILED), "{told}");
    for words in words {
        assert!(told.contains(words), "{told}");
    }
    let to = scratch.path().join("of-later");
    faceoff(&["backup", text(&to), "--data-dir", text(&data)], "").not_done(FAILED, &words);
    assert!(!to.exists());
    // The one from before it is restored.
    faceoff(
        &["restore", text(&back), "--data", text(&data), "--replace"],
        "",
    )
    .done();
    drop(Server::start(&data, CONFIG));
}

#[test]
fn a_data_folder_of_the_first_release_is_backed_up_before_its_upgrade() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    unpack("data-folder-e67a08c.tar.gz", scratch.path());
    let (data, back) = (scratch.path().join("data"), scratch.path().join("backup"));
    // Delta's bundle was lost in its time: the backup has the rest, and says so.
    let told = faceoff(&["backup", text(&back), "--data-dir", text(&data)], "").failed(FAILED);
    assert_eq!(
        told.matches("missing: artifacts/bundles/").count(),
        1,
        "{told}"
    );
    assert!(told.contains("can be restored"), "{told}");
    let restored = scratch.path().join("restored");
    faceoff(&["restore", text(&back), "--data", text(&restored)], "").done();
    let server = Server::start(&restored, CONFIG);
    server.wait_for_log("the database is upgraded", 1);
    let upgraded = server.log();
    assert!(
        upgraded.contains("from=\"an earlier version\""),
        "{upgraded}"
    );
}
