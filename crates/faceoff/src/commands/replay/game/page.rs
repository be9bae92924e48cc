//! A game as an HTML page from `templates/replay`, or a rally as one SVG picture.

use super::{
    super::page::{TABLE_ASPECT, TITLE_PX, WIDTH_PX, escape},
    clock,
    events::{self, GameEvent},
    motion,
    penalties::{self, Penalty},
    recording::RecordedGame,
    table,
};
use crate::competition::competition;
use askama::Template;
use faceoff_dataset::game::ListedRally;
use faceoff_scoring::tournament::SideScore;
use faceoff_types::{Competition, Side};

/// Control steps by which a link is earlier than its event: 2 s.
const LEAD_STEPS: u32 = 100;

#[derive(Template)]
#[template(path = "replay/game.html")]
struct Page<'a> {
    game: &'a RecordedGame,
    headline: String,
    result: String,
    sides: [SideRow<'a>; 2],
    competition: &'a Competition,
    duration: String,
    /// The picture of the table, as SVG.
    table: String,
    /// The rally that is shown without JavaScript.
    shown_rally: String,
    /// The texts of the rallies, and the first sample of each.
    rallies: Vec<(String, u32)>,
    events: Vec<EventRow<'a>>,
    penalties: Vec<PenaltyRow<'a>>,
    /// Index of the last sample.
    last: usize,
    /// The sample that the page shows first.
    start: u32,
    /// What the script animates, as JSON ([`motion::json`]).
    motion: String,
}

struct SideRow<'a> {
    number: u32,
    agent: &'a str,
    score: &'a SideScore,
    longest_answer_ms: String,
}

/// An event in the list and on the timeline.
struct EventRow<'a> {
    event: &'a GameEvent,
    clock: String,
    /// The time to which the event's link jumps, a little before the event, s.
    from_s: String,
    /// Horizontal position on the timeline, which is 1000 units wide.
    x: f64,
}

struct PenaltyRow<'a> {
    penalty: &'a Penalty,
    clock: String,
    /// As in [`EventRow`].
    from_s: String,
}

/// A self-contained page. Without JavaScript, it shows the events and the paths of one rally.
pub fn html(game: &RecordedGame, chosen: Option<&ListedRally>) -> anyhow::Result<String> {
    let shown = chosen.unwrap_or_else(|| game.last_rally());
    let last = game.samples.len() - 1;
    let (events, penalties) = (events::list(game), penalties::list(game));
    let scores = &game.course.score.sides;
    let side = |side: Side| SideRow {
        number: side.number(),
        agent: &game.agents[side.index()],
        score: &scores[side.index()],
        longest_answer_ms: format!("{:.1}", 1e3 * scores[side.index()].computation_time_s.max),
    };
    let rallies = game.course.rallies.iter();
    let page = Page {
        game,
        headline: game.headline(),
        result: game.result(),
        sides: Side::BOTH.map(side),
        competition: competition(),
        duration: clock::text(game.course.score.steps),
        table: table::svg(game, shown, WIDTH_PX, "id=\"table\""),
        shown_rally: game.rally_text(shown),
        rallies: rallies
            .map(|rally| (game.rally_text(rally), first_sample(rally)))
            .collect(),
        events: events
            .iter()
            .map(|event| EventRow {
                event,
                clock: clock::text(event.game_step),
                from_s: from_s(event.game_step),
                x: 1000.0 * f64::from(event.game_step) / (last.max(1) as f64),
            })
            .collect(),
        penalties: penalties
            .iter()
            .map(|penalty| PenaltyRow {
                penalty,
                clock: clock::text(penalty.game_step),
                from_s: from_s(penalty.game_step),
            })
            .collect(),
        last,
        start: chosen.map_or(0, first_sample),
        motion: motion::json(game).to_string(),
    };
    Ok(page.render()?)
}

/// The first sample that shows a rally, one control step after its serve. The sample at the serve still shows the end of the rally
/// before, unless the rally is the first.
pub fn first_sample(rally: &ListedRally) -> u32 {
    match rally.game_step {
        0 => 0,
        step => step + 1,
    }
}

fn from_s(step: u32) -> String {
    format!("{:.2}", clock::seconds(step.saturating_sub(LEAD_STEPS)))
}

/// A rally as one picture; the last one, unless another is chosen.
pub fn svg(game: &RecordedGame, chosen: Option<&ListedRally>) -> anyhow::Result<String> {
    let rally = chosen.unwrap_or_else(|| game.last_rally());
    let table_px = f64::from(WIDTH_PX) * TABLE_ASPECT;
    let [home, away] = &game.agents;
    Ok(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH_PX}\" height=\"{:.0}\" font-family=\"sans-serif\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n\
         <text x=\"8\" y=\"24\" font-size=\"18\">{}</text>\n<text x=\"8\" y=\"46\" font-size=\"13\">{}</text>\n\
         {}<text x=\"8\" y=\"{:.0}\" font-size=\"13\">left, blue: {}; right, ochre: {}; red: the puck (dashed: start)</text>\n</svg>\n",
        f64::from(TITLE_PX) + table_px + 30.0,
        escape(&game.headline()),
        escape(&game.rally_text(rally)),
        table::svg(game, rally, WIDTH_PX, &format!("y=\"{TITLE_PX}\"")),
        f64::from(TITLE_PX) + table_px + 16.0,
        escape(home),
        escape(away),
    ))
}
