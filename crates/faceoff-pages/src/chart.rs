//! Small charts, drawn in SVG by `chart.html`: values over days, times on a logarithmic axis, rates beside each other, how
//! often values lie where, and the course of a game. Each is as wide as a phone, so that its words stay legible there; several stand beside each other and
//! read together. What they show stands in a table on the same page.

mod bars;
mod course;
mod histogram;
mod panel;
mod scale;
mod strip;

pub(super) use bars::{Bars, Rated};
pub(super) use course::Course;
pub(super) use histogram::{Bins, Histogram};
pub(super) use panel::{Bound, Panel, Value};
pub(super) use strip::{Counted, Span, Strip};
