use super::words::invalid;
use crate::bundle::error::BundleError;
use faceoff_types::harmless;
use faceoff_wire::Manifest;
use std::collections::BTreeMap;

/// More than the images of large frameworks have.
const MOST_VARIABLES: usize = 128;
/// Of all names and values, in bytes: with what `agent.toml` adds far below what a program can be passed.
const MOST_BYTES: usize = 64 << 10;

/// The variables of an image's `ENV`, each `NAME=VALUE`. Of two of one name the later one holds. Names that no
/// shell has are left out: an image has them from its base, and cannot be rid of them.
pub(super) fn read(entries: &[String]) -> Result<BTreeMap<String, String>, BundleError> {
    if entries.len() > MOST_VARIABLES {
        return Err(invalid(format_args!(
            "sets {} variables (ENV); at most {MOST_VARIABLES} are allowed",
            entries.len()
        )));
    }
    if entries.iter().map(String::len).sum::<usize>() > MOST_BYTES {
        return Err(invalid(format_args!(
            "sets variables (ENV) of more than {MOST_BYTES} bytes"
        )));
    }
    let read_one = |entry: &String| {
        let shown = |text: &str| harmless(text).chars().take(80).collect::<String>();
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
        .filter_map(|entry| read_one(entry).transpose())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(entries: &[&str]) -> String {
        let entries: Vec<String> = entries.iter().map(|&entry| entry.to_owned()).collect();
        match read(&entries) {
            Ok(read) => format!("{read:?}"),
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn variables_are_those_that_a_program_can_be_given() {
        assert_eq!(told(&["A=b=c", "B=", "A=d"]), r#"{"A": "d", "B": ""}"#);
        for wrong in ["", "A"] {
            assert!(told(&[wrong]).contains("expected NAME=VALUE"), "{wrong:?}");
        }
        for odd in [
            "=x",
            "a-b=c",
            "discovery.type=x",
            "1A=x",
            "A\u{202e}=x",
            "A\0=x",
        ] {
            assert_eq!(told(&[odd, "A=b"]), r#"{"A": "b"}"#, "{odd:?}");
        }
        let long = format!("A={}", "x".repeat(4097));
        assert!(told(&[&long]).contains("too long"));
        assert!(told(&["A=\0"]).contains("NUL"));
        let many = vec!["A=b"; MOST_VARIABLES + 1];
        assert!(told(&many).contains("at most 128"));
        let half = format!("A={}", "x".repeat(4000));
        assert!(told(&vec![half.as_str(); 20]).contains("more than 65536 bytes"));
    }
}
