//! The plot area of a chart, its value axis and number labels.

use crate::format;

/// Edges of the plot in units of the drawing, which is 360 wide (`chart.html`).
pub(super) const LEFT: f64 = 38.0;
pub(super) const RIGHT: f64 = 346.0;
pub(super) const TOP: f64 = 12.0;
pub(super) const BOTTOM: f64 = 140.0;
/// Number of equal intervals of the value axis.
pub(super) const GRID_INTERVALS: u32 = 4;

/// A labelled position on an axis, in units of the drawing.
#[derive(Debug)]
pub(crate) struct Tick {
    pub(crate) position: String,
    pub(crate) label: String,
}

/// Maps a value to a y coordinate. The value axis starts at 0.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scale {
    /// Value at the top of the plot.
    pub(super) max: f64,
}

impl Scale {
    pub(super) fn y(self, value: f64) -> f64 {
        BOTTOM - (BOTTOM - TOP) * (value / self.max).clamp(0.0, 1.0)
    }

    /// Ticks of the value axis.
    pub(super) fn grid(self) -> Vec<Tick> {
        let line = |part: u32| {
            let value = self.max * f64::from(part) / f64::from(GRID_INTERVALS);
            Tick {
                position: format::one_decimal(self.y(value)),
                label: axis_number(value),
            }
        };
        (0..=GRID_INTERVALS).map(line).collect()
    }
}

/// The smallest 1, 2, 4 or 8 times a power of ten that is at least `value`: its quarters have few digits.
pub(super) fn round_up(value: f64) -> f64 {
    let power = 10_f64.powf(value.log10().floor());
    let found = [1.0, 2.0, 4.0, 8.0]
        .into_iter()
        .map(|factor| factor * power)
        .find(|rounded| *rounded >= value);
    found.unwrap_or(10.0 * power)
}

/// A number on an axis.
pub(super) fn axis_number(value: f64) -> String {
    without_trailing_zeros(value, 3)
}

pub(super) fn without_trailing_zeros(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    text.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_ends_at_a_round_number() {
        for (value, max) in [
            (0.3, 0.4),
            (0.5, 0.8),
            (1.0, 1.0),
            (9.0, 10.0),
            (37.0, 40.0),
        ] {
            assert!((round_up(value) - max).abs() < 1e-12, "{value}");
        }
    }
}
