//! The environment variables of a container image (`ENV` in a Dockerfile).

use super::messages::invalid;
use crate::bundle::error::BundleError;
use faceoff_types::escape_unprintable;
use faceoff_wire::Manifest;
use std::collections::BTreeMap;

/// Maximum number of variables: more than the images of large frameworks have.
const MAX_VARIABLES: usize = 128;
/// Limit for all names and values together. With the variables of `agent.toml` this is far below the system's limit.
const MAX_BYTES: usize = 64 << 10;

/// Parses the variables of an image's `ENV`, each `NAME=VALUE`. Of two variables with the same name, the later one
/// applies. Names that no shell supports are left out: an image inherits them from its base image and cannot remove
/// them.
pub(super) fn parse(entries: &[String]) -> Result<BTreeMap<String, String>, BundleError> {
    if entries.len() > MAX_VARIABLES {
        return Err(invalid(format_args!(
            "sets {} variables (ENV); at most {MAX_VARIABLES} are allowed",
            entries.len()
        )));
    }
    if entries.iter().map(String::len).sum::<usize>() > MAX_BYTES {
        return Err(invalid(format_args!(
            "sets variables (ENV) of more than {MAX_BYTES} bytes"
        )));
    }
    let parse_entry = |entry: &String| {
        let shown = |text: &str| {
            escape_unprintable(text)
                .chars()
                .take(80)
                .collect::<String>()
        };
        let Some((name, value)) = entry.split_once('=') else {
            return Err(invalid(format_args!(
                "sets the variable {:?} (ENV): expected NAME=VALUE",
                shown(entry)
            )));
        };
        if !Manifest::is_variable_name(name) {
            return Ok(None);
        }
        if !Manifest::is_variable_value(value) {
            return Err(invalid(format_args!(
                "sets the variable {:?} (ENV) to a value that is too long or holds a NUL character: at \
                 most 4096 bytes",
                shown(name)
            )));
        }
        Ok(Some((name.to_owned(), value.to_owned())))
    };
    entries
        .iter()
        .filter_map(|entry| parse_entry(entry).transpose())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The parsed variables, or the error, as a text.
    fn result_text(entries: &[&str]) -> String {
        let entries: Vec<String> = entries.iter().map(|&entry| entry.to_owned()).collect();
        match parse(&entries) {
            Ok(variables) => format!("{variables:?}"),
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn names_that_no_shell_can_use_are_left_out() {
        assert_eq!(
            result_text(&["A=b=c", "B=", "A=d"]),
            r#"{"A": "d", "B": ""}"#
        );
        for wrong in ["", "A"] {
            assert!(
                result_text(&[wrong]).contains("expected NAME=VALUE"),
                "{wrong:?}"
            );
        }
        for unsupported in [
            "=x",
            "a-b=c",
            "discovery.type=x",
            "1A=x",
            "A\u{202e}=x",
            "A\0=x",
        ] {
            assert_eq!(
                result_text(&[unsupported, "A=b"]),
                r#"{"A": "b"}"#,
                "{unsupported:?}"
            );
        }
        let long = format!("A={}", "x".repeat(4097));
        assert!(result_text(&[&long]).contains("too long"));
        assert!(result_text(&["A=\0"]).contains("NUL"));
        let many = vec!["A=b"; MAX_VARIABLES + 1];
        assert!(result_text(&many).contains("at most 128"));
        let half = format!("A={}", "x".repeat(4000));
        assert!(result_text(&vec![half.as_str(); 20]).contains("more than 65536 bytes"));
    }
}
