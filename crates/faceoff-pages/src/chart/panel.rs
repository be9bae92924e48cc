//! A value over days.

use super::scale::{LEFT, RIGHT, Scale, Tick, nice, trimmed};
use crate::figures;
use jiff::civil::Date;

/// A value of a day.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Value {
    pub(crate) day: Date,
    pub(crate) value: f64,
    /// The ends of its 95 % interval, if it has one.
    pub(crate) interval: Option<[f64; 2]>,
}

/// What values are held against.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bound {
    pub(crate) name: &'static str,
    pub(crate) value: f64,
}

/// A chart, ready to be drawn by `chart.html`.
#[derive(Debug)]
pub(crate) struct Panel {
    pub(crate) title: &'static str,
    /// What is on its axis.
    pub(crate) unit: &'static str,
    /// What it shows in a sentence, for whoever does not see it.
    pub(crate) told: String,
    pub(crate) grid: Vec<Tick>,
    pub(crate) days: Vec<Tick>,
    pub(crate) bounds: Vec<Tick>,
    pub(crate) points: Vec<Point>,
    /// Through all of them; an SVG path.
    pub(crate) path: String,
}

#[derive(Debug)]
pub(crate) struct Point {
    pub(crate) x: String,
    pub(crate) y: String,
    pub(crate) interval: Option<[String; 2]>,
    /// What a pointer over it shows.
    pub(crate) word: String,
}

impl Panel {
    /// Of rates in percent: all panels of such have the same scale.
    pub(crate) fn of_percent(title: &'static str, values: &[Value]) -> Self {
        Self::of(title, "percent", values, &[], Scale { most: 100.0 })
    }

    /// Of values that are not negative and have no upper end; the scale has room for the first of the bounds.
    pub(crate) fn from_zero(
        title: &'static str,
        unit: &'static str,
        values: &[Value],
        bounds: &[Bound],
    ) -> Self {
        let of_values = values.iter().map(|one| one.value);
        let most = of_values.chain(bounds.first().map(|bound| 1.25 * bound.value));
        let most = nice(most.fold(f64::MIN_POSITIVE, f64::max));
        Self::of(title, unit, values, bounds, Scale { most })
    }

    fn of(
        title: &'static str,
        unit: &'static str,
        values: &[Value],
        bounds: &[Bound],
        scale: Scale,
    ) -> Self {
        let span = values
            .first()
            .zip(values.last())
            .map(|(first, last)| (first.day, last.day));
        let place = |value: &Value| x(value.day, span);
        let points: Vec<Point> = values
            .iter()
            .map(|value| Point {
                x: figures::one(place(value)),
                y: figures::one(scale.y(value.value)),
                interval: value
                    .interval
                    .map(|ends| ends.map(|end| figures::one(scale.y(end)))),
                word: word(value),
            })
            .collect();
        let path = points
            .iter()
            .zip(std::iter::once("M").chain(std::iter::repeat("L")))
            .map(|(point, step)| format!("{step}{} {}", point.x, point.y))
            .collect();
        let shown = bounds.iter().filter(|bound| bound.value <= scale.most);
        Self {
            title,
            unit,
            told: told(title, unit, values),
            grid: scale.grid(),
            days: ends(span),
            bounds: shown
                .map(|bound| Tick {
                    at: figures::one(scale.y(bound.value)),
                    word: bound.name.to_owned(),
                })
                .collect(),
            points,
            path,
        }
    }
}

/// By the calendar: days without a value are gaps. A single day stands in the middle.
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

/// The first and the last day, which the axis names.
fn ends(span: Option<(Date, Date)>) -> Vec<Tick> {
    let Some((first, last)) = span else {
        return Vec::new();
    };
    let mut days = vec![first, last];
    days.dedup();
    days.into_iter()
        .map(|day| Tick {
            at: figures::one(x(day, span)),
            word: day.to_string(),
        })
        .collect()
}

fn word(value: &Value) -> String {
    let shown = |value: f64| trimmed(value, 2);
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

fn told(title: &str, unit: &str, values: &[Value]) -> String {
    match values {
        [] => format!("{title}: no day has a result"),
        [only] => format!("{title}, {unit}: {}", word(only)),
        [first, .., last] => format!(
            "{title}, {unit}, of {} days: {} to {}; the table below has all of them",
            values.len(),
            word(first),
            word(last)
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jiff::civil::date;

    fn value(day: i8, value: f64) -> Value {
        Value {
            day: date(2026, 3, day),
            value,
            interval: Some([value - 10.0, value + 10.0]),
        }
    }

    #[test]
    fn days_stand_where_the_calendar_has_them_and_values_by_the_scale() {
        let panel = Panel::of_percent("Score", &[value(1, 0.0), value(2, 50.0), value(5, 100.0)]);
        let places: Vec<_> = panel.points.iter().map(|point| point.x.as_str()).collect();
        assert_eq!(places, ["46.0", "119.0", "338.0"], "a quarter of the way");
        let heights: Vec<_> = panel.points.iter().map(|point| point.y.as_str()).collect();
        assert_eq!(heights, ["140.0", "76.0", "12.0"]);
        assert_eq!(
            panel.points[0].interval,
            Some(["140.0", "127.2"].map(str::to_owned)),
            "what lies outside of the scale ends with it"
        );
        assert_eq!(panel.path, "M46.0 140.0L119.0 76.0L338.0 12.0");
        let days: Vec<_> = panel.days.iter().map(|tick| tick.word.as_str()).collect();
        assert_eq!(days, ["2026-03-01", "2026-03-05"]);
        assert!(
            panel.told.contains("2026-03-05: 100 (90 – 110)"),
            "{}",
            panel.told
        );
    }

    #[test]
    fn one_day_is_a_point_in_the_middle_and_none_is_said() {
        let panel = Panel::of_percent("Score", &[value(1, 50.0)]);
        assert_eq!((panel.points.len(), panel.days.len()), (1, 1));
        assert_eq!(panel.points[0].x, "192.0");
        let empty = Panel::of_percent("Score", &[]);
        assert!(empty.points.is_empty() && empty.path.is_empty());
        assert!(empty.told.contains("no day"));
    }

    #[test]
    fn a_scale_has_room_for_the_first_bound() {
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
        let low = Panel::from_zero("Points", "per episode", &[value(1, 0.1)], &bounds);
        let words: Vec<_> = low.bounds.iter().map(|tick| tick.word.as_str()).collect();
        assert_eq!(words, ["deployable"], "the other is far above");
        assert_eq!(low.grid.last().map(|tick| tick.word.as_str()), Some("0.8"));
        let high = Panel::from_zero("Points", "per episode", &[value(1, 3.0)], &bounds);
        assert_eq!(high.bounds.len(), 2);
    }
}
