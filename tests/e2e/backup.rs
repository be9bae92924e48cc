//! Backups of a running server, and servers that continue from a backup.

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

/// Makes a backup and returns the command's output.
fn back_up(data: &Path, to: &Path) -> String {
    faceoff(&["backup", text(to), "--data-dir", text(data)], "").expect_success()
}

fn board_row(server: &Server) -> Value {
    let board = server.poll("/api/v1/board", &server.admin_token, |_| true);
    board["rows"][0].clone()
}

#[test]
fn backup_during_evaluation_restores_running_evaluation() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let at = |name: &str| scratch.path().join(name);
    let server = Server::start(&at("data"), CONFIG);
    let team = Team::create(&server, "Phoenix");
    let submission = team.submit(&server, &bundle::reference("striker", scratch.path()));
    let evaluation = team.evaluate(&server, &submission);
    let _ = server.poll(&evaluation, &team.token, |answer| {
        answer["progress"]["episodes_done"].as_u64() >= Some(2)
    });
    let output = back_up(&at("data"), &at("backup"));
    assert!(output.contains("the database is intact"), "{output}");
    for path in files(&at("backup")) {
        let mode = path.metadata().expect("it is there").permissions().mode();
        assert_eq!(mode & 0o077, 0, "{}", path.display());
    }
    // The server continues and has more results than the backup.
    let expected = team.wait_until_finished(&server, &evaluation);
    let season = server.poll("/api/v1/season", &server.admin_token, |_| true);
    let row = board_row(&server);
    server.kill();
    fs::remove_dir_all(at("data")).expect("the disk is lost");

    let checked = faceoff(&["restore", text(&at("backup")), "--check"], "").expect_success();
    assert!(checked.contains("is intact"), "{checked}");
    let restored = faceoff(
        &[
            "restore",
            text(&at("backup")),
            "--data",
            text(&at("restored")),
        ],
        "",
    )
    .expect_success();
    assert!(restored.contains("faceoff serve --data-dir"), "{restored}");
    let mode = at("restored")
        .metadata()
        .expect("it is there")
        .permissions()
        .mode();
    assert_eq!(mode & 0o777, 0o700);
    let server = Server::start(&at("restored"), CONFIG);
    let finished = team.wait_until_finished(&server, &evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    // The same secret draws the same episodes, whichever of them were done at the backup.
    assert_eq!(
        finished["result"]["tasks"]["hit"]["successes"],
        expected["result"]["tasks"]["hit"]["successes"]
    );
    let restored_season = server.poll("/api/v1/season", &server.admin_token, |_| true);
    assert_eq!(restored_season["commitment"], season["commitment"]);
    for field in ["rank", "team", "evaluation"] {
        assert_eq!(board_row(&server)[field], row[field], "{row:#}");
    }
}

#[test]
fn second_server_on_data_folder_changes_nothing() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let data = scratch.path().join("data");
    let server = Server::start(&data, CONFIG);
    // The file of an upload in progress.
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
    let refused = faceoff(&serve, "").expect_failure(FAILED);
    assert!(refused.contains(&holder), "{refused}");
    assert_eq!(
        fs::read_to_string(&upload).expect("the file is unchanged"),
        "half"
    );
    let back = scratch.path().join("backup");
    back_up(&data, &back);
    let restore = ["restore", text(&back), "--data", text(&data), "--replace"];
    faceoff(&restore, "").expect_refusal(FAILED, &[&holder]);
    let health = server.get("/api/v1/health", None);
    assert_eq!(health.status(), 200, "the first server still answers");
}

#[test]
fn damaged_backup_is_neither_restored_nor_reported_intact() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let at = |name: &str| scratch.path().join(name);
    let server = Server::start(&at("data"), CONFIG);
    let team = Team::create(&server, "Alpha");
    let submission = team.submit(&server, &repository().join("agents/hold"));
    let evaluation = team.evaluate(&server, &submission);
    let _ = team.wait_until_finished(&server, &evaluation);
    server.kill();
    back_up(&at("data"), &at("backup"));
    let backup = |args: &[&str]| faceoff(args, "");

    // Folders with contents are not overwritten.
    backup(&[
        "backup",
        text(&at("backup")),
        "--data-dir",
        text(&at("data")),
    ])
    .expect_refusal(FAILED, &["is not empty"]);
    backup(&["restore", text(&at("backup")), "--data", text(&at("data"))])
        .expect_refusal(FAILED, &["is not empty", "--replace"]);
    backup(&[
        "backup",
        text(&at("new")),
        "--data-dir",
        text(&at("nowhere")),
    ])
    .expect_refusal(FAILED, &["not the data folder of a server"]);
    backup(&["restore", text(&at("data")), "--check"]).expect_refusal(FAILED, &["not a backup"]);
    let inside = at("data").join("artifacts/backup");
    backup(&["backup", text(&inside), "--data-dir", text(&at("data"))])
        .expect_refusal(FAILED, &["inside the data folder"]);
    // A folder that is no data folder is never moved, and a link is not followed.
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
    .expect_refusal(FAILED, &["has no faceoff.sqlite3"]);
    assert_eq!(files(&home), [home.join("letter")]);
    let link = at("link");
    fs::create_dir(at("empty")).expect("a scratch folder");
    std::os::unix::fs::symlink(at("empty"), &link).expect("a scratch link");
    backup(&["restore", text(&at("backup")), "--data", text(&link)])
        .expect_refusal(FAILED, &["is a symbolic link"]);

    // With --replace the former folder, its write-ahead log included, is moved aside.
    fs::write(at("data").join("faceoff.sqlite3-wal"), "stale").expect("a scratch file");
    let output = backup(&[
        "restore",
        text(&at("backup")),
        "--data",
        text(&at("data")),
        "--replace",
    ])
    .expect_success();
    assert!(!at("data").join("faceoff.sqlite3-wal").exists(), "{output}");
    let aside = fs::read_dir(scratch.path())
        .expect("a folder can be read")
        .map(|entry| entry.expect("a folder can be read").path())
        .find(|path| text(path).contains("data.replaced-"))
        .unwrap_or_else(|| panic!("{output}"));
    assert_eq!(
        fs::read_to_string(aside.join("faceoff.sqlite3-wal")).expect("it is there"),
        "stale"
    );
    // Clients may know event ids from after the backup. The restored server must not assign them again.
    let next_ids_query = "SELECT seq > 100000000 FROM sqlite_sequence WHERE name = 'events'";
    let output = Command::new("sqlite3")
        .arg(at("data").join("faceoff.sqlite3"))
        .arg(next_ids_query)
        .output()
        .expect("sqlite3 starts");
    assert_eq!(output.stdout, b"1\n");

    // The backup of a data folder with a lost file is made, and reports the missing file.
    let lost = files(&at("data").join("artifacts/datasets")).remove(0);
    fs::remove_file(&lost).expect("a scratch file");
    let errors = backup(&[
        "backup",
        text(&at("incomplete")),
        "--data-dir",
        text(&at("data")),
    ])
    .expect_failure(FAILED);
    assert!(errors.contains("missing: artifacts/datasets/"), "{errors}");
    assert!(at("incomplete").join("backup.json").exists());
    let errors = backup(&["restore", text(&at("incomplete")), "--check"]).expect_failure(FAILED);
    assert!(
        errors.contains("lacks 1 files that its database refers to"),
        "{errors}"
    );

    // Each file of the backup is damaged in turn.
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
            .expect_refusal(FAILED, &["has changed since the backup"]);
        backup(&["restore", text(&at("backup")), "--check"])
            .expect_refusal(FAILED, &["has changed since the backup"]);
        fs::write(file, &whole).expect("a scratch file");
    }
    assert!(!at("never").exists() && !at("never.restoring").exists());
}

/// Runs SQL on a database that no server has open.
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
fn database_of_later_version_is_refused_with_reason() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let (data, back) = (scratch.path().join("data"), scratch.path().join("backup"));
    Server::start(&data, CONFIG).kill();
    back_up(&data, &back);
    let later =
        "INSERT INTO _sqlx_migrations (version, description, success, checksum, execution_time)
                 VALUES (9999, 'later', 1, x'00', 0);
                 INSERT INTO programs (id, version, schema) VALUES (77, '7.8.9', 9999);";
    sql(&data.join("faceoff.sqlite3"), later);
    let messages = [
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
    let errors = String::from_utf8_lossy(&serve.stderr).into_owned();
    assert_eq!(serve.status.code(), Some(FAILED), "{errors}");
    for message in messages {
        assert!(errors.contains(message), "{errors}");
    }
    let target = scratch.path().join("backup-of-later");
    faceoff(&["backup", text(&target), "--data-dir", text(&data)], "")
        .expect_refusal(FAILED, &messages);
    assert!(!target.exists());
    // The backup from before the upgrade can be restored.
    faceoff(
        &["restore", text(&back), "--data", text(&data), "--replace"],
        "",
    )
    .expect_success();
    drop(Server::start(&data, CONFIG));
}

#[test]
fn first_release_data_folder_is_backed_up_before_upgrade() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    unpack("data-folder-e67a08c.tar.gz", scratch.path());
    let (data, back) = (scratch.path().join("data"), scratch.path().join("backup"));
    // The fixture lacks Delta's bundle: the backup has the rest, and reports the missing file.
    let errors =
        faceoff(&["backup", text(&back), "--data-dir", text(&data)], "").expect_failure(FAILED);
    assert_eq!(
        errors.matches("missing: artifacts/bundles/").count(),
        1,
        "{errors}"
    );
    assert!(errors.contains("can be restored"), "{errors}");
    let restored = scratch.path().join("restored");
    faceoff(&["restore", text(&back), "--data", text(&restored)], "").expect_success();
    let server = Server::start(&restored, CONFIG);
    server.wait_for_log("database upgraded", 1);
    let upgraded = server.log();
    assert!(
        upgraded.contains("from=\"an earlier version\""),
        "{upgraded}"
    );
}
