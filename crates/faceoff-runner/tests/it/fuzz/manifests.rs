//! Fuzz test of manifests (`agent.toml`): each is parsed, or the wrong key is named.

use super::{assert_outcomes, fuzz, mutation::mutate};
use faceoff_types::is_printable;
use faceoff_wire::{Manifest, ManifestError};

const VALID: [&str; 2] = [
    "name = \"striker\"\ncommand = [\"python3\", \"agent.py\"]\nruntime = \"python3\"\n\
     interpolation = 3\n[env]\nOMP_NUM_THREADS = \"1\"\nA = \"b\"\n",
    "# a comment\nname = 'x'\ncommand = ['''./agent''']\nruntime = \"native\"\nenv = { A = \"\\u0061\" }\n",
];

/// Texts that mutations insert.
const WORDS: [&str; 25] = [
    "\"\"",
    "''",
    "[]",
    "{}",
    "[\"\"]",
    "0",
    "-1",
    "99",
    "true",
    "inf",
    "\\u0000",
    "\\u202e",
    "\u{202e}",
    "../x",
    "a b",
    "=",
    "\n",
    "[env]",
    "name = \"y\"\n",
    "\"A=B\" = \"c\"\n",
    "1 = \"c\"\n",
    "interpolation",
    "stdout = \"log\"\n",
    "command = [\"\"]\n",
    "\u{1b}[2J",
];

#[test]
fn manifest_is_parsed_or_its_key_is_named() {
    let actions = faceoff_airhockey::action_space();
    let outcomes = fuzz("manifests", 30_000, |rng| {
        let mut text = rng.pick(&VALID).as_bytes().to_vec();
        mutate(&mut text, &WORDS, rng);
        let text = String::from_utf8_lossy(&text);
        let parsed = Manifest::parse(&text).and_then(|manifest| {
            manifest.check_interpolation(&actions)?;
            Ok(manifest)
        });
        match parsed {
            Ok(manifest) => {
                assert!(manifest.name.chars().all(is_printable));
                let reparsed = Manifest::parse(&toml_of(&manifest)).unwrap();
                assert_eq!(reparsed, manifest);
                "accepted".to_owned()
            }
            Err(error) => {
                let message = error.to_string();
                assert!(
                    message
                        .chars()
                        .all(|c| is_printable(c) || "\n\t\r".contains(c)),
                    "{message:?}"
                );
                match error {
                    ManifestError::Toml(_) => "not toml".to_owned(),
                    ManifestError::Value { key, .. } => {
                        let key = key.split_once('.').map_or(&*key, |(table, _)| table);
                        format!("value of {key}")
                    }
                }
            }
        }
    });
    assert_outcomes(
        &outcomes,
        &[
            "accepted",
            "not toml",
            "value of name",
            "value of command",
            "value of runtime",
            "value of interpolation",
            "value of env",
        ],
    );
}

/// TOML's basic strings are the same as JSON's, except for one character.
fn toml_of(manifest: &Manifest) -> String {
    fn json<T: serde::Serialize>(value: &T) -> String {
        serde_json::to_string(value)
            .unwrap()
            .replace('\u{7f}', "\\u007f")
    }
    let Manifest {
        name,
        command,
        runtime,
        interpolation,
        stdout,
        env,
    } = manifest;
    let mut lines = vec![
        format!("name = {}", json(name)),
        format!("command = {}", json(command)),
        format!("runtime = {}", json(runtime)),
    ];
    lines.extend(interpolation.map(|code| format!("interpolation = {code}")));
    lines.push(format!("stdout = {}", json(stdout)));
    lines.push("[env]".to_owned());
    lines.extend(
        env.iter()
            .map(|(name, value)| format!("{name} = {}", json(value))),
    );
    lines.join("\n")
}
