//! An episode as output of `faceoff replay`: an HTML page from `templates/replay`, or one SVG picture.

use super::{
    plots::{self, Plots},
    recording::{EpisodeRecording, time_s},
    table_view,
};
use askama::Template;
use faceoff_types::escape_unprintable;

/// Width of the page's content and of the picture.
pub const WIDTH_PX: u32 = 900;
/// Height of the two lines of text above the table in the picture.
pub const TITLE_PX: u32 = 58;
/// Height of the drawn table as a fraction of the picture's width; the empty margin below the table is left out.
pub const TABLE_ASPECT: f64 = 0.55;

#[derive(Template)]
#[template(path = "replay/page.html")]
struct Page<'a> {
    recording: &'a EpisodeRecording,
    headline: String,
    /// Causes of penalty points.
    penalties: Vec<String>,
    duration_s: String,
    /// The table from above, as SVG.
    table: String,
    plots: Plots,
    /// Positions that the script animates, as JSON that contains only numbers.
    motion: String,
    /// Index of the last position.
    last: usize,
}

/// A self-contained page. Without JavaScript, it shows the paths and the final positions.
pub fn html(recording: &EpisodeRecording) -> anyhow::Result<String> {
    let motion = serde_json::json!({
        "puck": round(recording.puck.iter().map(|[x, y, _]| [*x, *y])),
        "observed": round(recording.observed_puck.iter().copied()),
        "mallet": round(recording.mallet.iter().copied()),
        // Recorded from the first step on.
        "opponent": round(recording.opponent.first().into_iter().chain(&recording.opponent).copied()),
        "step_s": time_s(1),
    });
    let page = Page {
        recording,
        headline: recording.headline(),
        penalties: recording.penalties(),
        duration_s: format!("{:.2}", time_s(recording.puck.len() - 1)),
        table: table_view::svg(recording, WIDTH_PX, "id=\"table\""),
        plots: plots::draw(recording, WIDTH_PX)?,
        motion: motion.to_string(),
        last: recording.puck.len() - 1,
    };
    Ok(page.render()?)
}

/// The content of the page as one picture.
pub fn svg(recording: &EpisodeRecording) -> anyhow::Result<String> {
    let plots = plots::draw(recording, WIDTH_PX)?;
    let table = table_view::svg(recording, WIDTH_PX, &format!("y=\"{TITLE_PX}\""));
    let table_px = f64::from(WIDTH_PX) * TABLE_ASPECT;
    let plots_top = f64::from(TITLE_PX) + table_px;
    let placed = plots
        .svg
        .replacen("<svg ", &format!("<svg y=\"{plots_top:.0}\" "), 1);
    Ok(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH_PX}\" height=\"{:.0}\" font-family=\"sans-serif\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n\
         <text x=\"8\" y=\"24\" font-size=\"18\">{}</text>\n<text x=\"8\" y=\"46\" font-size=\"13\">{}</text>\n\
         {table}{placed}</svg>\n",
        plots_top + f64::from(plots.height_px),
        escape(&recording.headline()),
        escape(&recording.end_reason),
    ))
}

pub fn escape(text: &str) -> String {
    escape_unprintable(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

/// Rounds to tenths of a millimetre, which is enough for a picture.
fn round(positions: impl Iterator<Item = [f64; 2]>) -> Vec<[f64; 2]> {
    positions
        .map(|position| position.map(|metres| (metres * 1e4).round() / 1e4))
        .collect()
}
