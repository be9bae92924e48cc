use crate::StageName;
use serde::{Deserialize, Serialize};
use std::{collections::BTreeSet, fmt};

/// The longest name of a runtime.
const MAX_NAME_CHARS: usize = 40;

/// The runtime of an agent that comes as a container image and brings its own; no server's runtime has this name.
pub const IMAGE_RUNTIME: &str = "image";

/// Some of the runtimes that a server offers, by the names that `agent.toml` gives them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(transparent)]
pub struct Runtimes(BTreeSet<String>);

/// Runtimes that no agent can have.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum InvalidRuntimes {
    #[error("expected one runtime at least, or null for all that the server offers, got none")]
    None,
    /// No name that `agent.toml` could give.
    #[error(
        "expected names of 1 to {MAX_NAME_CHARS} letters, digits, dots, dashes and underscores, got {0:?}"
    )]
    Name(String),
}

impl Runtimes {
    /// Can an agent have one of them?
    ///
    /// # Errors
    /// If there is none, or one is no name.
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

    /// Is it one of them?
    #[must_use]
    pub fn contains(&self, runtime: &str) -> bool {
        self.0.contains(runtime)
    }

    /// Their names, in the order of the alphabet.
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

/// A stage that takes agents of some runtimes only.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StageRuntimes {
    /// As the organiser named it.
    pub stage: StageName,
    pub runtimes: Runtimes,
}

/// An agent does not play in a stage, since that does not take its runtime.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the stage “{}” takes agents of the runtime {} only, and {}", .by.stage, .by.runtimes, told(.runtime.as_deref()))]
pub struct RuntimeNotTaken {
    by: StageRuntimes,
    runtime: Option<String>,
}

fn told(runtime: Option<&str>) -> String {
    match runtime {
        Some(runtime) => format!("this one names {runtime} in agent.toml"),
        None => "this one's is not known: it was checked before stages told runtimes apart; upload it again".to_owned(),
    }
}

impl StageRuntimes {
    /// Does the stage take an agent of this runtime? `None` is one that is not known.
    ///
    /// # Errors
    /// If it does not.
    pub fn check(&self, runtime: Option<&str>) -> Result<(), RuntimeNotTaken> {
        match runtime {
            Some(runtime) if self.runtimes.contains(runtime) => Ok(()),
            _ => Err(RuntimeNotTaken {
                by: self.clone(),
                runtime: runtime.map(str::to_owned),
            }),
        }
    }

    /// Why none of these stages takes a runtime; `None` if one does, or there is none.
    #[must_use]
    pub fn refused_by_all(stages: &[Self], runtime: &str) -> Option<String> {
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
    fn a_stage_takes_its_runtimes_and_says_which_they_are() {
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
    fn what_one_stage_takes_is_refused_by_none() {
        let stages = [stage("Main", &["native"]), stage("Late", &["python3"])];
        assert_eq!(StageRuntimes::refused_by_all(&stages, "python3"), None);
        assert_eq!(StageRuntimes::refused_by_all(&[], "julia"), None);
        let refused = StageRuntimes::refused_by_all(&stages, "julia").unwrap();
        assert!(
            refused.contains("“Main”") && refused.contains("“Late”"),
            "{refused}"
        );
    }

    #[test]
    fn runtimes_that_no_agent_can_have_are_refused() {
        let check = |names: &[&str]| stage("Main", names).runtimes.check();
        assert_eq!(check(&["python3", "my.runtime_2-x"]), Ok(()));
        assert_eq!(check(&[]), Err(InvalidRuntimes::None));
        for wrong in ["", "../x", "a b", &"a".repeat(41)] {
            assert_eq!(
                check(&["native", wrong]),
                Err(InvalidRuntimes::Name(wrong.to_owned()))
            );
        }
    }
}
