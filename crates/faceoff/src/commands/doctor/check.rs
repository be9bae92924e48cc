//! The result type of the checks of `faceoff doctor`.

use serde::Serialize;

/// The result of a check: `fix` says how to fix a problem, and is `None` if there is none.
#[derive(Debug, PartialEq, Eq, Serialize)]
pub struct Check {
    pub name: &'static str,
    pub found: String,
    #[serde(rename = "cure")]
    pub fix: Option<String>,
}
