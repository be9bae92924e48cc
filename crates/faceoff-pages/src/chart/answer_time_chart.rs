//! A chart of the agent's answer times: a row per task on a logarithmic axis. Lengths are in units of the drawing.

use super::scale::{RIGHT, Tick, axis_number};
use crate::format;

/// Ends of the time axis, as powers of ten of a millisecond.
const FIRST_DECADE: f64 = -2.0;
const LAST_DECADE: f64 = 3.0;
/// Left edge of the plot; row names are to the left of it.
const PLOT_LEFT: f64 = 58.0;
/// Height of a row without and with a distribution.
const ROW_HEIGHT: u32 = 24;
const TALL_ROW_HEIGHT: u32 = 48;
/// Height of a distribution, and its distance from the row.
const DISTRIBUTION_HEIGHT: f64 = 26.0;
const DISTRIBUTION_GAP: u32 = 8;
/// Duration of a control step, in milliseconds.
const STEP_MS: f64 = 20.0;

/// Answer times of a task, in milliseconds.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TimeSummary {
    pub(crate) name: String,
    pub(crate) mean: f64,
    pub(crate) p99: f64,
    pub(crate) max: f64,
    /// The distribution, shortest times first; empty if it is not public.
    pub(crate) bins: Vec<TimeBin>,
}

/// Number of times in a range, in milliseconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TimeBin {
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) count: u64,
}

/// Times on a logarithmic axis, in the form that `chart.html` draws.
#[derive(Debug)]
pub(crate) struct AnswerTimeChart {
    pub(crate) rows: Vec<AnswerTimeRow>,
    pub(crate) grid: Vec<Tick>,
    /// Are distributions drawn?
    pub(crate) has_distributions: bool,
    /// x of the duration of a control step, within which an answer must arrive.
    pub(crate) limit: String,
    /// x and width of the *noise floor*, the delay that the server itself adds to an answer.
    pub(crate) noise_floor: Option<[String; 2]>,
    /// y of the lower end of the plot.
    pub(crate) bottom: u32,
    pub(crate) height: u32,
    /// The distributions as a table with a row per bin.
    pub(crate) counts: Vec<CountRow>,
    /// Text alternative for screen readers.
    pub(crate) description: String,
}

/// Number of times in a range, per task; bounds in milliseconds.
#[derive(Debug)]
pub(crate) struct CountRow {
    pub(crate) from: String,
    pub(crate) to: String,
    /// In the order of [`AnswerTimeChart::rows`].
    pub(crate) counts: Vec<u64>,
}

/// Positions of the times of a task.
#[derive(Debug)]
pub(crate) struct AnswerTimeRow {
    pub(crate) name: String,
    pub(crate) y: u32,
    pub(crate) mean: String,
    pub(crate) p99: String,
    pub(crate) max: String,
    /// The distribution as an SVG path.
    pub(crate) distribution: String,
}

impl AnswerTimeChart {
    /// `noise_floor`: its median and 99th percentile, in milliseconds.
    pub(crate) fn new(summaries: &[TimeSummary], noise_floor: Option<[f64; 2]>) -> Self {
        let has_distributions = summaries.iter().any(|summary| !summary.bins.is_empty());
        let mut y = 0;
        let rows = summaries.iter().map(|summary| {
            y += if has_distributions {
                TALL_ROW_HEIGHT
            } else {
                ROW_HEIGHT
            };
            let [mean, p99, max] =
                [summary.mean, summary.p99, summary.max].map(|ms| format::one_decimal(x(ms)));
            AnswerTimeRow {
                name: summary.name.clone(),
                y,
                mean,
                p99,
                max,
                distribution: distribution(&summary.bins, y - DISTRIBUTION_GAP),
            }
        });
        let rows = rows.collect();
        let bottom = y + ROW_HEIGHT / 2;
        let grid = [0.01, 0.1, 1.0, 10.0, 100.0, 1000.0].map(|ms| Tick {
            position: format::one_decimal(x(ms)),
            label: axis_number(ms),
        });
        let texts = summaries.iter().map(|summary| {
            let [mean, p99, max] = [summary.mean, summary.p99, summary.max].map(axis_number);
            format!(
                "{}: mean {mean}, 99th percentile {p99}, maximum {max}",
                summary.name
            )
        });
        let texts: Vec<String> = texts.collect();
        Self {
            rows,
            grid: grid.into(),
            has_distributions,
            limit: format::one_decimal(x(STEP_MS)),
            noise_floor: noise_floor
                .map(|[from, to]| [x(from), x(to) - x(from)].map(format::one_decimal)),
            bottom,
            height: bottom + 20,
            counts: count_rows(summaries),
            description: format!(
                "Answer times in milliseconds; a control step lasts {STEP_MS}; {}",
                texts.join("; ")
            ),
        }
    }
}

/// A row per bin with at least one time.
fn count_rows(summaries: &[TimeSummary]) -> Vec<CountRow> {
    // All tasks have the same bins; some have fewer.
    let longest = summaries
        .iter()
        .map(|summary| &summary.bins)
        .max_by_key(|all| all.len());
    let bins = longest.into_iter().flatten().enumerate();
    let rows = bins.map(|(index, bin)| CountRow {
        from: format::two_significant_digits(bin.from),
        to: format::two_significant_digits(bin.to),
        counts: summaries
            .iter()
            .map(|summary| summary.bins.get(index).map_or(0, |bin| bin.count))
            .collect(),
    });
    rows.filter(|row| row.counts.iter().any(|count| *count > 0))
        .collect()
}

/// Bars of the bins above `bottom`. Heights are logarithmic, so that a few slow answers among thousands stay visible.
fn distribution(bins: &[TimeBin], bottom: u32) -> String {
    let height = |count: u64| (1.0 + count as f64).ln();
    let max = bins.iter().map(|bin| bin.count).max().map_or(1.0, height);
    let bars = bins.iter().filter(|bin| bin.count > 0).map(|bin| {
        let top = f64::from(bottom) - DISTRIBUTION_HEIGHT * height(bin.count) / max;
        let [left, right, top] = [x(bin.from), x(bin.to), top].map(format::one_decimal);
        format!("M{left} {bottom}V{top}H{right}V{bottom}z")
    });
    bars.collect()
}

/// x of a time.
fn x(ms: f64) -> f64 {
    let decade = ms.max(f64::MIN_POSITIVE).log10();
    let share = (decade - FIRST_DECADE) / (LAST_DECADE - FIRST_DECADE);
    PLOT_LEFT + share.clamp(0.0, 1.0) * (RIGHT - PLOT_LEFT)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_placed_logarithmically_inside_the_plot() {
        let summary = TimeSummary {
            name: "hit".to_owned(),
            mean: 0.1,
            p99: 10.0,
            max: 5000.0,
            bins: Vec::new(),
        };
        let chart = AnswerTimeChart::new(std::slice::from_ref(&summary), Some([0.001, 1.0]));
        assert!(!chart.has_distributions && chart.height == 56, "{chart:?}");
        let bin = |from, to, count| TimeBin { from, to, count };
        let with_bins = TimeSummary {
            bins: vec![bin(0.1, 1.0, 99), bin(1.0, 10.0, 0), bin(10.0, 100.0, 9)],
            ..summary
        };
        let tall = AnswerTimeChart::new(&[with_bins], None);
        assert!(tall.has_distributions);
        assert_eq!(
            tall.rows[0].distribution, "M115.6 40V14.0H173.2V40zM230.8 40V27.0H288.4V40z",
            "a tenth of the count is half as high; an empty column is not drawn"
        );
        let rows: Vec<_> = tall
            .counts
            .iter()
            .map(|row| (&*row.from, &*row.counts))
            .collect();
        assert_eq!(rows, [("0.10", &[99][..]), ("10", &[9])]);
        let row = &chart.rows[0];
        assert_eq!(
            [&row.mean, &row.p99, &row.max],
            ["115.6", "230.8", "346.0"],
            "a fifth, three fifths, and the end"
        );
        assert_eq!(
            chart.noise_floor,
            Some(["58.0", "115.2"].map(str::to_owned))
        );
        assert_eq!(chart.limit, "248.1");
        assert!(
            chart
                .description
                .contains("hit: mean 0.1, 99th percentile 10, maximum 5000")
        );
    }
}
