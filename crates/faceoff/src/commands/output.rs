//! Output that several commands share: text or JSON, and the progress of downloads.

use crate::client::DownloadedFile;
use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};

/// Joins the lines; `fallback` replaces an empty list.
pub(super) fn lines_or(lines: Vec<String>, fallback: &str) -> String {
    if lines.is_empty() {
        fallback.to_owned()
    } else {
        lines.join("\n")
    }
}

/// Prints a value as JSON, or as text.
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

/// The progress bar of a download, shown if standard error is a terminal.
pub(super) fn download_bar() -> anyhow::Result<ProgressBar> {
    let style = "downloading {bar:40} {bytes}/{total_bytes}, {bytes_per_sec}, {eta} left";
    let style = ProgressStyle::with_template(style).context("the progress bar's template")?;
    Ok(ProgressBar::new(0).with_style(style))
}

/// One line about a finished download.
pub(super) fn download_text(done: &DownloadedFile) -> String {
    let resumed = match done.resumed_at {
        0 => String::new(),
        bytes => format!(" (resumed after {bytes})"),
    };
    let checked = if done.checked { " (verified)" } else { "" };
    format!(
        "{}: {} bytes{resumed}, BLAKE3 {}{checked}",
        done.file.display(),
        done.bytes,
        done.blake3
    )
}
