//! A chart of a value over evaluation days.

use super::scale::{LEFT, RIGHT, Scale, Tick, round_up, without_trailing_zeros};
use crate::format;
use jiff::civil::Date;

/// A value of an evaluation day.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DayValue {
    pub(crate) day: Date,
    pub(crate) value: f64,
    /// Ends of the 95 % interval, if there is one.
    pub(crate) interval: Option<[f64; 2]>,
}

/// A limit, drawn as a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bound {
    pub(crate) name: &'static str,
    pub(crate) value: f64,
}

/// A chart over days, in the form that `chart.html` draws.
#[derive(Debug)]
pub(crate) struct DayChart {
    pub(crate) title: String,
    /// Unit of the axis.
    pub(crate) unit: &'static str,
    /// Text alternative for screen readers.
    pub(crate) description: String,
    pub(crate) grid: Vec<Tick>,
    pub(crate) days: Vec<Tick>,
    pub(crate) bounds: Vec<Tick>,
    pub(crate) points: Vec<Point>,
    /// Line through all points; an SVG path.
    pub(crate) path: String,
}

#[derive(Debug)]
pub(crate) struct Point {
    pub(crate) x: String,
    pub(crate) y: String,
    pub(crate) interval: Option<[String; 2]>,
    /// Tooltip.
    pub(crate) label: String,
}

impl DayChart {
    /// A chart of rates from 0 to 100 percent.
    pub(crate) fn from_percent(title: &str, values: &[DayValue]) -> Self {
        Self::new(title, "percent", values, &[], Scale { max: 100.0 })
    }

    /// A chart of non-negative values; the scale includes the first bound.
    pub(crate) fn from_zero(
        title: &str,
        unit: &'static str,
        values: &[DayValue],
        bounds: &[Bound],
    ) -> Self {
        let extents = values.iter().map(|value| value.value);
        let extents = extents.chain(bounds.first().map(|bound| 1.25 * bound.value));
        let max = round_up(extents.fold(f64::MIN_POSITIVE, f64::max));
        Self::new(title, unit, values, bounds, Scale { max })
    }

    fn new(
        title: &str,
        unit: &'static str,
        values: &[DayValue],
        bounds: &[Bound],
        scale: Scale,
    ) -> Self {
        let span = values
            .first()
            .zip(values.last())
            .map(|(first, last)| (first.day, last.day));
        let day_x = |value: &DayValue| x(value.day, span);
        let points: Vec<Point> = values
            .iter()
            .map(|value| Point {
                x: format::one_decimal(day_x(value)),
                y: format::one_decimal(scale.y(value.value)),
                interval: value
                    .interval
                    .map(|ends| ends.map(|end| format::one_decimal(scale.y(end)))),
                label: label(value),
            })
            .collect();
        let path = points
            .iter()
            .zip(std::iter::once("M").chain(std::iter::repeat("L")))
            .map(|(point, step)| format!("{step}{} {}", point.x, point.y))
            .collect();
        let shown = bounds.iter().filter(|bound| bound.value <= scale.max);
        Self {
            title: title.to_owned(),
            unit,
            description: description(title, unit, values),
            grid: scale.grid(),
            days: day_ticks(span),
            bounds: shown
                .map(|bound| Tick {
                    position: format::one_decimal(scale.y(bound.value)),
                    label: bound.name.to_owned(),
                })
                .collect(),
            points,
            path,
        }
    }
}

/// x of a day on a calendar axis: days without a value are gaps, a single day is in the middle.
fn x(day: Date, span: Option<(Date, Date)>) -> f64 {
    let days = |from: Date, to: Date| f64::from((to - from).get_days());
    match span {
        Some((first, last)) if last > first => {
            let margin = 8.0;
            let share = days(first, day) / days(first, last);
            LEFT + margin + share * (RIGHT - LEFT - 2.0 * margin)
        }
        _ => f64::midpoint(LEFT, RIGHT),
    }
}

/// Labels of the first and the last day.
fn day_ticks(span: Option<(Date, Date)>) -> Vec<Tick> {
    let Some((first, last)) = span else {
        return Vec::new();
    };
    let mut days = vec![first, last];
    days.dedup();
    days.into_iter()
        .map(|day| Tick {
            position: format::one_decimal(x(day, span)),
            label: day.to_string(),
        })
        .collect()
}

fn label(value: &DayValue) -> String {
    let shown = |value: f64| without_trailing_zeros(value, 2);
    match value.interval {
        Some([low, high]) => format!(
            "{}: {} ({} – {})",
            value.day,
            shown(value.value),
            shown(low),
            shown(high)
        ),
        None => format!("{}: {}", value.day, shown(value.value)),
    }
}

fn description(title: &str, unit: &str, values: &[DayValue]) -> String {
    match values {
        [] => format!("{title}: no day has a result"),
        [only] => format!("{title}, {unit}: {}", label(only)),
        [first, .., last] => format!(
            "{title}, {unit}, {} days: {} to {}; the table below lists all",
            values.len(),
            label(first),
            label(last)
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jiff::civil::date;

    fn value(day: i8, value: f64) -> DayValue {
        DayValue {
            day: date(2026, 3, day),
            value,
            interval: Some([value - 10.0, value + 10.0]),
        }
    }

    #[test]
    fn days_follow_the_calendar_and_values_the_scale() {
        let chart =
            DayChart::from_percent("Score", &[value(1, 0.0), value(2, 50.0), value(5, 100.0)]);
        let places: Vec<_> = chart.points.iter().map(|point| point.x.as_str()).collect();
        assert_eq!(places, ["46.0", "119.0", "338.0"], "a quarter of the way");
        let heights: Vec<_> = chart.points.iter().map(|point| point.y.as_str()).collect();
        assert_eq!(heights, ["140.0", "76.0", "12.0"]);
        assert_eq!(
            chart.points[0].interval,
            Some(["140.0", "127.2"].map(str::to_owned)),
            "values outside the scale are clamped"
        );
        assert_eq!(chart.path, "M46.0 140.0L119.0 76.0L338.0 12.0");
        let days: Vec<_> = chart.days.iter().map(|tick| tick.label.as_str()).collect();
        assert_eq!(days, ["2026-03-01", "2026-03-05"]);
        assert!(
            chart.description.contains("2026-03-05: 100 (90 – 110)"),
            "{}",
            chart.description
        );
    }

    #[test]
    fn single_day_is_centred_and_empty_chart_says_so() {
        let chart = DayChart::from_percent("Score", &[value(1, 50.0)]);
        assert_eq!((chart.points.len(), chart.days.len()), (1, 1));
        assert_eq!(chart.points[0].x, "192.0");
        let empty = DayChart::from_percent("Score", &[]);
        assert!(empty.points.is_empty() && empty.path.is_empty());
        assert!(empty.description.contains("no day"));
    }

    #[test]
    fn scale_includes_the_first_bound() {
        let bounds = [
            Bound {
                name: "deployable",
                value: 0.5,
            },
            Bound {
                name: "improvable",
                value: 1.5,
            },
        ];
        let low = DayChart::from_zero("Points", "per episode", &[value(1, 0.1)], &bounds);
        let words: Vec<_> = low.bounds.iter().map(|tick| tick.label.as_str()).collect();
        assert_eq!(
            words,
            ["deployable"],
            "the other bound is outside the scale"
        );
        assert_eq!(low.grid.last().map(|tick| tick.label.as_str()), Some("0.8"));
        let high = DayChart::from_zero("Points", "per episode", &[value(1, 3.0)], &bounds);
        assert_eq!(high.bounds.len(), 2);
    }
}
