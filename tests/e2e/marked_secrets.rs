//! No log, answer, page or output shows a secret of the configuration. Every setting and variable that can hold one has a value that is
//! looked for everywhere.

use crate::commands::{FAILED, faceoff};
use faceoff_tests::server::Server;
use std::fs;

/// Part of every secret.
const MARK: &str = "mark3d";

/// NATS and the bucket cannot be reached, so their addresses stand in errors.
const CONFIG: &str = r#"
[workers]
slots = 1
play = false
[nats]
url = "nats://127.0.0.1:1"
files_url = "http://127.0.0.1:1"
bucket = "s3://bucket"
[sandbox]
resident_bytes = 0
"#;

#[test]
fn no_log_answer_or_output_shows_a_secret() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let data_dir = scratch.path().join("data");
    let variables = [
        ("AWS_ACCESS_KEY_ID", "id-mark3d"),
        ("AWS_SECRET_ACCESS_KEY", "key-mark3d"),
        ("AWS_SESSION_TOKEN", "token-mark3d"),
        ("AWS_ENDPOINT", "http://127.0.0.1:1"),
        ("AWS_ALLOW_HTTP", "true"),
        ("AWS_REGION", "nowhere"),
        ("RUST_LOG", "debug"),
    ]
    .map(|(name, value)| (name, value.to_owned()));
    let server = Server::start_with_environment(&data_dir, CONFIG, &variables);
    server.wait_for_log("NATS cannot be reached", 1);
    // Each text that a user can see, with the place where it is shown.
    let mut shown = Vec::new();
    for path in [
        "/api/v1/health",
        "/api/v1/workers",
        "/api/v1/runtimes",
        "/api/v1/events",
        "/api/v1/tokens",
        "/api/v1/openapi.json",
        "/readyz",
        "/metrics",
        "/",
        "/organiser",
        "/organiser/workers",
        "/organiser/log",
        "/docs",
    ] {
        for token in [None, Some(&*server.admin_token)] {
            let answer = server.get(path, token);
            shown.push((path.to_owned(), answer.text().expect("an answer is text")));
        }
    }
    let config_file = data_dir.join("faceoff.toml");
    let config = config_file.to_string_lossy();
    for arguments in [
        &["doctor", "--config", &config, "--name", "worker"][..],
        &["doctor", "--config", &config, "--name", "worker", "--json"],
        &["doctor", "--json", "--config", &config],
    ] {
        shown.push((arguments.join(" "), faceoff(arguments, "").text()));
    }
    // Addresses with a password are refused; the errors quote them.
    for (section, name, scheme) in [
        ("nats", "url", "nats"),
        ("nats", "files_url", "https"),
        ("nats", "bucket", "s3"),
        ("server", "public_url", "https"),
    ] {
        let file = scratch.path().join("refused.toml");
        let url = format!("{scheme}://user-{MARK}:password-{MARK}@example.org");
        let text = format!("[{section}]\n{name} = \"{url}\"\n");
        fs::write(&file, text).expect("a scratch file can be written");
        let error =
            faceoff(&["serve", "--config", &file.to_string_lossy()], "").expect_failure(FAILED);
        assert!(error.contains(name), "{error}");
        assert!(error.contains("…@example.org"), "{error}");
        shown.push((format!("refused {name}"), error));
    }
    shown.push(("log".to_owned(), server.log()));
    for (place, text) in shown {
        let line = text.lines().find(|line| line.contains(MARK));
        assert_eq!(line, None, "{place}");
        let token = text.lines().find(|line| line.contains(&server.admin_token));
        assert_eq!(token, None, "{place}");
    }
}
