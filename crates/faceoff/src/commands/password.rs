//! Reads secrets from the terminal or from standard input, never from the command line, which other users can see.

use anyhow::{Context, bail};
use std::io::{IsTerminal, Read};

/// Reads a secret from standard input, to its end.
pub(super) fn read_stdin() -> anyhow::Result<String> {
    let mut text = String::new();
    std::io::stdin()
        .read_to_string(&mut text)
        .context("reading the secret from standard input")?;
    Ok(text.trim_end_matches(['\r', '\n']).to_owned())
}

/// Prompts for a secret at the terminal without echoing it.
///
/// # Errors
/// If there is no terminal; the error contains the `alternative`.
pub(super) fn prompt(question: &str, alternative: &str) -> anyhow::Result<String> {
    if !std::io::stdin().is_terminal() {
        bail!("standard input is not a terminal: {alternative}");
    }
    let answer = rpassword::prompt_password(question).context("reading from the terminal")?;
    Ok(answer)
}
