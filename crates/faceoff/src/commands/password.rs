//! A password, from whoever sits at the terminal or from standard input; never from the command line, which others see.

use anyhow::{Context, bail};
use std::io::{IsTerminal, Read};

/// Reads one from standard input, to its end.
pub(super) fn from_input() -> anyhow::Result<String> {
    let mut text = String::new();
    std::io::stdin()
        .read_to_string(&mut text)
        .context("reading the password from standard input")?;
    Ok(text.trim_end_matches(['\r', '\n']).to_owned())
}

/// Asks for something secret at the terminal, which does not show it.
///
/// # Errors
/// If there is no terminal; `instead` says what to do then.
pub(super) fn ask(question: &str, instead: &str) -> anyhow::Result<String> {
    if !std::io::stdin().is_terminal() {
        bail!("there is no terminal to ask at: {instead}");
    }
    let answer = rpassword::prompt_password(question).context("asking at the terminal")?;
    Ok(answer)
}
