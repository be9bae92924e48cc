//! The contents of runtimes, the environments in which agents run, and the machine that runs them.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A runtime that a machine offers, and its content as detected inside the sandbox.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct RuntimeInventory {
    /// Name of the runtime in `agent.toml`.
    #[cfg_attr(feature = "openapi", schema(example = "python3"))]
    pub name: String,
    /// The detected content.
    #[serde(flatten)]
    pub content: RuntimeContent,
}

/// The detected content of a runtime.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum RuntimeContent {
    /// A Python interpreter.
    Python(PythonInventory),
    /// Shared libraries, and no Python.
    Native {
        /// Version of the C library; null if it could not be detected.
        #[cfg_attr(feature = "openapi", schema(example = "2.36"))]
        libc: Option<String>,
    },
    /// The runtime is part of the container image.
    Image,
    /// The runtime does not work. `faceoff doctor` shows the reason to the organiser.
    #[serde(rename = "broken")]
    Failed {
        /// Why its inspection failed.
        #[serde(rename = "why")]
        reason: String,
    },
}

/// A Python, as it describes itself.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct PythonInventory {
    /// Name of the interpreter.
    #[cfg_attr(feature = "openapi", schema(example = "CPython"))]
    pub implementation: String,
    /// Version of the interpreter.
    #[cfg_attr(feature = "openapi", schema(example = "3.11.2"))]
    pub version: String,
    /// Version of the C library; null if it could not be detected.
    #[cfg_attr(feature = "openapi", schema(example = "2.36"))]
    pub libc: Option<String>,
    /// Versions of the importable packages outside the standard library, by lower-case name.
    pub packages: BTreeMap<String, String>,
    /// Installed packages that cannot be imported, by lower-case name, with the error. Only packages that agents often use are tried.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub unusable_packages: BTreeMap<String, String>,
}

impl PythonInventory {
    /// Major and minor version, e.g. `3.11`; compiled packages depend on it.
    #[must_use]
    pub fn minor_version(&self) -> &str {
        let minor_end = self.version.match_indices('.').nth(1);
        minor_end.map_or(&self.version, |(second_dot, _)| &self.version[..second_dot])
    }
}

/// The machine that agents run on.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct AgentMachine {
    /// The architecture, under its name in Rust and `uname -m`.
    #[cfg_attr(feature = "openapi", schema(example = "x86_64"))]
    pub architecture: String,
    /// CPU model as reported by the kernel; null if it does not report one.
    pub cpu_model: Option<String>,
    /// CPUs that an agent may run on; its CPU time has its own limit (`resources.cpus`).
    pub cpus_per_agent: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runtime_inventory_is_one_flat_object() {
        let python = PythonInventory {
            implementation: "CPython".into(),
            version: "3.11.2".into(),
            libc: Some("2.36".into()),
            packages: BTreeMap::from([("numpy".into(), "2.4.6".into())]),
            unusable_packages: BTreeMap::new(),
        };
        assert_eq!(python.minor_version(), "3.11");
        let inventory = RuntimeInventory {
            name: "python3".into(),
            content: RuntimeContent::Python(python),
        };
        let json = serde_json::to_value(&inventory).unwrap();
        assert_eq!(
            json,
            serde_json::json!({
                "name": "python3", "kind": "python", "implementation": "CPython", "version": "3.11.2",
                "libc": "2.36", "packages": { "numpy": "2.4.6" },
            })
        );
        assert_eq!(
            serde_json::from_value::<RuntimeInventory>(json).unwrap(),
            inventory
        );
    }
}
