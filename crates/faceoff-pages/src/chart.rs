//! Small charts, drawn as SVG by `chart.html`: values over days, answer times, success rates, histograms, and the score of a game.
//! A chart is 360 units wide, about the width of a phone, so that labels stay legible. A table on the same page has the same values.

mod answer_time_chart;
mod day_chart;
mod histogram;
mod rate_chart;
mod scale;
mod score_chart;
mod teams_chart;

pub(super) use answer_time_chart::{AnswerTimeChart, TimeBin, TimeSummary};
pub(super) use day_chart::{Bound, DayChart, DayValue};
pub(super) use histogram::{Bins, Histogram};
pub(super) use rate_chart::{LabelledRate, RateChart};
pub(super) use score_chart::ScoreChart;
pub(super) use teams_chart::TeamsChart;
