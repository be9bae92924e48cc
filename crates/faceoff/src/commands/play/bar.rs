//! The progress bar of `faceoff play`.

use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};

/// A progress bar, shown if standard error is a terminal.
pub(super) struct Bar {
    bar: ProgressBar,
    /// Text before the score: the name of the game's folder in a series, or empty.
    title: String,
}

impl Bar {
    /// A bar of `steps` control steps.
    pub(super) fn steps(steps: u32) -> anyhow::Result<Self> {
        let style = ProgressStyle::with_template(
            "{msg:9} {bar:40} {pos}/{len} steps, {per_sec}, {eta} left",
        )
        .context("the progress bar's template")?;
        let bar = ProgressBar::new(u64::from(steps)).with_style(style);
        bar.set_message("0 : 0");
        Ok(Self {
            bar,
            title: String::new(),
        })
    }

    /// Starts the next game of a series. `finished_steps` are those of finished games, without failed attempts; `total_steps`
    /// are those of the series.
    pub(super) fn start_game(&mut self, title: &str, finished_steps: u64, total_steps: u64) {
        self.title = format!("{title} ");
        self.bar.set_length(total_steps);
        self.bar.set_position(finished_steps);
        self.bar.set_message(format!("{title} 0 : 0"));
    }

    /// The bar, for lines that another thread prints above it.
    pub(super) fn printer(&self) -> ProgressBar {
        self.bar.clone()
    }

    /// Runs `print_line`, whose output appears above the bar.
    pub(super) fn print_above(&self, print_line: impl FnOnce()) {
        self.bar.suspend(print_line);
    }

    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
    }

    /// Counts a control step.
    pub(super) fn add_step(&self) {
        self.bar.inc(1);
    }

    pub(super) fn show_score(&self, [first, second]: [u32; 2]) {
        self.bar
            .set_message(format!("{}{first} : {second}", self.title));
    }
}
