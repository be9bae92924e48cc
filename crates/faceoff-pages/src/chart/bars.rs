//! Rates beside each other.

use super::scale::{BOTTOM, LEFT, RIGHT, Scale, Tick};
use crate::figures;

/// How wide a bar is.
const WIDTH: f64 = 28.0;

/// A rate in percent, with the ends of its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rated {
    pub(crate) name: &'static str,
    /// Written below its bar, since colour alone must not carry it.
    pub(crate) letter: char,
    pub(crate) percent: f64,
    pub(crate) interval: [f64; 2],
}

/// Rates as bars, ready to be drawn by `chart.html`.
#[derive(Debug)]
pub(crate) struct Bars {
    pub(crate) title: &'static str,
    pub(crate) grid: Vec<Tick>,
    pub(crate) bars: Vec<Bar>,
    /// What it shows in a sentence, for whoever does not see it.
    pub(crate) told: String,
}

#[derive(Debug)]
pub(crate) struct Bar {
    pub(crate) class: &'static str,
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

impl Bars {
    pub(crate) fn of(title: &'static str, rates: &[Rated]) -> Self {
        let scale = Scale { most: 100.0 };
        let step = (RIGHT - LEFT) / rates.len().max(1) as f64;
        let middles = (0..).map(|index| LEFT + step * (f64::from(index) + 0.5));
        let told: Vec<String> = rates
            .iter()
            .map(|of| format!("{} {:.0}", of.name, of.percent))
            .collect();
        Self {
            title,
            grid: scale.grid(),
            bars: rates
                .iter()
                .zip(middles)
                .map(|(of, middle)| Bar::of(of, middle, scale))
                .collect(),
            told: format!(
                "{title}, percent: {}; the table below has their intervals",
                told.join(", ")
            ),
        }
    }
}

impl Bar {
    fn of(of: &Rated, middle: f64, scale: Scale) -> Self {
        let y = scale.y(of.percent);
        let [low_y, high_y] = of.interval.map(|end| scale.y(end));
        Self {
            class: of.name,
            letter: of.letter,
            x: figures::one(middle - WIDTH / 2.0),
            y: figures::one(y),
            width: figures::one(WIDTH),
            height: figures::one(BOTTOM - y),
            middle: figures::one(middle),
            low_y: figures::one(low_y),
            high_y: figures::one(high_y),
            label_y: figures::one(high_y - 3.0),
            label: format!("{:.0}", of.percent),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_is_as_high_as_its_rate_and_stands_in_its_share_of_the_width() {
        let rate = |name, percent| Rated {
            name,
            letter: 'X',
            percent,
            interval: [percent / 2.0, 100.0],
        };
        let bars = Bars::of("Hit", &[rate("one", 25.0), rate("two", 100.0)]);
        let first = &bars.bars[0];
        assert_eq!((&*first.y, &*first.height), ("108.0", "32.0"));
        assert_eq!((&*first.middle, &*first.x), ("115.0", "101.0"));
        assert_eq!((&*first.low_y, &*first.high_y), ("124.0", "12.0"));
        assert_eq!(bars.bars[1].middle, "269.0");
        assert!(bars.told.contains("one 25, two 100"), "{}", bars.told);
    }
}
