//! What `faceoff doctor` says about runtimes: what each contains, as agents find it, and which links lead out of it.

use crate::config::{Config, RuntimeConfig};
use faceoff_runner::take_inventory;
use faceoff_sandbox::{HiddenTarget, Isolation, Layer, Runtime};
use faceoff_types::{RuntimeContent, RuntimeInventory};
use serde::Serialize;

/// Packages whose versions are shown.
const SHOWN_PACKAGES: [&str; 4] = ["numpy", "scipy", "onnxruntime", "torch"];

#[derive(Debug, Serialize)]
pub(super) struct RuntimeReport {
    pub name: String,
    pub available: bool,
    pub found: String,
    /// One sentence for each folder, outside of the runtime and hidden from agents, to which links of the runtime lead.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub hidden_targets: Vec<String>,
    #[serde(rename = "cure")]
    pub fix: Option<String>,
}

/// Inspects each runtime inside the sandbox, without the layers that this host lacks.
pub(super) fn runtime_reports(config: &Config, missing_layers: Vec<Layer>) -> Vec<RuntimeReport> {
    let mut env = config.agent_environment();
    env.isolation = Isolation::Sandboxed {
        disabled_layers: missing_layers,
    };
    let mut found: Vec<_> = take_inventory(&env)
        .into_iter()
        .map(|RuntimeInventory { name, content }| {
            let runtime = env.runtimes.get(&name);
            RuntimeReport {
                available: !matches!(content, RuntimeContent::Failed { .. }),
                found: describe(&content, runtime),
                hidden_targets: match config.runtimes.get(&name) {
                    Some(RuntimeConfig::Paths { .. }) => {
                        runtime.map_or_else(Vec::new, hidden_targets)
                    }
                    _ => Vec::new(),
                },
                fix: fix(config, &name, &content),
                name,
            }
        })
        .collect();
    if !env.runtimes.contains_key("python3") {
        found.push(RuntimeReport {
            name: "python3".into(),
            available: false,
            found: "python3 was not found in the usual places".into(),
            hidden_targets: Vec::new(),
            fix: Some("apt-get install python3".into()),
        });
    }
    found
}

/// The folders outside of the runtime to which most of its links lead, one sentence each.
fn hidden_targets(runtime: &Runtime) -> Vec<String> {
    const MOST: usize = 5;
    let found = runtime.hidden_targets();
    let rest = found.len().saturating_sub(MOST);
    let sentence = |HiddenTarget { path, link, links }| {
        let more = if links > 1 {
            format!(" and {} more links", links - 1)
        } else {
            String::new()
        };
        format!(
            "{}{more} into {}, which agents do not see: if programs need it, add it to read_only_paths",
            link.display(),
            path.display()
        )
    };
    let mut sentences: Vec<_> = found.into_iter().take(MOST).map(sentence).collect();
    if rest > 0 {
        sentences.push(format!(
            "links into {rest} further places that agents do not see"
        ));
    }
    sentences
}

fn describe(content: &RuntimeContent, runtime: Option<&Runtime>) -> String {
    match content {
        RuntimeContent::Python(python) => {
            let interpreter = runtime.and_then(Runtime::interpreter);
            let location = interpreter.map(|path| format!(" at {}", path.display()));
            let is_installed = |name: &&str| python.packages.contains_key(*name);
            let shown: Vec<_> = SHOWN_PACKAGES
                .iter()
                .filter(|name| is_installed(name))
                .map(|name| format!("{name} {}", python.packages[*name]))
                .collect();
            let other_count = python.packages.len() - shown.len();
            let unusable = python.unusable_packages.iter();
            let unusable: String = unusable
                .map(|(name, reason)| format!("; {name} cannot be imported by agents: {reason}"))
                .collect();
            format!(
                "{} {}{}; {}{other_count} other packages{unusable}",
                python.implementation,
                python.version,
                location.unwrap_or_default(),
                shown
                    .iter()
                    .map(|package| format!("{package}, "))
                    .collect::<String>(),
            )
        }
        RuntimeContent::Native { libc } => format!(
            "{} host paths, read-only; C library {}",
            runtime.map_or(0, |runtime| runtime.read_only_paths.len()),
            libc.as_deref().unwrap_or("of unknown version")
        ),
        RuntimeContent::Image => "container images, which contain their own files".to_owned(),
        RuntimeContent::Failed { reason } => reason.clone(),
    }
}

fn fix(config: &Config, name: &str, content: &RuntimeContent) -> Option<String> {
    let RuntimeContent::Failed { .. } = content else {
        return None;
    };
    Some(match config.runtimes.get(name) {
        Some(RuntimeConfig::Folder(folder)) => {
            format!("rebuild it: docker/runtime.sh {}", folder.display())
        }
        Some(RuntimeConfig::Paths { .. }) => {
            format!("correct read_only_paths of [runtimes.{name}] in the configuration")
        }
        None => "see the missing sandbox layers above".to_owned(),
    })
}
