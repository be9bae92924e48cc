//! Selections of runtimes, the environments in which agents run, and the check that a stage accepts an agent's runtime.

use crate::StageName;
use serde::{Deserialize, Serialize};
use std::{collections::BTreeSet, fmt};

const MAX_NAME_CHARS: usize = 40;

/// The runtime name of agents in container images, which bring their own; reserved, so no server runtime has it.
pub const IMAGE_RUNTIME: &str = "image";

/// A selection of the server's runtimes, by their names in `agent.toml`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(transparent)]
pub struct Runtimes(BTreeSet<String>);

/// An invalid selection of runtimes.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum InvalidRuntimes {
    #[error("expected one runtime at least, or null for all that the server offers, got none")]
    None,
    /// A name that is not allowed in `agent.toml`.
    #[error(
        "expected names of 1 to {MAX_NAME_CHARS} letters, digits, dots, dashes and underscores, got {0:?}"
    )]
    Name(String),
}

impl Runtimes {
    /// Checks that there is at least one, and that all names are valid.
    ///
    /// # Errors
    /// If it is empty or contains an invalid name.
    pub fn check(&self) -> Result<(), InvalidRuntimes> {
        let is_name = |name: &&String| {
            (1..=MAX_NAME_CHARS).contains(&name.len())
                && name
                    .bytes()
                    .all(|b| b.is_ascii_alphanumeric() || b"._-".contains(&b))
        };
        if self.0.is_empty() {
            return Err(InvalidRuntimes::None);
        }
        match self.0.iter().find(|name| !is_name(name)) {
            Some(name) => Err(InvalidRuntimes::Name(name.clone())),
            None => Ok(()),
        }
    }

    #[must_use]
    pub fn contains(&self, runtime: &str) -> bool {
        self.0.contains(runtime)
    }

    /// Names in alphabetical order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.0.iter().map(String::as_str)
    }
}

impl FromIterator<String> for Runtimes {
    fn from_iter<T: IntoIterator<Item = String>>(names: T) -> Self {
        Self(names.into_iter().collect())
    }
}

impl fmt::Display for Runtimes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<&str> = self.names().collect();
        f.write_str(&names.join(" or "))
    }
}

/// A stage that accepts only agents of certain runtimes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StageRuntimes {
    pub stage: StageName,
    pub runtimes: Runtimes,
}

/// An agent is refused by a stage because of its runtime.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the stage “{}” takes agents of the runtime {} only, and {}", .refuser.stage, .refuser.runtimes, describe_runtime(.runtime.as_deref()))]
pub struct RuntimeRefused {
    /// The stage that refuses the agent.
    refuser: StageRuntimes,
    /// The agent's runtime; `None` if it is not known.
    runtime: Option<String>,
}

fn describe_runtime(runtime: Option<&str>) -> String {
    match runtime {
        Some(runtime) => format!("this one names {runtime} in agent.toml"),
        None => "the runtime of this one is unknown: it was validated before stages had a list of runtimes; upload it again".to_owned(),
    }
}

impl StageRuntimes {
    /// Checks that the stage accepts an agent of this runtime; `None`: the runtime is not known.
    ///
    /// # Errors
    /// If it refuses the runtime.
    pub fn check(&self, runtime: Option<&str>) -> Result<(), RuntimeRefused> {
        match runtime {
            Some(runtime) if self.runtimes.contains(runtime) => Ok(()),
            _ => Err(RuntimeRefused {
                refuser: self.clone(),
                runtime: runtime.map(str::to_owned),
            }),
        }
    }

    /// The reasons for which all these stages refuse a runtime; `None` if one accepts it, or there are no stages.
    #[must_use]
    pub fn reasons_if_all_refuse(stages: &[Self], runtime: &str) -> Option<String> {
        let refusals = stages.iter().map(|stage| stage.check(Some(runtime)).err());
        let refusals: Vec<String> = refusals
            .map(|refusal| Some(refusal?.to_string()))
            .collect::<Option<_>>()?;
        (!refusals.is_empty()).then(|| refusals.join("; "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stage(name: &str, runtimes: &[&str]) -> StageRuntimes {
        StageRuntimes {
            stage: name.parse().unwrap(),
            runtimes: runtimes.iter().map(ToString::to_string).collect(),
        }
    }

    #[test]
    fn refusal_lists_the_stages_runtimes() {
        let main = stage("Main", &["python3", "native"]);
        assert_eq!(main.check(Some("native")), Ok(()));
        let refused = main.check(Some("julia")).unwrap_err().to_string();
        assert_eq!(
            refused,
            "the stage “Main” takes agents of the runtime native or python3 only, and this one names julia in agent.toml"
        );
        let unknown = main.check(None).unwrap_err().to_string();
        assert!(unknown.contains("upload it again"), "{unknown}");
    }

    #[test]
    fn runtime_accepted_by_one_stage_is_accepted() {
        let stages = [stage("Main", &["native"]), stage("Late", &["python3"])];
        assert_eq!(
            StageRuntimes::reasons_if_all_refuse(&stages, "python3"),
            None
        );
        assert_eq!(StageRuntimes::reasons_if_all_refuse(&[], "julia"), None);
        let refused = StageRuntimes::reasons_if_all_refuse(&stages, "julia").unwrap();
        assert!(
            refused.contains("“Main”") && refused.contains("“Late”"),
            "{refused}"
        );
    }

    #[test]
    fn runtimes_without_valid_names_are_refused() {
        let check = |names: &[&str]| stage("Main", names).runtimes.check();
        assert_eq!(check(&["python3", "my.runtime_2-x"]), Ok(()));
        assert_eq!(check(&[]), Err(InvalidRuntimes::None));
        for wrong in ["", "../x", "a b", &"a".repeat(MAX_NAME_CHARS + 1)] {
            assert_eq!(
                check(&["native", wrong]),
                Err(InvalidRuntimes::Name(wrong.to_owned()))
            );
        }
    }
}
