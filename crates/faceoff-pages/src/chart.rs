//! Small charts, drawn as SVG by `chart.html`: values over days, answer times, rates, histograms, and the score of a game. Each chart is as wide as a phone, so that labels stay legible. A table on the same page has
//! the same values.

mod bars;
mod histogram;
mod panel;
mod scale;
mod score_chart;
mod strip;

pub(super) use bars::{Bars, LabelledRate};
pub(super) use histogram::{Bins, Histogram};
pub(super) use panel::{Bound, DayValue, Panel};
pub(super) use score_chart::ScoreChart;
pub(super) use strip::{Strip, TimeBin, TimeSummary};
