use super::{
    plots::{self, Plots},
    recorded::{Recorded, time_s},
    table_view,
};
use askama::Template;
use faceoff_types::harmless;

const WIDTH_PX: u32 = 900;

#[derive(Template)]
#[template(path = "replay/page.html")]
struct Page<'a> {
    recorded: &'a Recorded,
    headline: String,
    losses: Vec<String>,
    duration_s: String,
    table: String,
    plots: Plots,
    /// What the script moves, as JSON of numbers alone.
    motion: String,
    last: usize,
}

/// A page that is complete by itself; without JavaScript it shows the paths and the end.
pub fn html(recorded: &Recorded) -> anyhow::Result<String> {
    let motion = serde_json::json!({
        "puck": rounded(recorded.puck.iter().map(|[x, y, _]| [*x, *y])),
        "seen": rounded(recorded.seen.iter().copied()),
        "mallet": rounded(recorded.mallet.iter().copied()),
        // Recorded from the first step on.
        "opponent": rounded(recorded.opponent.first().into_iter().chain(&recorded.opponent).copied()),
        "step_s": time_s(1),
    });
    let page = Page {
        recorded,
        headline: recorded.headline(),
        losses: recorded.losses(),
        duration_s: format!("{:.2}", time_s(recorded.puck.len() - 1)),
        table: table_view::svg(recorded, WIDTH_PX, "id=\"table\""),
        plots: plots::draw(recorded, WIDTH_PX)?,
        motion: motion.to_string(),
        last: recorded.puck.len() - 1,
    };
    Ok(page.render()?)
}

/// The same as one picture.
pub fn svg(recorded: &Recorded) -> anyhow::Result<String> {
    let plots = plots::draw(recorded, WIDTH_PX)?;
    let table = table_view::svg(recorded, WIDTH_PX, "y=\"58\"");
    let table_px = f64::from(WIDTH_PX) * 0.55;
    let plots_top = 58.0 + table_px;
    let placed = plots
        .svg
        .replacen("<svg ", &format!("<svg y=\"{plots_top:.0}\" "), 1);
    Ok(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH_PX}\" height=\"{:.0}\" font-family=\"sans-serif\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n\
         <text x=\"8\" y=\"24\" font-size=\"18\">{}</text>\n<text x=\"8\" y=\"46\" font-size=\"13\">{}</text>\n\
         {table}{placed}</svg>\n",
        plots_top + f64::from(plots.height_px),
        escaped(&recorded.headline()),
        escaped(&recorded.why),
    ))
}

fn escaped(text: &str) -> String {
    harmless(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

/// Tenths of a millimetre are enough for a picture.
fn rounded(places: impl Iterator<Item = [f64; 2]>) -> Vec<[f64; 2]> {
    places
        .map(|place| place.map(|metres| (metres * 1e4).round() / 1e4))
        .collect()
}
