//! Dependencies between crates: the table of `ARCHITECTURE.md`, and the actual ones from `cargo metadata`.

use faceoff_tests::repository;
use serde_json::Value;
use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::PathBuf,
    process::Command,
};

/// A crate of the workspace.
pub struct Member {
    pub name: String,
    pub folder: PathBuf,
    /// Dependencies of its library or program, without those of tests and build scripts.
    pub dependencies: BTreeSet<String>,
}

/// The dependencies that a row of the table allows.
pub enum AllowedDependencies {
    Any,
    Listed(BTreeSet<String>),
}

impl AllowedDependencies {
    pub fn permits(&self, name: &str) -> bool {
        match self {
            Self::Any => true,
            Self::Listed(names) => names.contains(name),
        }
    }
}

/// The crates of the workspace, from `cargo metadata`.
pub fn members() -> Vec<Member> {
    let output = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .args([
            "metadata",
            "--format-version",
            "1",
            "--no-deps",
            "--offline",
        ])
        .current_dir(repository())
        .output()
        .expect("cargo can be started");
    assert!(
        output.status.success(),
        "cargo metadata: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    let metadata: Value = serde_json::from_slice(&output.stdout).expect("cargo writes JSON");
    let text = |value: &Value| value.as_str().expect("a string").to_owned();
    metadata["packages"]
        .as_array()
        .expect("a workspace has packages")
        .iter()
        .map(|package| Member {
            name: text(&package["name"]),
            folder: PathBuf::from(text(&package["manifest_path"]))
                .parent()
                .expect("a manifest is in a folder")
                .to_owned(),
            dependencies: package["dependencies"]
                .as_array()
                .expect("a package has a list of dependencies")
                .iter()
                .filter(|dependency| dependency["kind"].is_null())
                .map(|dependency| text(&dependency["name"]))
                .collect(),
        })
        .collect()
}

/// The table of `ARCHITECTURE.md` by crate. Its first column names the crate, its last the crates that it may use, without the
/// prefix `faceoff-` (`workspace-hack` has none).
pub fn allowed_dependencies() -> BTreeMap<String, AllowedDependencies> {
    let text = fs::read_to_string(repository().join("ARCHITECTURE.md"))
        .expect("ARCHITECTURE.md can be read");
    let mut allowed = BTreeMap::new();
    let rows = text
        .lines()
        .skip_while(|line| !line.starts_with("| crate |"))
        .take_while(|line| line.starts_with('|'))
        // the headings and the line below them
        .skip(2);
    for row in rows {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let (Some(name), Some(dependencies)) = (cells.first(), cells.last()) else {
            continue;
        };
        let name = match name.trim_matches('`') {
            "tests" => "faceoff-tests",
            name => name.trim_start_matches("agents/"),
        };
        let dependencies = match *dependencies {
            "any" => AllowedDependencies::Any,
            "–" => AllowedDependencies::Listed(BTreeSet::new()),
            list => AllowedDependencies::Listed(
                list.split(", ")
                    .map(|name| match name.strip_prefix("agents/") {
                        Some(agent) => agent.to_owned(),
                        None if name == "workspace-hack" => name.to_owned(),
                        None => format!("faceoff-{name}"),
                    })
                    .collect(),
            ),
        };
        let earlier_row = allowed.insert(name.to_owned(), dependencies);
        assert!(earlier_row.is_none(), "{name} has two rows");
    }
    allowed
}
