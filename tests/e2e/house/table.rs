//! Who may use whom: as drawn, and as cargo knows it.

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
    /// What its library or program needs; not what its tests and its build need.
    pub dependencies: BTreeSet<String>,
}

/// What a row of the table allows.
pub enum Allowed {
    Any,
    These(BTreeSet<String>),
}

impl Allowed {
    pub fn permits(&self, name: &str) -> bool {
        match self {
            Self::Any => true,
            Self::These(names) => names.contains(name),
        }
    }
}

/// The members of the workspace, from `cargo metadata`.
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
                .expect("a manifest lies in a folder")
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

/// The table of `ARCHITECTURE.md`: the first column is the crate, the last what it may use.
pub fn allowed() -> BTreeMap<String, Allowed> {
    let text = fs::read_to_string(repository().join("ARCHITECTURE.md")).expect("it is there");
    let mut allowed = BTreeMap::new();
    let rows = text
        .lines()
        .skip_while(|line| !line.starts_with("| crate |"))
        .take_while(|line| line.starts_with('|'))
        .skip(2);
    for row in rows {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let (Some(name), Some(uses)) = (cells.first(), cells.last()) else {
            continue;
        };
        let name = match name.trim_matches('`') {
            "tests" => "faceoff-tests",
            name => name.trim_start_matches("agents/"),
        };
        let uses = match *uses {
            "any" => Allowed::Any,
            "–" => Allowed::These(BTreeSet::new()),
            list => Allowed::These(
                list.split(", ")
                    .map(|name| match name.strip_prefix("agents/") {
                        Some(agent) => agent.to_owned(),
                        None => format!("faceoff-{name}"),
                    })
                    .collect(),
            ),
        };
        let twice = allowed.insert(name.to_owned(), uses);
        assert!(twice.is_none(), "{name} has two rows");
    }
    allowed
}
