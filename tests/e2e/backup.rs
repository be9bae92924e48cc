//! The commands `faceoff backup` and `faceoff restore`: backups of a data folder (database and files of a server), also while
//! the server runs, and servers that continue from a backup.

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

fn path_text(path: &Path) -> &str {
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

/// Backs up the data folder `data` to the folder `backup`; returns the command's output.
fn back_up(data: &Path, backup: &Path) -> String {
    faceoff(
        &["backup", path_text(backup), "--data-dir", path_text(data)],
        "",
    )
    .expect_success()
}

/// The first row of the board, the ranking of teams.
fn board_row(server: &Server) -> Value {
    let board = server.poll("/api/v1/board", &server.admin_token, |_| true);
    board["rows"][0].clone()
}

#[test]
fn backup_during_evaluation_restores_running_evaluation() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let in_scratch = |name: &str| scratch.path().join(name);
    let [data, backup] = ["data", "backup"].map(in_scratch);
    let server = Server::start(&data, CONFIG);
    let team = Team::create(&server, "Phoenix");
    let submission = team.submit(&server, &bundle::example_agent("striker", scratch.path()));
    let evaluation = team.evaluate(&server, &submission);
    let _ = server.poll(&evaluation, &server.admin_token, |answer| {
        answer["progress"]["episodes_done"].as_u64() >= Some(2)
    });
    let output = back_up(&data, &backup);
    assert!(output.contains("the database is intact"), "{output}");
    for path in files(&backup) {
        let mode = path.metadata().expect("it is there").permissions().mode();
        assert_eq!(mode & 0o077, 0, "only the owner may use {}", path.display());
    }
    // The server continues and has more results than the backup.
    let expected = team.wait_until_finished(&server, &evaluation);
    let season = server.poll("/api/v1/season", &server.admin_token, |_| true);
    let expected_row = board_row(&server);
    server.kill();
    fs::remove_dir_all(&data).expect("the folder can be removed");

    let check_output = faceoff(&["restore", path_text(&backup), "--check"], "").expect_success();
    assert!(check_output.contains("is intact"), "{check_output}");
    let output = faceoff(
        &[
            "restore",
            path_text(&backup),
            "--data",
            path_text(&in_scratch("restored")),
        ],
        "",
    )
    .expect_success();
    assert!(output.contains("faceoff serve --data-dir"), "{output}");
    let mode = in_scratch("restored")
        .metadata()
        .expect("it is there")
        .permissions()
        .mode();
    assert_eq!(mode & 0o777, 0o700);
    let server = Server::start(&in_scratch("restored"), CONFIG);
    let finished = team.wait_until_finished(&server, &evaluation);
    assert_eq!(finished["state"], "finished", "{finished:#}");
    // The secret of the season, which is in the backup, determines the episodes. So they are the same as before, also those that
    // were not finished at the backup.
    assert_eq!(
        finished["result"]["tasks"]["hit"]["successes"],
        expected["result"]["tasks"]["hit"]["successes"]
    );
    let restored_season = server.poll("/api/v1/season", &server.admin_token, |_| true);
    assert_eq!(restored_season["commitment"], season["commitment"]);
    for field in ["rank", "team", "evaluation"] {
        assert_eq!(
            board_row(&server)[field],
            expected_row[field],
            "{expected_row:#}"
        );
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
        path_text(&config),
        "--data-dir",
        path_text(&data),
    ];
    let in_use_message = format!("in use by process {}", server.process_id());
    let refused = faceoff(&serve, "").expect_failure(FAILED);
    assert!(refused.contains(&in_use_message), "{refused}");
    assert_eq!(
        fs::read_to_string(&upload).expect("the file is unchanged"),
        "half"
    );
    let backup = scratch.path().join("backup");
    back_up(&data, &backup);
    let restore = [
        "restore",
        path_text(&backup),
        "--data",
        path_text(&data),
        "--replace",
    ];
    faceoff(&restore, "").expect_refusal(FAILED, &[&in_use_message]);
    let health = server.get("/api/v1/health", None);
    assert_eq!(health.status(), 200, "the first server still answers");
}

#[test]
fn damaged_backup_is_neither_restored_nor_reported_intact() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let in_scratch = |name: &str| scratch.path().join(name);
    let [data, backup] = ["data", "backup"].map(in_scratch);
    let server = Server::start(&data, CONFIG);
    let team = Team::create(&server, "Alpha");
    let submission = team.submit(&server, &repository().join("agents/hold"));
    let evaluation = team.evaluate(&server, &submission);
    let _ = team.wait_until_finished(&server, &evaluation);
    server.kill();
    back_up(&data, &backup);
    let run = |args: &[&str]| faceoff(args, "");

    // Folders with contents are not overwritten.
    run(&["backup", path_text(&backup), "--data-dir", path_text(&data)])
        .expect_refusal(FAILED, &["is not empty"]);
    run(&["restore", path_text(&backup), "--data", path_text(&data)])
        .expect_refusal(FAILED, &["is not empty", "--replace"]);
    run(&[
        "backup",
        path_text(&in_scratch("new")),
        "--data-dir",
        path_text(&in_scratch("not-there")),
    ])
    .expect_refusal(FAILED, &["not the data folder of a server"]);
    run(&["restore", path_text(&data), "--check"]).expect_refusal(FAILED, &["not a backup"]);
    let inside_data = data.join("artifacts/backup");
    run(&[
        "backup",
        path_text(&inside_data),
        "--data-dir",
        path_text(&data),
    ])
    .expect_refusal(FAILED, &["inside the data folder"]);
    // A folder that is no data folder is not replaced, and a link is not followed.
    let home = in_scratch("home");
    fs::create_dir(&home).expect("a scratch folder");
    fs::write(home.join("letter"), "Dear").expect("a scratch file");
    run(&[
        "restore",
        path_text(&backup),
        "--data",
        path_text(&home),
        "--replace",
    ])
    .expect_refusal(FAILED, &["has no faceoff.sqlite3"]);
    assert_eq!(files(&home), [home.join("letter")]);
    let link = in_scratch("link");
    fs::create_dir(in_scratch("empty")).expect("a scratch folder");
    std::os::unix::fs::symlink(in_scratch("empty"), &link).expect("a scratch link");
    run(&["restore", path_text(&backup), "--data", path_text(&link)])
        .expect_refusal(FAILED, &["is a symbolic link"]);

    // With --replace the former folder, its write-ahead log included, is moved aside.
    fs::write(data.join("faceoff.sqlite3-wal"), "stale").expect("a scratch file");
    let output = run(&[
        "restore",
        path_text(&backup),
        "--data",
        path_text(&data),
        "--replace",
    ])
    .expect_success();
    assert!(!data.join("faceoff.sqlite3-wal").exists(), "{output}");
    let replaced_data = fs::read_dir(scratch.path())
        .expect("a folder can be read")
        .map(|entry| entry.expect("a folder can be read").path())
        .find(|path| path_text(path).contains("data.replaced-"))
        .unwrap_or_else(|| panic!("{output}"));
    assert_eq!(
        fs::read_to_string(replaced_data.join("faceoff.sqlite3-wal")).expect("it is there"),
        "stale"
    );
    // Clients may know event ids from after the backup. The restored server must not assign them again, so it continues 100
    // million ids later.
    let ids_skipped_query = "SELECT seq > 100000000 FROM sqlite_sequence WHERE name = 'events'";
    let output = Command::new("sqlite3")
        .arg(data.join("faceoff.sqlite3"))
        .arg(ids_skipped_query)
        .output()
        .expect("sqlite3 starts");
    assert_eq!(output.stdout, b"1\n", "SQLite prints 1 for true");

    // The backup of a data folder with a lost file is made, and reports the missing file.
    let lost_file = files(&data.join("artifacts/datasets")).remove(0);
    fs::remove_file(&lost_file).expect("a scratch file");
    let errors = run(&[
        "backup",
        path_text(&in_scratch("incomplete")),
        "--data-dir",
        path_text(&data),
    ])
    .expect_failure(FAILED);
    assert!(errors.contains("missing: artifacts/datasets/"), "{errors}");
    assert!(in_scratch("incomplete").join("backup.json").exists());
    let errors =
        run(&["restore", path_text(&in_scratch("incomplete")), "--check"]).expect_failure(FAILED);
    assert!(
        errors.contains("lacks 1 files that its database refers to"),
        "{errors}"
    );

    // Each file of the backup is damaged in turn: one bit in its middle, or one byte in an empty file.
    let backup_files = files(&backup);
    assert!(backup_files.len() >= 4, "{backup_files:?}");
    for file in backup_files
        .iter()
        .filter(|file| !file.ends_with("backup.json"))
    {
        let intact = fs::read(file).expect("it is there");
        let mut damaged = intact.clone();
        let middle = damaged.len() / 2;
        match damaged.get_mut(middle) {
            Some(byte) => *byte ^= 1,
            None => damaged.push(1),
        }
        fs::write(file, &damaged).expect("a scratch file");
        run(&[
            "restore",
            path_text(&backup),
            "--data",
            path_text(&in_scratch("not-restored")),
        ])
        .expect_refusal(FAILED, &["has changed since the backup"]);
        run(&["restore", path_text(&backup), "--check"])
            .expect_refusal(FAILED, &["has changed since the backup"]);
        fs::write(file, &intact).expect("a scratch file");
    }
    assert!(!in_scratch("not-restored").exists() && !in_scratch("not-restored.restoring").exists());
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
    let (data, backup) = (scratch.path().join("data"), scratch.path().join("backup"));
    Server::start(&data, CONFIG).kill();
    back_up(&data, &backup);
    let later_version =
        "INSERT INTO _sqlx_migrations (version, description, success, checksum, execution_time)
                 VALUES (9999, 'later', 1, x'00', 0);
                 INSERT INTO programs (id, version, schema) VALUES (77, '7.8.9', 9999);";
    sql(&data.join("faceoff.sqlite3"), later_version);
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
            path_text(&data),
        ])
        .output()
        .expect("the program starts");
    let errors = String::from_utf8_lossy(&serve.stderr).into_owned();
    assert_eq!(serve.status.code(), Some(FAILED), "{errors}");
    for message in messages {
        assert!(errors.contains(message), "{errors}");
    }
    let later_backup = scratch.path().join("backup-of-later");
    faceoff(
        &[
            "backup",
            path_text(&later_backup),
            "--data-dir",
            path_text(&data),
        ],
        "",
    )
    .expect_refusal(FAILED, &messages);
    assert!(!later_backup.exists());
    // The backup from before the upgrade can be restored.
    faceoff(
        &[
            "restore",
            path_text(&backup),
            "--data",
            path_text(&data),
            "--replace",
        ],
        "",
    )
    .expect_success();
    drop(Server::start(&data, CONFIG));
}

#[test]
fn first_release_data_folder_is_backed_up_before_upgrade() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    // A data folder of the first release, at commit e67a08c.
    unpack("data-folder-e67a08c.tar.gz", scratch.path());
    let (data, backup) = (scratch.path().join("data"), scratch.path().join("backup"));
    // The data folder lacks the bundle of the team Delta: the backup has the rest, and reports the missing file.
    let errors = faceoff(
        &["backup", path_text(&backup), "--data-dir", path_text(&data)],
        "",
    )
    .expect_failure(FAILED);
    assert_eq!(
        errors.matches("missing: artifacts/bundles/").count(),
        1,
        "{errors}"
    );
    assert!(errors.contains("can be restored"), "{errors}");
    let restored = scratch.path().join("restored");
    faceoff(
        &[
            "restore",
            path_text(&backup),
            "--data",
            path_text(&restored),
        ],
        "",
    )
    .expect_success();
    let server = Server::start(&restored, CONFIG);
    server.wait_for_log("database upgraded", 1);
    let log = server.log();
    assert!(log.contains("from=\"an earlier version\""), "{log}");
}
