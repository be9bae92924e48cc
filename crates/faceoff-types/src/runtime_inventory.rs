use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A runtime that a machine offers, and what was found in it, by asking inside the sandbox.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct RuntimeInventory {
    /// As `agent.toml` names it.
    #[cfg_attr(feature = "openapi", schema(example = "python3"))]
    pub name: String,
    /// What was found.
    #[serde(flatten)]
    pub content: RuntimeContent,
}

/// What was found in a runtime.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum RuntimeContent {
    /// A Python interpreter.
    Python(PythonInventory),
    /// Shared libraries, and no Python.
    Native {
        /// The version of the C library; null where it does not tell.
        #[cfg_attr(feature = "openapi", schema(example = "2.36"))]
        libc: Option<String>,
    },
    /// Whatever a container image brings.
    Image,
    /// It does not work; `why` is for the organiser, who finds it in `faceoff doctor`.
    Broken {
        /// What went wrong.
        why: String,
    },
}

/// A Python, as it describes itself.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct PythonInventory {
    /// The interpreter.
    #[cfg_attr(feature = "openapi", schema(example = "CPython"))]
    pub implementation: String,
    /// Its version.
    #[cfg_attr(feature = "openapi", schema(example = "3.11.2"))]
    pub version: String,
    /// The version of the C library; null where it does not tell.
    #[cfg_attr(feature = "openapi", schema(example = "2.36"))]
    pub libc: Option<String>,
    /// Versions of the packages that can be imported beside the standard library, by their names in lower case.
    pub packages: BTreeMap<String, String>,
}

impl PythonInventory {
    /// Major and minor version, which decide what compiled packages load: `3.11`.
    #[must_use]
    pub fn minor_version(&self) -> &str {
        let end = self.version.match_indices('.').nth(1);
        end.map_or(&self.version, |(at, _)| &self.version[..at])
    }
}

/// What agents run on.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct AgentMachine {
    /// The architecture, as Rust and `uname -m` name it.
    #[cfg_attr(feature = "openapi", schema(example = "x86_64"))]
    pub architecture: String,
    /// The model of its CPUs, as the kernel tells it; null where it does not.
    pub cpu_model: Option<String>,
    /// CPUs that an agent may run on; its CPU time is limited besides (`resources.cpus`).
    pub cpus_per_agent: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_runtime_is_one_object_that_says_what_it_is() {
        let python = PythonInventory {
            implementation: "CPython".into(),
            version: "3.11.2".into(),
            libc: Some("2.36".into()),
            packages: BTreeMap::from([("numpy".into(), "2.4.6".into())]),
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
