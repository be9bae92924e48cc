//! The data of a game that the page's script animates, as JSON that contains only numbers.

use super::recording::RecordedGame;
use faceoff_types::CONTROL_STEP_S;
use serde_json::{Value, json};

/// Positions are rounded to whole millimetres, of which two are a pixel of the picture.
const MM_PER_M: f64 = 1e3;

/// The positions (mm) as differences between consecutive samples, which have few digits; for each rally, its first and last sample
/// and the score before it; and for each side, the spans of samples with a violation, each as first and last sample.
pub fn json(game: &RecordedGame) -> Value {
    // A column of differences; the first entry is the difference from 0.
    let column = |value: &dyn Fn(usize) -> f64| -> Vec<i64> {
        let mut previous = 0;
        (0..game.samples.len())
            .map(|sample| {
                let rounded = (value(sample) * MM_PER_M).round() as i64;
                rounded - std::mem::replace(&mut previous, rounded)
            })
            .collect()
    };
    let samples = &game.samples;
    let positions: Vec<Vec<i64>> = vec![
        column(&|sample| samples[sample].puck[0]),
        column(&|sample| samples[sample].puck[1]),
        column(&|sample| samples[sample].mallets[0][0]),
        column(&|sample| samples[sample].mallets[0][1]),
        column(&|sample| samples[sample].mallets[1][0]),
        column(&|sample| samples[sample].mallets[1][1]),
    ];
    let mut score = [0; 2];
    let rallies: Vec<[u32; 4]> = game
        .course
        .rallies
        .iter()
        .map(|rally| {
            let [first, second] = std::mem::replace(&mut score, rally.score);
            [rally.game_step, rally.end_step(), first, second]
        })
        .collect();
    json!({
        "step_s": CONTROL_STEP_S,
        "positions": positions,
        "rallies": rallies,
        "score": score,
        "violations": game.course.sides.each_ref().map(|side| {
            let violations = side.iter().flat_map(|side| &side.violations);
            joined(violations.map(|violation| violation.samples))
        }),
    })
}

/// Joins spans that overlap or touch. They are in the order of their first samples.
fn joined(spans: impl Iterator<Item = [u32; 2]>) -> Vec<[u32; 2]> {
    let mut joined: Vec<[u32; 2]> = Vec::new();
    for [from, to] in spans {
        match joined.last_mut() {
            Some([_, last]) if from <= *last + 1 => *last = to.max(*last),
            _ => joined.push([from, to]),
        }
    }
    joined
}
