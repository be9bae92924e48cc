//! Output that several commands share: text or JSON, times, and downloads with their progress.

use crate::client::DownloadedFile;
use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};
use jiff::Timestamp;
use serde::Serialize;

/// Joins the lines; `fallback` replaces an empty list.
pub(super) fn lines_or(lines: Vec<String>, fallback: &str) -> String {
    if lines.is_empty() {
        fallback.to_owned()
    } else {
        lines.join("\n")
    }
}

/// Prints a value as JSON, or as the text that `text` makes of it.
pub(super) fn print<T: Serialize + ?Sized>(
    json: bool,
    value: &T,
    text: impl FnOnce(&T) -> String,
) -> anyhow::Result<()> {
    if json {
        print_json(value)
    } else {
        println!("{}", text(value));
        Ok(())
    }
}

/// Prints a list as JSON, or as text with one `line` per entry; `fallback` replaces an empty list.
pub(super) fn print_list<T: Serialize>(
    json: bool,
    entries: &[T],
    line: impl Fn(&T) -> String,
    fallback: &str,
) -> anyhow::Result<()> {
    print(json, entries, |entries| {
        lines_or(entries.iter().map(line).collect(), fallback)
    })
}

/// Prints a value as JSON.
pub(super) fn print_json(value: &(impl Serialize + ?Sized)) -> anyhow::Result<()> {
    let json = serde_json::to_string_pretty(value).context("writing JSON")?;
    println!("{json}");
    Ok(())
}

/// A time to the minute.
pub(super) fn time_text(time: Timestamp) -> String {
    time.strftime("%Y-%m-%d %H:%M UTC").to_string()
}

/// A time to the second.
pub(super) fn exact_time_text(time: Timestamp) -> String {
    time.strftime("%Y-%m-%d %H:%M:%S UTC").to_string()
}

/// Downloads a file, shows the progress if standard error is a terminal, and prints where the file is.
pub(super) async fn print_download(
    json: bool,
    download: impl AsyncFnOnce(&ProgressBar) -> anyhow::Result<DownloadedFile>,
) -> anyhow::Result<()> {
    let style = "downloading {bar:40} {bytes}/{total_bytes}, {bytes_per_sec}, {eta} left";
    let style = ProgressStyle::with_template(style).context("the progress bar's template")?;
    let bar = ProgressBar::new(0).with_style(style);
    let done = download(&bar).await?;
    bar.finish_and_clear();
    print(json, &done, download_text)
}

/// One line about a finished download.
fn download_text(done: &DownloadedFile) -> String {
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
