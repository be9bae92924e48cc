//! A chart of the scores of many teams over evaluation days. The first teams have a line style and a label of their own.

use super::scale::Tick;
use crate::format;
use jiff::civil::Date;

/// Teams with a label.
const LABELLED: usize = 5;
/// Plot area in units of the drawing, which is 760 × 260.
const LEFT: f64 = 38.0;
const RIGHT: f64 = 590.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 228.0;
/// The scale ends at a multiple of this score, percent, whose quarters are whole numbers.
const SCALE_STEP: f64 = 20.0;
/// Least distance between two labels, and the lowest position of one.
const LABEL_DISTANCE: f64 = 18.0;
const LOWEST_LABEL: f64 = 250.0;
const MAX_LABEL_CHARS: usize = 24;

/// A chart in the form that `chart.html` draws.
#[derive(Debug)]
pub(crate) struct TeamsChart {
    pub(crate) description: String,
    pub(crate) grid: Vec<Tick>,
    /// Labels of the first and the last day.
    pub(crate) days: [String; 2],
    pub(crate) lines: Vec<Line>,
}

/// The line of a team.
#[derive(Debug)]
pub(crate) struct Line {
    pub(crate) team: String,
    /// SVG path; of a single day, a dot.
    pub(crate) path: String,
    pub(crate) label: Option<Label>,
}

/// A team's name at the end of its line.
#[derive(Debug)]
pub(crate) struct Label {
    /// From 1, in the order of the board: the style of the line.
    pub(crate) style: usize,
    pub(crate) text: String,
    /// End of the line, and position of the label.
    pub(crate) end: [String; 2],
    pub(crate) y: String,
}

impl TeamsChart {
    /// `span`: first and last day, which differ; `teams`: name and scores of each team, the first of the board first.
    pub(crate) fn new<'a>(
        span: (Date, Date),
        teams: impl Iterator<Item = (&'a str, &'a [(Date, f64)])>,
    ) -> Self {
        let teams: Vec<_> = teams.collect();
        let all = teams.iter().flat_map(|(_, scores)| scores.iter());
        let best = all.map(|(_, score)| *score).fold(0.0, f64::max);
        let max = (best / SCALE_STEP).ceil().max(1.0) * SCALE_STEP;
        let y = |score: f64| BOTTOM - (BOTTOM - TOP) * (score / max).clamp(0.0, 1.0);
        let days = |from: Date, to: Date| f64::from((to - from).get_days());
        let x = |day: Date| LEFT + (RIGHT - LEFT) * days(span.0, day) / days(span.0, span.1);
        let mut labels: Vec<(usize, f64)> = Vec::new();
        let mut lines: Vec<Line> = Vec::new();
        let mut ends = Vec::new();
        for (index, (team, scores)) in teams.into_iter().enumerate() {
            let mut path = String::new();
            for (number, (day, score)) in scores.iter().enumerate() {
                let letter = if number == 0 { 'M' } else { 'L' };
                let [x, y] = [x(*day), y(*score)].map(format::one_decimal);
                path.push_str(&format!("{letter}{x} {y}"));
            }
            if scores.len() == 1 {
                path.push_str("h0");
            }
            if let Some((day, score)) = scores.last()
                && index < LABELLED
            {
                labels.push((lines.len(), y(*score)));
                ends.push([x(*day), y(*score)].map(format::one_decimal));
            }
            lines.push(Line {
                team: team.to_owned(),
                path,
                label: None,
            });
        }
        let positions = spread_labels(labels.iter().map(|(_, y)| *y).collect());
        for ((style, ((index, _), position)), end) in
            (1..).zip(labels.iter().zip(positions)).zip(ends)
        {
            let line = &mut lines[*index];
            line.label = Some(Label {
                style,
                text: shortened(&line.team),
                end,
                y: format::one_decimal(position),
            });
        }
        Self {
            description: description(span, &lines),
            grid: [0.0, 0.25, 0.5, 0.75, 1.0]
                .map(|part| Tick {
                    position: format::one_decimal(y(part * max)),
                    label: format!("{:.0}", part * max),
                })
                .into(),
            days: [span.0, span.1].map(|day| day.strftime("%-d %B").to_string()),
            lines,
        }
    }
}

/// Moves labels down until none overlaps, then up from the lowest position.
fn spread_labels(wanted: Vec<f64>) -> Vec<f64> {
    let mut order: Vec<usize> = (0..wanted.len()).collect();
    order.sort_by(|a, b| wanted[*a].total_cmp(&wanted[*b]));
    let mut positions = wanted;
    let mut least = f64::NEG_INFINITY;
    for index in &order {
        positions[*index] = positions[*index].max(least);
        least = positions[*index] + LABEL_DISTANCE;
    }
    let mut most = LOWEST_LABEL;
    for index in order.iter().rev() {
        positions[*index] = positions[*index].min(most);
        most = positions[*index] - LABEL_DISTANCE;
    }
    positions
}

fn shortened(team: &str) -> String {
    match team.char_indices().nth(MAX_LABEL_CHARS) {
        Some((end, _)) => format!("{}…", &team[..end]),
        None => team.to_owned(),
    }
}

fn description((first, last): (Date, Date), lines: &[Line]) -> String {
    let [first, last] = [first, last].map(|day| day.strftime("%-d %B").to_string());
    let named: Vec<&str> = lines
        .iter()
        .filter(|line| line.label.is_some())
        .map(|line| line.team.as_str())
        .collect();
    format!(
        "Scores of {} teams from {first} to {last}. With a label: {}",
        lines.len(),
        named.join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use jiff::civil::date;

    #[test]
    fn first_teams_have_labels_that_do_not_overlap() {
        let span = (date(2026, 3, 1), date(2026, 3, 3));
        let scores = [(span.0, 50.0), (span.1, 50.0)];
        let names = ["A", "B", "C", "D", "E", "F", "G"];
        let chart = TeamsChart::new(span, names.iter().map(|name| (*name, &scores[..])));
        assert_eq!(chart.lines.len(), names.len());
        let mut positions: Vec<f64> = chart
            .lines
            .iter()
            .filter_map(|line| line.label.as_ref())
            .map(|label| label.y.parse().unwrap())
            .collect();
        assert_eq!(positions.len(), LABELLED);
        positions.sort_by(f64::total_cmp);
        for pair in positions.windows(2) {
            assert!(pair[1] - pair[0] >= LABEL_DISTANCE, "{positions:?}");
        }
        // The scale ends at 60 %.
        assert_eq!(chart.lines[0].path, "M38.0 48.0L590.0 48.0");
        assert!(chart.description.starts_with("Scores of 7 teams"));
    }

    #[test]
    fn labels_stay_inside_of_the_drawing() {
        let positions = spread_labels(vec![249.0, 249.0, 12.0]);
        assert_eq!(positions, [232.0, 250.0, 12.0]);
    }
}
