//! Parser of `agent.toml`, which names an agent and says how to start it. A *bundle* is the archive that a team submits; it contains
//! this file and the agent's program.

use faceoff_types::{ActionSpace, escape_unprintable, is_printable};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Largest `agent.toml`, in bytes.
pub const MANIFEST_MAX_BYTES: u64 = 64 * 1024;

/// `agent.toml`: the description of a bundle and of how to start its agent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// The agent's name, 1 to 60 characters, as shown on boards.
    pub name: String,
    /// Program and arguments; the working directory is the bundle's folder.
    pub command: Vec<String>,
    /// Name of the runtime (language environment, such as `python3`) that the agent needs. The runner checks whether the server
    /// offers it.
    pub runtime: String,
    /// Code of the interpolation that the agent's `ready` must have, if given here. TOML has no null: an agent that sends whole
    /// trajectories omits the key and has `null` in `ready`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interpolation: Option<i64>,
    /// What the agent's standard output is.
    #[serde(default, skip_serializing_if = "StandardOutput::is_answers")]
    pub stdout: StandardOutput,
    /// Environment variables for the agent, at most 64.
    #[serde(default)]
    pub env: BTreeMap<String, String>,
}

/// What an agent's standard output is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StandardOutput {
    /// The answers of the protocol; questions come from standard input.
    #[default]
    Answers,
    /// Part of the log, like standard error, for programs that cannot be kept quiet. The protocol uses the file descriptors 3 (questions)
    /// and 4 (answers).
    Log,
}

impl StandardOutput {
    const fn is_answers(&self) -> bool {
        matches!(self, Self::Answers)
    }
}

/// The reason for refusing an `agent.toml`; shown to the team.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ManifestError {
    /// Not TOML, or with a missing or unknown key, or a value of a wrong type.
    #[error("agent.toml: {0}")]
    Toml(String),
    /// An invalid value.
    #[error("agent.toml: {key} {problem}")]
    Value {
        /// The key in `agent.toml`.
        key: String,
        /// What is wrong with the value.
        problem: String,
    },
}

impl Manifest {
    /// Parses and checks the text of an `agent.toml`.
    ///
    /// # Errors
    /// Names the invalid key and what is expected.
    pub fn parse(text: &str) -> Result<Self, ManifestError> {
        if text.len() as u64 > MANIFEST_MAX_BYTES {
            return Err(ManifestError::Toml(format!(
                "longer than {MANIFEST_MAX_BYTES} bytes"
            )));
        }
        let manifest: Self = toml::from_str(text).map_err(|error| {
            // The error quotes the text, which may contain unprintable characters.
            ManifestError::Toml(escape_unprintable(&error.to_string()).into_owned())
        })?;
        manifest.check()?;
        Ok(manifest)
    }

    /// Is this a valid name of an environment variable: a letter or `_`, then letters, digits and `_`, at most 128 bytes?
    #[must_use]
    pub fn is_variable_name(name: &str) -> bool {
        name.len() <= 128
            && name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
            && name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_')
    }

    /// Is this a valid value of an environment variable: at most 4096 bytes, without NUL?
    #[must_use]
    pub fn is_variable_value(value: &str) -> bool {
        value.len() <= 4096 && !value.contains('\0')
    }

    /// Checks that the competition has the interpolation.
    ///
    /// # Errors
    /// Names the interpolations that there are.
    pub fn check_interpolation(&self, actions: &ActionSpace) -> Result<(), ManifestError> {
        let Some(code) = self.interpolation else {
            return Ok(());
        };
        if !actions.agents_choose_layout {
            let problem = format!("is {code}: leave it out, the competition has none");
            return require(false, "interpolation", &problem);
        }
        let numbers: Vec<String> = actions
            .codes()
            .flatten()
            .map(|code| code.to_string())
            .collect();
        let null = if actions.find(None).is_some() {
            "; for null leave it out and answer hello with null"
        } else {
            ""
        };
        let problem = format!("is {code}: expected one of {}{null}", numbers.join(", "));
        require(
            actions.find(Some(code)).is_some(),
            "interpolation",
            &problem,
        )
    }

    fn check(&self) -> Result<(), ManifestError> {
        let chars = self.name.chars().count();
        require(
            (1..=60).contains(&chars) && self.name.chars().all(is_printable),
            "name",
            "must have 1 to 60 characters, none that steers a terminal, is invisible or turns the \
             writing direction",
        )?;
        require(
            !self.command.is_empty(),
            "command",
            "must name a program, e.g. [\"python3\", \"agent.py\"]",
        )?;
        require(
            !self.command[0].is_empty(),
            "command",
            "must not start with an empty word",
        )?;
        require(
            self.command.len() <= 64 && self.command.iter().all(|word| word.len() <= 4096),
            "command",
            "must have at most 64 words of at most 4096 bytes",
        )?;
        require(
            !self.command.iter().any(|word| word.contains('\0')),
            "command",
            "must not contain NUL characters",
        )?;
        let is_runtime_name = (1..=40).contains(&self.runtime.len())
            && self
                .runtime
                .bytes()
                .all(|b| b.is_ascii_alphanumeric() || b"._-".contains(&b));
        require(
            is_runtime_name,
            "runtime",
            "must be a runtime's name: letters, digits, dots, dashes and underscores",
        )?;
        require(
            self.env.len() <= 64,
            "env",
            "must have at most 64 variables",
        )?;
        for (name, value) in &self.env {
            let key: String = format!("env.{}", escape_unprintable(name))
                .chars()
                .take(80)
                .collect();
            require(
                Self::is_variable_name(name),
                &key,
                "must be a name of letters, digits and underscores",
            )?;
            require(
                Self::is_variable_value(value),
                &key,
                "must have at most 4096 bytes and no NUL characters",
            )?;
        }
        Ok(())
    }
}

fn require(condition: bool, key: &str, problem: &str) -> Result<(), ManifestError> {
    if condition {
        Ok(())
    } else {
        Err(ManifestError::Value {
            key: key.to_owned(),
            problem: problem.to_owned(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_types::ActionLayout;

    const VALID_MANIFEST: &str = r#"
        name = "striker"
        command = ["python3", "agent.py"]
        runtime = "python3"
        interpolation = 3
        [env]
        OMP_NUM_THREADS = "1"
    "#;

    #[test]
    fn manifest_example_of_the_protocol_is_read() {
        let manifest = Manifest::parse(VALID_MANIFEST).unwrap();
        assert_eq!(manifest.name, "striker");
        assert_eq!(manifest.command, ["python3", "agent.py"]);
        assert_eq!(manifest.interpolation, Some(3));
        assert_eq!(manifest.env["OMP_NUM_THREADS"], "1");
        let reparsed = Manifest::parse(&toml::to_string(&manifest).unwrap()).unwrap();
        assert_eq!(reparsed, manifest);
    }

    #[test]
    fn standard_output_may_be_the_log() {
        let manifest = Manifest::parse(VALID_MANIFEST).unwrap();
        assert_eq!(manifest.stdout, StandardOutput::Answers);
        assert!(!toml::to_string(&manifest).unwrap().contains("stdout"));
        let text = VALID_MANIFEST.replace("[env]", "stdout = \"log\"\n[env]");
        let manifest = Manifest::parse(&text).unwrap();
        assert_eq!(manifest.stdout, StandardOutput::Log);
        let written = toml::to_string(&manifest).unwrap();
        assert_eq!(Manifest::parse(&written).unwrap(), manifest);
    }

    #[test]
    fn manifest_error_names_the_key() {
        for (from, to, expected_words) in [
            ("name = \"striker\"", "", "missing field `name`"),
            ("name = \"striker\"", "name = \"\"", "name must have"),
            (
                "name = \"striker\"",
                "name = \"a\\u202eb\"",
                "name must have",
            ),
            ("name = \"striker\"", "\u{202e}", "\\u202e"),
            (
                "[\"python3\", \"agent.py\"]",
                "[]",
                "command must name a program",
            ),
            (
                "[\"python3\", \"agent.py\"]",
                "\"python3 agent.py\"",
                "expected a sequence",
            ),
            (
                "runtime = \"python3\"",
                "runtime = \"../x\"",
                "runtime must be",
            ),
            (
                "interpolation = 3",
                "interpretation = 3",
                "unknown field `interpretation`",
            ),
            ("OMP_NUM_THREADS", "\"A=B\"", "env.A=B must be a name"),
            (
                "interpolation = 3",
                "stdout = \"null\"",
                "unknown variant `null`, expected `answers` or `log`",
            ),
        ] {
            assert!(VALID_MANIFEST.contains(from), "{from}");
            let message = Manifest::parse(&VALID_MANIFEST.replace(from, to))
                .unwrap_err()
                .to_string();
            assert!(
                message.contains(expected_words),
                "{message:?} lacks {expected_words:?}"
            );
        }
        assert!(Manifest::parse(&" ".repeat(MANIFEST_MAX_BYTES as usize + 1)).is_err());
    }

    #[test]
    fn unknown_interpolation_is_refused_with_the_known_ones() {
        let mut manifest = Manifest::parse(VALID_MANIFEST).unwrap();
        let layout = |code| ActionLayout::new(code, &[2]);
        let stated = ActionSpace {
            agents_choose_layout: true,
            layouts: [Some(3), Some(-1), None].map(layout).into(),
        };
        assert_eq!(manifest.check_interpolation(&stated), Ok(()));
        let single = ActionSpace {
            agents_choose_layout: false,
            layouts: vec![layout(None)],
        };
        let refused = |manifest: &Manifest, actions| {
            let checked = manifest.check_interpolation(actions);
            checked.unwrap_err().to_string()
        };
        assert_eq!(
            refused(&manifest, &single),
            "agent.toml: interpolation is 3: leave it out, the competition has none"
        );
        manifest.interpolation = Some(0);
        assert_eq!(
            refused(&manifest, &stated),
            "agent.toml: interpolation is 0: expected one of 3, -1; for null leave it out and answer hello with null"
        );
        manifest.interpolation = None;
        assert_eq!(manifest.check_interpolation(&single), Ok(()));
    }
}
