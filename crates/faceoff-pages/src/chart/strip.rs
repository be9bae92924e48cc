//! Times of several kinds on a logarithmic axis.

use super::scale::{RIGHT, Tick, short};
use crate::figures;

/// The axis of times begins and ends at these powers of ten of a millisecond.
const FIRST_DECADE: f64 = -2.0;
const LAST_DECADE: f64 = 3.0;
/// Words before the rows of a strip are as wide.
const STRIP_LEFT: f64 = 58.0;
/// From row to row, and where the rows have distributions above them.
const ROW: u32 = 24;
const TALL_ROW: u32 = 48;
/// The height of a distribution, and how far above its row it stands.
const SHAPE: f64 = 26.0;
const SHAPE_GAP: u32 = 8;
/// What an answer has: a control step, in milliseconds.
const STEP_MS: f64 = 20.0;

/// Times of one kind, in milliseconds.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Span {
    pub(crate) name: &'static str,
    pub(crate) mean: f64,
    pub(crate) p99: f64,
    pub(crate) max: f64,
    /// How many of them lie where, the shorter first; empty where that is not told.
    pub(crate) counted: Vec<Counted>,
}

/// So many times lie between two, in milliseconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Counted {
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) count: u64,
}

/// Times on a logarithmic axis, ready to be drawn by `chart.html`.
#[derive(Debug)]
pub(crate) struct Strip {
    pub(crate) rows: Vec<StripRow>,
    pub(crate) grid: Vec<Tick>,
    /// Are there distributions above the rows?
    pub(crate) has_shapes: bool,
    /// Where a control step ends.
    pub(crate) limit: String,
    /// Where the noise floor begins, and how wide it is.
    pub(crate) floor: Option<[String; 2]>,
    pub(crate) bottom: u32,
    pub(crate) height: u32,
    /// The distributions in numbers, a row for each of their columns.
    pub(crate) counts: Vec<CountRow>,
    /// What it shows in a sentence, for whoever does not see it.
    pub(crate) told: String,
}

/// How many times of each kind lie between two, in milliseconds.
#[derive(Debug)]
pub(crate) struct CountRow {
    pub(crate) from: String,
    pub(crate) to: String,
    /// In the order of the strip's rows.
    pub(crate) counts: Vec<u64>,
}

/// Where the times of one kind lie.
#[derive(Debug)]
pub(crate) struct StripRow {
    pub(crate) name: &'static str,
    pub(crate) y: u32,
    pub(crate) mean: String,
    pub(crate) p99: String,
    pub(crate) max: String,
    /// The distribution, an SVG path.
    pub(crate) shape: String,
}

impl Strip {
    /// `floor`: median and 99th percentile of what the server itself adds, in milliseconds.
    pub(crate) fn of(spans: &[Span], floor: Option<[f64; 2]>) -> Self {
        let has_shapes = spans.iter().any(|span| !span.counted.is_empty());
        let mut y = 0;
        let rows = spans.iter().map(|span| {
            y += if has_shapes { TALL_ROW } else { ROW };
            let [mean, p99, max] = [span.mean, span.p99, span.max].map(|ms| figures::one(at(ms)));
            StripRow {
                name: span.name,
                y,
                mean,
                p99,
                max,
                shape: shape(&span.counted, y - SHAPE_GAP),
            }
        });
        let rows = rows.collect();
        let bottom = y + ROW / 2;
        let grid = [0.01, 0.1, 1.0, 10.0, 100.0, 1000.0].map(|ms| Tick {
            at: figures::one(at(ms)),
            word: short(ms),
        });
        let told = spans.iter().map(|span| {
            let [mean, p99, max] = [span.mean, span.p99, span.max].map(short);
            format!(
                "{}: mean {mean}, 99th percentile {p99}, maximum {max}",
                span.name
            )
        });
        let told: Vec<String> = told.collect();
        Self {
            rows,
            grid: grid.into(),
            has_shapes,
            limit: figures::one(at(STEP_MS)),
            floor: floor.map(|[from, to]| [at(from), at(to) - at(from)].map(figures::one)),
            bottom,
            height: bottom + 20,
            counts: counts(spans),
            told: format!(
                "Answer times in milliseconds, of {STEP_MS} that a control step has; {}",
                told.join("; ")
            ),
        }
    }
}

/// Columns without any time are left out.
fn counts(spans: &[Span]) -> Vec<CountRow> {
    // All kinds have the same columns; some have fewer.
    let longest = spans
        .iter()
        .map(|span| &span.counted)
        .max_by_key(|all| all.len());
    let columns = longest.into_iter().flatten().enumerate();
    let rows = columns.map(|(column, of)| CountRow {
        from: figures::significant(of.from),
        to: figures::significant(of.to),
        counts: spans
            .iter()
            .map(|span| span.counted.get(column).map_or(0, |one| one.count))
            .collect(),
    });
    rows.filter(|row| row.counts.iter().any(|count| *count > 0))
        .collect()
}

/// Columns above `bottom`. Their heights are by the logarithm of the counts: few slow answers among thousands are what one
/// looks for.
fn shape(counted: &[Counted], bottom: u32) -> String {
    let height = |count: u64| (1.0 + count as f64).ln();
    let most = counted
        .iter()
        .map(|one| one.count)
        .max()
        .map_or(1.0, height);
    let columns = counted.iter().filter(|one| one.count > 0).map(|one| {
        let top = f64::from(bottom) - SHAPE * height(one.count) / most;
        let [left, right, top] = [at(one.from), at(one.to), top].map(figures::one);
        format!("M{left} {bottom}V{top}H{right}V{bottom}z")
    });
    columns.collect()
}

/// Where a time lies.
fn at(ms: f64) -> f64 {
    let decade = ms.max(f64::MIN_POSITIVE).log10();
    let share = (decade - FIRST_DECADE) / (LAST_DECADE - FIRST_DECADE);
    STRIP_LEFT + share.clamp(0.0, 1.0) * (RIGHT - STRIP_LEFT)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_stand_by_their_powers_of_ten_and_none_lies_outside() {
        let span = Span {
            name: "hit",
            mean: 0.1,
            p99: 10.0,
            max: 5000.0,
            counted: Vec::new(),
        };
        let strip = Strip::of(std::slice::from_ref(&span), Some([0.001, 1.0]));
        assert!(!strip.has_shapes && strip.height == 56, "{strip:?}");
        let counted = |from, to, count| Counted { from, to, count };
        let told = Span {
            counted: vec![
                counted(0.1, 1.0, 99),
                counted(1.0, 10.0, 0),
                counted(10.0, 100.0, 9),
            ],
            ..span
        };
        let tall = Strip::of(&[told], None);
        assert!(tall.has_shapes);
        assert_eq!(
            tall.rows[0].shape, "M115.6 40V14.0H173.2V40zM230.8 40V27.0H288.4V40z",
            "a tenth of the times is half as high; none is nothing"
        );
        let rows: Vec<_> = tall
            .counts
            .iter()
            .map(|row| (&*row.from, &*row.counts))
            .collect();
        assert_eq!(rows, [("0.10", &[99][..]), ("10", &[9])]);
        let row = &strip.rows[0];
        assert_eq!(
            [&row.mean, &row.p99, &row.max],
            ["115.6", "230.8", "346.0"],
            "a fifth, three fifths, and the end"
        );
        assert_eq!(strip.floor, Some(["58.0", "115.2"].map(str::to_owned)));
        assert_eq!(strip.limit, "248.1");
        assert!(
            strip
                .told
                .contains("hit: mean 0.1, 99th percentile 10, maximum 5000")
        );
    }
}
