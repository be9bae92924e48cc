use crate::client::Downloaded;
use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};

/// The lines, or what stands in their place.
pub(super) fn or_none(lines: Vec<String>, none: &str) -> String {
    if lines.is_empty() {
        none.to_owned()
    } else {
        lines.join("\n")
    }
}

/// Prints what the server answered: as it came, or as text.
pub(super) fn print<T: serde::Serialize>(
    json: bool,
    value: &T,
    text: impl FnOnce() -> String,
) -> anyhow::Result<()> {
    if json {
        println!(
            "{}",
            serde_json::to_string_pretty(value).context("writing JSON")?
        );
    } else {
        println!("{}", text());
    }
    Ok(())
}

/// Shows how far a download is, if standard error is a terminal.
pub(super) fn download_bar() -> anyhow::Result<ProgressBar> {
    let style = "downloading {bar:40} {bytes}/{total_bytes}, {bytes_per_sec}, {eta} left";
    let style = ProgressStyle::with_template(style).context("the progress bar's template")?;
    Ok(ProgressBar::new(0).with_style(style))
}

/// What was downloaded, in words.
pub(super) fn downloaded(done: &Downloaded) -> String {
    let resumed = match done.resumed_at {
        0 => String::new(),
        at => format!(", the first {at} of which were there"),
    };
    let checked = if done.checked {
        ", as the server has it"
    } else {
        ""
    };
    format!(
        "{}: {} bytes{resumed}, BLAKE3 {}{checked}",
        done.file.display(),
        done.bytes,
        done.blake3
    )
}
