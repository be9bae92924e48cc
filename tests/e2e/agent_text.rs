//! Text from agents (output and names) is shown without control characters, and the reasons why bundles are invalid reveal
//! nothing about the host's files.

use crate::{CONFIG, Team};
use faceoff_tests::{
    bundle::{pack, python_agent, python_bundle},
    program,
    server::Server,
};
use serde_json::{Value, json};
use std::{
    fs,
    os::unix::fs::{PermissionsExt, symlink},
    path::Path,
    process::Command,
};

fn text(value: &Value) -> &str {
    value
        .as_str()
        .unwrap_or_else(|| panic!("{value} is no text"))
}

/// Asserts that a text has no control characters, and none that change the writing direction. `name` names
/// the case in the message.
fn assert_harmless(name: &str, text: &str) {
    let harmful = text.chars().find(|c| {
        (c.is_control() && !"\n\t\r".contains(*c))
            || matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    });
    assert_eq!(harmful, None, "{name}: {text:?}");
}

#[test]
fn agent_toml_that_is_no_file_makes_bundle_invalid() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let team = Team::create(&server, "Folder");
    // A bundle whose file `agent.toml` is replaced by what `create` makes at its path.
    let bundle = |name: &str, create: &dyn Fn(&Path)| {
        let folder = python_bundle(scratch.path(), name, "pass");
        fs::remove_file(folder.join("agent.toml")).expect("it was just written");
        create(&folder.join("agent.toml"));
        folder
    };
    // A bundle inside a folder of the archive, also with a folder for `agent.toml`.
    let nested = scratch.path().join("nested");
    fs::create_dir_all(nested.join("striker/agent.toml")).expect("a scratch folder");
    let empty_folder = bundle("folder", &|path| {
        fs::create_dir(path).expect("a scratch folder")
    });
    let full_folder = bundle("full", &|path| {
        fs::create_dir(path).expect("a scratch folder");
        fs::write(path.join("agent.toml"), "name = \"x\"").expect("a scratch file");
    });
    // The archive of a bundle whose `agent.toml` is a symbolic link.
    let linked = |name, target: &'static str| {
        let folder = bundle(name, &|path| symlink(target, path).expect("a scratch link"));
        packed_with_links(&folder)
    };
    for (name, archive, word) in [
        (
            "empty folder",
            pack(&empty_folder),
            "agent.toml is a folder",
        ),
        (
            "folder with a file",
            pack(&full_folder),
            "agent.toml is a folder",
        ),
        (
            "folder in a nested bundle",
            pack(&nested),
            "agent.toml is a folder",
        ),
        (
            "link to a file",
            linked("link", "agent.py"),
            "agent.toml is a link",
        ),
        (
            "link to nothing",
            linked("dangling", "missing"),
            "agent.toml is a link",
        ),
        ("link to itself", linked("circle", "agent.toml"), "circle"),
        (
            "link to the host",
            linked("host", "/etc/passwd"),
            "leaves the bundle",
        ),
    ] {
        let id = team.upload(&server, archive);
        let verdict = team.verdict(&server, &id);
        assert_eq!(verdict["state"], "invalid", "{name}: {verdict:#}");
        let reason = text(&verdict["reason"]);
        assert!(reason.contains(word), "{name}: {word:?} is not in {reason}");
    }
}

/// Like [`pack`], but keeps symbolic links.
fn packed_with_links(folder: &Path) -> Vec<u8> {
    let mut archive = tar::Builder::new(flate2::write::GzEncoder::new(
        Vec::new(),
        flate2::Compression::fast(),
    ));
    archive.follow_symlinks(false);
    archive
        .append_dir_all(".", folder)
        .expect("the bundle's folder can be read");
    let encoder = archive
        .into_inner()
        .expect("writing to memory does not fail");
    encoder.finish().expect("writing to memory does not fail")
}

#[test]
fn command_path_reveals_nothing_about_host_files() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let data_dir = scratch.path().join("data");
    let server = Server::start(&data_dir, CONFIG);
    let team = Team::create(&server, "Curious");
    // The commands of the bundles are files that exist but are not executable (`secret` and `/etc/shadow`). The verdict must equal
    // that on a missing file.
    let secret = scratch.path().join("secret");
    fs::write(&secret, "x").expect("a scratch file");
    fs::set_permissions(&secret, fs::Permissions::from_mode(0o640)).expect("a scratch file");
    // More levels than any scratch folder has, so the path leads to the root.
    let to_root = "../".repeat(12);
    let folder = scratch.path().display().to_string();
    for (number, directory) in [
        format!("{to_root}{folder}/"),
        format!("./{to_root}{folder}/"),
        format!("deep/../{to_root}{folder}/"),
        format!("/agent/{to_root}{folder}/"),
        format!("/agent/{folder}/"),
        format!("{folder}/"),
        "../../etc/".to_owned(),
        "/etc/".to_owned(),
    ]
    .into_iter()
    .enumerate()
    {
        let [secret_answer, shadow_answer, missing_answer] = ["secret", "shadow", "no-such-file"]
            .map(|name| {
                let folder =
                    python_bundle(scratch.path(), &format!("agent-{number}-{name}"), "pass");
                let manifest = format!(
                    "name = \"x\"\ncommand = [\"{directory}{name}\"]\nruntime = \"python3\"\n"
                );
                fs::write(folder.join("agent.toml"), manifest).expect("a scratch file");
                let verdict = team.submit(&server, &folder);
                assert_eq!(
                    verdict["state"], "invalid",
                    "{directory}{name}: {verdict:#}"
                );
                format!("{} {}", verdict["reason"], verdict["log"]).replace(name, "NAME")
            });
        assert_eq!(secret_answer, missing_answer, "{directory}");
        assert_eq!(shadow_answer, missing_answer, "{directory}");
    }
}

#[test]
fn agent_output_and_names_contain_no_control_characters() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let team = Team::create(&server, "Painter");
    // Where the text appears, the statements that write it at each step, and how it is shown.
    for (number, (name, on_step, expected)) in [
        (
            "log",
            "sys.stderr.write('\\x1b[2J\\x1b]0;owned\\x07 a\\u202eb \\x9b31m\\n'); sys.exit(3)",
            "a\\u202eb \\u009b31m",
        ),
        (
            "line",
            "sys.stdout.write('\\u2066x\\u200f\\x1b[31m\\n'); sys.stdout.flush()",
            "\\u2066x\\u200f\\u001b[31m",
        ),
        (
            "type",
            "say({'type': '\\u202etca\\x1b[0m', 'step': message['step']})",
            "\\u202etca",
        ),
        (
            "key",
            "sys.stdout.write('{\"\\u202e\":1,\"\\u202e\":2}\\n'); sys.stdout.flush()",
            "202e",
        ),
    ]
    .into_iter()
    .enumerate()
    {
        // Python must write UTF-8, whatever the sandbox's locale.
        let source = python_agent(on_step).replace(
            "held = None\nfor line",
            "sys.stdout.reconfigure(encoding='utf-8')\nsys.stderr.reconfigure(encoding='utf-8')\n\
             held = None\nfor line",
        );
        let folder = python_bundle(scratch.path(), &format!("agent-{number}"), &source);
        let verdict = team.submit(&server, &folder);
        assert_eq!(verdict["state"], "invalid", "{name}: {verdict:#}");
        let shown_text = format!("{}\n{}", text(&verdict["reason"]), text(&verdict["log"]));
        assert_harmless(name, &shown_text);
        assert!(
            shown_text.contains(expected),
            "{name}: {expected:?} is not in {shown_text}"
        );

        // The same agent in a local evaluation: its log and faults are printed to a terminal.
        let evaluated = Command::new(program("faceoff"))
            .arg("eval")
            .arg(&folder)
            .args(["--task", "prepare", "--episodes", "1", "--seed", "1"])
            .arg("--out")
            .arg(scratch.path().join(format!("out-{number}")))
            .output()
            .expect("the program starts");
        for output in [&evaluated.stdout, &evaluated.stderr] {
            assert_harmless(name, &String::from_utf8_lossy(output));
        }
    }
    // Names in agent.toml, in the notation of TOML strings.
    for (name, agent_name) in [
        ("escape", "a\\u001b[31m"),
        ("override", "\\u202eredro"),
        ("invisible", "a\\u200bb"),
    ] {
        let folder = python_bundle(scratch.path(), name, "pass");
        let manifest = format!(
            "name = \"{agent_name}\"\ncommand = [\"python3\", \"agent.py\"]\nruntime = \"python3\"\n"
        );
        fs::write(folder.join("agent.toml"), manifest).expect("a scratch file");
        let verdict = team.submit(&server, &folder);
        assert_eq!(verdict["state"], "invalid", "{name}: {verdict:#}");
        let reason = text(&verdict["reason"]);
        assert!(reason.contains("name must have"), "{reason}");
        assert_harmless(name, reason);
    }
    // Team names; the last is the Hangul filler, a letter without a visible form.
    for name in ["a\u{202e}b", "a\u{1b}[31m", "a\u{200f}", "\u{3164}"] {
        let answer = server.post(
            "/api/v1/teams",
            &server.admin_token,
            &json!({ "name": name }),
        );
        assert_eq!(answer.status(), 422, "{name:?}");
    }
}
