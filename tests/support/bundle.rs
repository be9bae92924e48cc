//! Bundles (the folder or archive of an agent, as a team uploads it): the example agents of `agents/`, and small Python agents written by a
//! test.

use crate::{program, repository};
use flate2::{Compression, write::GzEncoder};
use std::{
    fs,
    path::{Path, PathBuf},
};

/// The folder of one of the example agents in `agents/`, with its program. A compiled agent is copied below `scratch`.
///
/// # Panics
/// If the agent is unknown or cannot be copied.
#[must_use]
pub fn example_agent(name: &str, scratch: &Path) -> PathBuf {
    let source = repository().join("agents").join(name);
    if name != "striker" {
        return source;
    }
    let folder = scratch.join("striker");
    fs::create_dir_all(&folder).expect("a scratch folder can be made");
    fs::copy(source.join("agent.toml"), folder.join("agent.toml")).expect("striker has agent.toml");
    fs::copy(program("striker"), folder.join("striker")).expect("striker is built");
    folder
}

/// The source of a Python agent that answers as it should and runs the statements `on_step` for each `step` message.
/// These can use `message`, the decoded line, `say(object)`, and `hold`, the answer that holds the arm still.
#[must_use]
pub fn python_agent(on_step: &str) -> String {
    let body = on_step.replace('\n', "\n        ");
    format!(
        r#"import json, os, sys, time

def say(answer):
    sys.stdout.write(json.dumps(answer) + "\n")
    sys.stdout.flush()

held = None
for line in sys.stdin:
    message = json.loads(line)
    kind = message["type"]
    if kind == "hello":
        say({{"type": "ready", "protocol": 1, "interpolation": 3}})
    elif kind == "reset":
        held = None
        say({{"type": "ready", "episode": message["episode"]}})
    elif kind == "step":
        held = held or message["obs"][6:13]
        hold = {{"type": "act", "step": message["step"], "action": [held, [0.0] * 7]}}
        {body}
    elif kind == "bye":
        break
"#
    )
}

/// Writes a Python bundle into `folder` and returns it.
///
/// # Panics
/// If the folder cannot be written.
#[must_use]
pub fn python_bundle(folder: &Path, name: &str, source: &str) -> PathBuf {
    let bundle = folder.join(name);
    fs::create_dir_all(&bundle).expect("a scratch folder can be made");
    fs::write(
        bundle.join("agent.toml"),
        format!(
            "name = \"{name}\"\ncommand = [\"python3\", \"agent.py\"]\nruntime = \"python3\"\n"
        ),
    )
    .expect("a scratch file can be written");
    fs::write(bundle.join("agent.py"), source).expect("a scratch file can be written");
    bundle
}

/// Copies a folder with its subfolders.
///
/// # Panics
/// If it cannot be copied.
pub fn copy_folder(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a scratch folder can be made");
    for entry in fs::read_dir(from).expect("a folder can be read") {
        let entry = entry.expect("a folder can be read");
        let (from, to) = (entry.path(), to.join(entry.file_name()));
        if from.is_dir() {
            copy_folder(&from, &to);
        } else {
            fs::copy(&from, &to).expect("a scratch file can be copied");
        }
    }
}

/// Packs the folder as a `.tar.gz`.
///
/// # Panics
/// If the folder cannot be read.
#[must_use]
pub fn pack(folder: &Path) -> Vec<u8> {
    let mut archive = tar::Builder::new(GzEncoder::new(Vec::new(), Compression::fast()));
    archive
        .append_dir_all(".", folder)
        .expect("the bundle's folder can be read");
    archive
        .into_inner()
        .and_then(GzEncoder::finish)
        .expect("writing to memory does not fail")
}
