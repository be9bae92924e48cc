//! Histograms: numbers of values in columns of equal width.

use super::scale::{BOTTOM, GRID_INTERVALS, LEFT, RIGHT, Scale, Tick, axis_number};
use crate::format;

/// Largest number of labels below the columns; more would overlap on a phone.
const MAX_LABELS: usize = 8;

/// Columns of equal width, starting at zero. Histograms beside each other share them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bins {
    /// In the unit of the values.
    pub(crate) width: f64,
    pub(crate) count: usize,
}

/// Counts of values, in the form that `chart.html` draws.
#[derive(Debug)]
pub(crate) struct Histogram {
    pub(crate) title: String,
    pub(crate) unit: &'static str,
    pub(crate) grid: Vec<Tick>,
    /// Labels at the edges of columns.
    pub(crate) edges: Vec<Tick>,
    /// All columns as one SVG path.
    pub(crate) columns: String,
    /// Text alternative for screen readers.
    pub(crate) description: String,
}

impl Bins {
    /// As many columns as the largest value needs.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a small number of columns"
    )]
    pub(crate) fn for_all(width: f64, values: impl IntoIterator<Item = f64>) -> Self {
        let largest = values.into_iter().fold(0.0, f64::max);
        Self {
            width,
            count: (largest / width).floor() as usize + 1,
        }
    }

    /// Values per column; a value on an edge belongs to the column after it.
    pub(crate) fn counts(self, values: &[f64]) -> Vec<usize> {
        let mut counts = vec![0; self.count];
        for value in values {
            let column = (0..self.count)
                .rev()
                .find(|column| self.start(*column) <= *value);
            counts[column.unwrap_or_default()] += 1;
        }
        counts
    }

    fn start(self, column: usize) -> f64 {
        self.width * column as f64
    }

    /// Range of a column as text.
    pub(crate) fn label(self, column: usize) -> String {
        let [from, to] = [column, column + 1].map(|edge| axis_number(self.start(edge)));
        format!("{from} to {to}")
    }

    fn x(self, edge: usize) -> f64 {
        LEFT + (RIGHT - LEFT) * edge as f64 / self.count as f64
    }

    fn edges(self) -> Vec<Tick> {
        let step = self.count.div_ceil(MAX_LABELS);
        let edges = (0..=self.count).step_by(step).map(|edge| Tick {
            position: format::one_decimal(self.x(edge)),
            label: axis_number(self.start(edge)),
        });
        edges.collect()
    }
}

impl Histogram {
    /// `max`: the largest count of all histograms beside each other.
    pub(crate) fn new(
        title: &str,
        unit: &'static str,
        bins: Bins,
        counts: &[usize],
        max: usize,
    ) -> Self {
        let scale = Scale {
            max: f64::from(GRID_INTERVALS) * whole_step(max as f64 / f64::from(GRID_INTERVALS)),
        };
        let filled = || counts.iter().enumerate().filter(|(_, count)| **count > 0);
        let columns = filled().map(|(column, count)| {
            let top = format::one_decimal(scale.y(*count as f64));
            let [left, right] =
                [bins.x(column) + 0.5, bins.x(column + 1) - 0.5].map(format::one_decimal);
            format!("M{left} {BOTTOM}V{top}H{right}V{BOTTOM}z")
        });
        let texts: Vec<String> = filled()
            .map(|(column, count)| format!("{} {unit}: {count}", bins.label(column)))
            .collect();
        Self {
            title: title.to_owned(),
            unit,
            grid: scale.grid(),
            edges: bins.edges(),
            columns: columns.collect(),
            description: match texts.is_empty() {
                true => format!("{title}: none"),
                false => format!("{title}: {}", texts.join(", ")),
            },
        }
    }
}

/// The smallest 1, 2 or 5 times a power of ten that is at least `least` and whole, since counts are whole numbers.
fn whole_step(least: f64) -> f64 {
    let power = 10_f64.powf(least.max(1.0).log10().floor());
    let found = [1.0, 2.0, 5.0]
        .into_iter()
        .map(|factor| factor * power)
        .find(|step| *step >= least);
    found.unwrap_or(10.0 * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_counted_by_column_and_drawn_by_count() {
        let values = [0.0, 0.4, 0.5, 1.9];
        let bins = Bins::for_all(0.5, values.into_iter().chain([2.0]));
        assert_eq!(bins.count, 5, "a value on the last edge has a column");
        let counts = bins.counts(&values);
        assert_eq!(counts, [2, 1, 0, 1, 0]);
        let drawn = Histogram::new("Alpha", "m/s", bins, &counts, 4);
        assert_eq!(
            drawn.columns,
            "M38.5 140V76.0H99.1V140zM100.1 140V108.0H160.7V140zM223.3 140V108.0H283.9V140z"
        );
        let edges: Vec<&str> = drawn.edges.iter().map(|edge| &*edge.label).collect();
        assert_eq!(edges, ["0", "0.5", "1", "1.5", "2", "2.5"]);
        assert_eq!(
            drawn.description,
            "Alpha: 0 to 0.5 m/s: 2, 0.5 to 1 m/s: 1, 1.5 to 2 m/s: 1"
        );
        let none = Histogram::new("Beta", "m/s", bins, &[0; 5], 0);
        assert_eq!((&*none.columns, &*none.description), ("", "Beta: none"));
    }

    #[test]
    fn axis_steps_are_whole_numbers() {
        for (least, step) in [
            (0.0, 1.0),
            (0.5, 1.0),
            (1.0, 1.0),
            (2.5, 5.0),
            (6.0, 10.0),
            (13.0, 20.0),
        ] {
            assert!((whole_step(least) - step).abs() < 1e-12, "{least}");
        }
    }

    #[test]
    fn many_columns_have_few_labels() {
        let bins = Bins::for_all(0.5, [12.0]);
        assert_eq!(bins.count, 25);
        assert_eq!(bins.edges().len(), 7, "every fourth of 26 edges");
    }
}
