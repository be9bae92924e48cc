//! What the charts have in common: the plot, its axis of values, and numbers on it.

use crate::figures;

/// The plot's measures in the units of the drawing, which `chart.html` makes 360 wide.
pub(super) const LEFT: f64 = 38.0;
pub(super) const RIGHT: f64 = 346.0;
pub(super) const TOP: f64 = 12.0;
pub(super) const BOTTOM: f64 = 140.0;
/// Intervals on the axis of values.
pub(super) const GRID: u32 = 4;

/// A line with its word.
#[derive(Debug)]
pub(crate) struct Tick {
    pub(crate) at: String,
    pub(crate) word: String,
}

/// From a value to its height.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scale {
    pub(super) most: f64,
}

impl Scale {
    pub(super) fn y(self, value: f64) -> f64 {
        BOTTOM - (BOTTOM - TOP) * (value / self.most).clamp(0.0, 1.0)
    }

    /// The axis of values.
    pub(super) fn grid(self) -> Vec<Tick> {
        let line = |part: u32| {
            let value = self.most * f64::from(part) / f64::from(GRID);
            Tick {
                at: figures::one(self.y(value)),
                word: short(value),
            }
        };
        (0..=GRID).map(line).collect()
    }
}

/// The least of 1, 2, 4 and 8 times a power of ten that is no less: its quarters are short.
pub(super) fn nice(value: f64) -> f64 {
    let power = 10_f64.powf(value.log10().floor());
    let found = [1.0, 2.0, 4.0, 8.0]
        .into_iter()
        .map(|factor| factor * power)
        .find(|nice| *nice >= value);
    found.unwrap_or(10.0 * power)
}

/// A number of an axis.
pub(super) fn short(value: f64) -> String {
    trimmed(value, 3)
}

pub(super) fn trimmed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    text.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scale_ends_at_a_round_number() {
        for (value, most) in [
            (0.3, 0.4),
            (0.5, 0.8),
            (1.0, 1.0),
            (9.0, 10.0),
            (37.0, 40.0),
        ] {
            assert!((nice(value) - most).abs() < 1e-12, "{value}");
        }
    }
}
