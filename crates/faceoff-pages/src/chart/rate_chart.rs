//! A chart of success rates as bars.

use super::scale::{BOTTOM, LEFT, RIGHT, Scale, Tick};
use crate::format;

/// Width of a bar in units of the drawing.
const BAR_WIDTH: f64 = 28.0;

/// A rate in percent, with the ends of its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LabelledRate<'a> {
    pub(crate) name: &'a str,
    /// Is it the rate with which the others are compared? It has its own colour.
    pub(crate) is_ideal: bool,
    /// Label below the bar: colour alone must not carry the meaning.
    pub(crate) letter: char,
    pub(crate) percent: f64,
    pub(crate) interval: [f64; 2],
}

/// Rates as bars, in the form that `chart.html` draws.
#[derive(Debug)]
pub(crate) struct RateChart {
    pub(crate) title: String,
    pub(crate) grid: Vec<Tick>,
    pub(crate) bars: Vec<Bar>,
    /// Text alternative for screen readers.
    pub(crate) description: String,
}

/// Texts and coordinates of a bar; `low_y` and `high_y` are the ends of the interval.
#[derive(Debug)]
pub(crate) struct Bar {
    pub(crate) class: String,
    pub(crate) letter: char,
    pub(crate) x: String,
    pub(crate) y: String,
    pub(crate) width: String,
    pub(crate) height: String,
    pub(crate) middle: String,
    pub(crate) low_y: String,
    pub(crate) high_y: String,
    pub(crate) label_y: String,
    pub(crate) label: String,
}

impl RateChart {
    pub(crate) fn new(title: &str, rates: &[LabelledRate<'_>]) -> Self {
        let scale = Scale { max: 100.0 };
        let step = (RIGHT - LEFT) / rates.len().max(1) as f64;
        let middles = (0..).map(|index| LEFT + step * (f64::from(index) + 0.5));
        let values: Vec<String> = rates
            .iter()
            .map(|rate| format!("{} {:.0}", rate.name, rate.percent))
            .collect();
        Self {
            title: title.to_owned(),
            grid: scale.grid(),
            bars: rates
                .iter()
                .zip(middles)
                .map(|(rate, middle)| Bar::new(rate, middle, scale))
                .collect(),
            description: format!(
                "{title}, percent: {}; the table below lists the intervals",
                values.join(", ")
            ),
        }
    }
}

impl Bar {
    fn new(rate: &LabelledRate<'_>, middle: f64, scale: Scale) -> Self {
        let y = scale.y(rate.percent);
        let [low_y, high_y] = rate.interval.map(|end| scale.y(end));
        Self {
            class: if rate.is_ideal { "ideal" } else { rate.name }.to_owned(),
            letter: rate.letter,
            x: format::one_decimal(middle - BAR_WIDTH / 2.0),
            y: format::one_decimal(y),
            width: format::one_decimal(BAR_WIDTH),
            height: format::one_decimal(BOTTOM - y),
            middle: format::one_decimal(middle),
            low_y: format::one_decimal(low_y),
            high_y: format::one_decimal(high_y),
            label_y: format::one_decimal(high_y - 3.0),
            label: format!("{:.0}", rate.percent),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bar_height_and_position_follow_rate_and_index() {
        let rate = |name, percent| LabelledRate {
            name,
            is_ideal: name == "one",
            letter: 'X',
            percent,
            interval: [percent / 2.0, 100.0],
        };
        let chart = RateChart::new("Hit", &[rate("one", 25.0), rate("two", 100.0)]);
        let first = &chart.bars[0];
        assert_eq!((&*first.y, &*first.height), ("108.0", "32.0"));
        assert_eq!((&*first.middle, &*first.x), ("115.0", "101.0"));
        assert_eq!((&*first.low_y, &*first.high_y), ("124.0", "12.0"));
        assert_eq!(chart.bars[1].middle, "269.0");
        let classes = chart.bars.iter().map(|bar| &*bar.class);
        assert!(classes.eq(["ideal", "two"]));
        assert!(
            chart.description.contains("one 25, two 100"),
            "{}",
            chart.description
        );
    }
}
