//! Small charts of a value over days, drawn in SVG. Panels of the same days stand beside each other and read together; each
//! is as wide as a phone, so that its words stay legible there. What they show stands in a table on the same page.

use super::figures;
use faceoff_replay::model::CONTROL_STEP_S;
use jiff::civil::Date;

/// The plot's measures in the units of the drawing, which `chart.html` makes 360 wide and 168 high.
const LEFT: f64 = 38.0;
const RIGHT: f64 = 346.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 140.0;
/// Intervals on the axis of values.
const GRID: u32 = 4;

/// A value of a day.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Value {
    pub(super) day: Date,
    pub(super) value: f64,
    /// The ends of its 95 % interval, if it has one.
    pub(super) interval: Option<[f64; 2]>,
}

/// What values are held against.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bound {
    pub(super) name: &'static str,
    pub(super) value: f64,
}

/// A chart, ready to be drawn by `chart.html`.
#[derive(Debug)]
pub(super) struct Panel {
    pub(super) title: &'static str,
    /// What is on its axis.
    pub(super) unit: &'static str,
    /// What it shows in a sentence, for whoever does not see it.
    pub(super) told: String,
    pub(super) grid: Vec<Tick>,
    pub(super) days: Vec<Tick>,
    pub(super) bounds: Vec<Tick>,
    pub(super) points: Vec<Point>,
    /// Through all of them; an SVG path.
    pub(super) path: String,
}

/// A line with its word.
#[derive(Debug)]
pub(super) struct Tick {
    pub(super) at: String,
    pub(super) word: String,
}

/// A value's place.
#[derive(Debug)]
pub(super) struct Point {
    pub(super) x: String,
    pub(super) y: String,
    pub(super) interval: Option<[String; 2]>,
    /// What a pointer over it shows.
    pub(super) word: String,
}

/// From a value to its height.
#[derive(Debug, Clone, Copy)]
struct Scale {
    most: f64,
}

impl Scale {
    fn y(self, value: f64) -> f64 {
        BOTTOM - (BOTTOM - TOP) * (value / self.most).clamp(0.0, 1.0)
    }
}

impl Panel {
    /// Of rates in percent: all panels of such have the same scale.
    pub(super) fn of_percent(title: &'static str, values: &[Value]) -> Self {
        Self::of(title, "percent", values, &[], Scale { most: 100.0 })
    }

    /// Of values that are not negative and have no upper end; the scale has room for the first of the bounds.
    pub(super) fn from_zero(
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
            grid: (0..=GRID)
                .map(|part| {
                    let value = scale.most * f64::from(part) / f64::from(GRID);
                    Tick {
                        at: figures::one(scale.y(value)),
                        word: short(value),
                    }
                })
                .collect(),
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

/// The least of 1, 2, 4 and 8 times a power of ten that is no less: its quarters are short.
fn nice(value: f64) -> f64 {
    let power = 10_f64.powf(value.log10().floor());
    let found = [1.0, 2.0, 4.0, 8.0]
        .into_iter()
        .map(|factor| factor * power)
        .find(|nice| *nice >= value);
    found.unwrap_or(10.0 * power)
}

/// A number of an axis.
fn short(value: f64) -> String {
    trimmed(value, 3)
}

fn trimmed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    text.to_owned()
}

/// The axis of times begins and ends at these powers of ten of a millisecond.
const FIRST_DECADE: f64 = -2.0;
const LAST_DECADE: f64 = 3.0;
/// Words before the rows of a strip are as wide.
const STRIP_LEFT: f64 = 58.0;
/// From row to row, and where the rows have distributions above them.
const ROW: u32 = 24;
const TALL_ROW: u32 = 48;
/// The height of a distribution, and how far above its row it stands.
const SHAPE: f64 = 26.0;
const SHAPE_GAP: u32 = 8;
/// What an answer has: a control step, in milliseconds.
const STEP_MS: f64 = 20.0;

/// Times of one kind, in milliseconds.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Span {
    pub(super) name: &'static str,
    pub(super) mean: f64,
    pub(super) p99: f64,
    pub(super) max: f64,
    /// How many of them lie where, the shorter first; empty where that is not told.
    pub(super) counted: Vec<Counted>,
}

/// So many times lie between two, in milliseconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Counted {
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) count: u64,
}

/// Times on a logarithmic axis, ready to be drawn by `chart.html`.
#[derive(Debug)]
pub(super) struct Strip {
    pub(super) rows: Vec<StripRow>,
    /// Powers of ten.
    pub(super) grid: Vec<Tick>,
    /// Are there distributions above the rows?
    pub(super) has_shapes: bool,
    /// Where a control step ends.
    pub(super) limit: String,
    /// Where the noise floor begins, and how wide it is.
    pub(super) floor: Option<[String; 2]>,
    pub(super) bottom: u32,
    pub(super) height: u32,
    /// The distributions in numbers, a row for each of their columns.
    pub(super) counts: Vec<CountRow>,
    /// What it shows in a sentence, for whoever does not see it.
    pub(super) told: String,
}

/// How many times of each kind lie between two, in milliseconds.
#[derive(Debug)]
pub(super) struct CountRow {
    pub(super) from: String,
    pub(super) to: String,
    /// In the order of the strip's rows.
    pub(super) counts: Vec<u64>,
}

/// Where the times of one kind lie.
#[derive(Debug)]
pub(super) struct StripRow {
    pub(super) name: &'static str,
    pub(super) y: u32,
    pub(super) mean: String,
    pub(super) p99: String,
    pub(super) max: String,
    /// The distribution, an SVG path.
    pub(super) shape: String,
}

impl Strip {
    /// `floor`: median and 99th percentile of what the server itself adds, in milliseconds.
    pub(super) fn of(spans: &[Span], floor: Option<[f64; 2]>) -> Self {
        let has_shapes = spans.iter().any(|span| !span.counted.is_empty());
        let mut y = 0;
        let rows = spans.iter().map(|span| {
            y += if has_shapes { TALL_ROW } else { ROW };
            let [mean, p99, max] = [span.mean, span.p99, span.max].map(|ms| figures::one(at(ms)));
            StripRow {
                name: span.name,
                y,
                mean,
                p99,
                max,
                shape: shape(&span.counted, y - SHAPE_GAP),
            }
        });
        let rows = rows.collect();
        let bottom = y + ROW / 2;
        let grid = [0.01, 0.1, 1.0, 10.0, 100.0, 1000.0].map(|ms| Tick {
            at: figures::one(at(ms)),
            word: short(ms),
        });
        let told = spans.iter().map(|span| {
            let [mean, p99, max] = [span.mean, span.p99, span.max].map(short);
            format!(
                "{}: mean {mean}, 99th percentile {p99}, maximum {max}",
                span.name
            )
        });
        let told: Vec<String> = told.collect();
        Self {
            rows,
            grid: grid.into(),
            has_shapes,
            limit: figures::one(at(STEP_MS)),
            floor: floor.map(|[from, to]| [at(from), at(to) - at(from)].map(figures::one)),
            bottom,
            height: bottom + 20,
            counts: counts(spans),
            told: format!(
                "Answer times in milliseconds, of {STEP_MS} that a control step has; {}",
                told.join("; ")
            ),
        }
    }
}

/// Columns without any time are left out.
fn counts(spans: &[Span]) -> Vec<CountRow> {
    // All kinds have the same columns; some have fewer.
    let longest = spans
        .iter()
        .map(|span| &span.counted)
        .max_by_key(|all| all.len());
    let columns = longest.into_iter().flatten().enumerate();
    let rows = columns.map(|(column, of)| CountRow {
        from: figures::significant(of.from),
        to: figures::significant(of.to),
        counts: spans
            .iter()
            .map(|span| span.counted.get(column).map_or(0, |one| one.count))
            .collect(),
    });
    rows.filter(|row| row.counts.iter().any(|count| *count > 0))
        .collect()
}

/// Columns above `bottom`. Their heights are by the logarithm of the counts: few slow answers among thousands are what one
/// looks for.
fn shape(counted: &[Counted], bottom: u32) -> String {
    let height = |count: u64| (1.0 + count as f64).ln();
    let most = counted
        .iter()
        .map(|one| one.count)
        .max()
        .map_or(1.0, height);
    let columns = counted.iter().filter(|one| one.count > 0).map(|one| {
        let top = f64::from(bottom) - SHAPE * height(one.count) / most;
        let [left, right, top] = [at(one.from), at(one.to), top].map(figures::one);
        format!("M{left} {bottom}V{top}H{right}V{bottom}z")
    });
    columns.collect()
}

/// Where a time lies.
fn at(ms: f64) -> f64 {
    let decade = ms.max(f64::MIN_POSITIVE).log10();
    let share = (decade - FIRST_DECADE) / (LAST_DECADE - FIRST_DECADE);
    STRIP_LEFT + share.clamp(0.0, 1.0) * (RIGHT - STRIP_LEFT)
}

/// Rows of a course's fouls below its plot, from each other.
const FOUL_ROW: f64 = 16.0;

/// A count of two sides over the time of a game, ready to be drawn by `chart.html`: a stair for each, and marks for fouls.
#[derive(Debug)]
pub(super) struct Course {
    /// The stairs; SVG paths.
    pub(super) paths: [String; 2],
    /// Each side's fouls: SVG paths of triangles.
    pub(super) fouls: [String; 2],
    /// Where the rows of fouls lie.
    pub(super) foul_rows: [String; 2],
    /// Minutes.
    pub(super) minutes: Vec<Tick>,
    pub(super) grid: Vec<Tick>,
    /// What it shows in a sentence, for whoever does not see it.
    pub(super) told: String,
}

impl Course {
    /// Of what changes the score in so many control steps: when, the score afterwards, and who fouled if it was a foul.
    pub(super) fn of(
        steps: u32,
        changes: impl Iterator<Item = (u32, [u32; 2], Option<usize>)>,
        teams: &[String; 2],
    ) -> Self {
        let changes: Vec<_> = changes.collect();
        let last = changes.last().map_or([0; 2], |(_, score, _)| *score);
        let most = nice(f64::from(last[0].max(last[1]).max(4)));
        let scale = Scale { most };
        let x = |step: u32| {
            LEFT + (RIGHT - LEFT) * (f64::from(step) / f64::from(steps.max(1))).clamp(0.0, 1.0)
        };
        let foul_y = [0.0, 1.0].map(|row| BOTTOM + FOUL_ROW * (0.75 + row));
        let mut paths = [0, 1].map(|_| format!("M{} {}", figures::one(LEFT), figures::one(BOTTOM)));
        let mut fouls = [String::new(), String::new()];
        for (step, score, foul_by) in &changes {
            for (path, score) in paths.iter_mut().zip(score) {
                path.push_str(&format!(
                    "H{}V{}",
                    figures::one(x(*step)),
                    figures::one(scale.y(f64::from(*score)))
                ));
            }
            if let Some(side) = foul_by.filter(|side| *side < 2) {
                fouls[side].push_str(&format!(
                    "M{} {}l4 7h-8z",
                    figures::one(x(*step)),
                    figures::one(foul_y[side] - 4.0)
                ));
            }
        }
        for path in &mut paths {
            path.push_str(&format!("H{}", figures::one(RIGHT)));
        }
        let minutes = f64::from(steps) * CONTROL_STEP_S / 60.0;
        let ticks = [0.0, 0.5, 1.0].map(|share| Tick {
            at: figures::one(LEFT + share * (RIGHT - LEFT)),
            word: trimmed(share * minutes, 1),
        });
        let of_fouls = |side: usize| {
            let those = changes.iter().filter(|(_, _, by)| *by == Some(side));
            those.count()
        };
        Self {
            paths,
            fouls,
            foul_rows: foul_y.map(|y| figures::one(y + 4.0)),
            minutes: ticks.into(),
            grid: (0..=GRID)
                .map(|part| {
                    let value = most * f64::from(part) / f64::from(GRID);
                    Tick {
                        at: figures::one(scale.y(value)),
                        word: short(value),
                    }
                })
                .collect(),
            told: format!(
                "Score over {} minutes: {} {}, {} {}; fouls {} and {}; the table below has each",
                trimmed(minutes, 1),
                teams[0],
                last[0],
                teams[1],
                last[1],
                of_fouls(0),
                of_fouls(1)
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jiff::civil::date;

    #[test]
    fn a_score_rises_when_it_changes_and_a_foul_stands_in_its_sides_row() {
        let teams = ["A", "B"].map(str::to_owned);
        let changes = [(1500, [1, 0], None), (3000, [1, 1], Some(0))];
        let course = Course::of(3000, changes.into_iter(), &teams);
        assert_eq!(
            course.paths[0], "M38.0 140.0H192.0V108.0H346.0V108.0H346.0",
            "half of the time, a quarter of the height"
        );
        assert_eq!(course.paths[1], "M38.0 140.0H192.0V140.0H346.0V108.0H346.0");
        assert_eq!(
            course.fouls,
            ["M346.0 148.0l4 7h-8z", ""].map(str::to_owned)
        );
        assert!(
            course.told.contains("A 1, B 1; fouls 1 and 0"),
            "{}",
            course.told
        );
        let none = Course::of(0, std::iter::empty(), &teams);
        assert_eq!(none.paths[0], "M38.0 140.0H346.0");
    }

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
    fn times_stand_by_their_powers_of_ten_and_none_lies_outside() {
        let span = Span {
            name: "hit",
            mean: 0.1,
            p99: 10.0,
            max: 5000.0,
            counted: Vec::new(),
        };
        let strip = Strip::of(std::slice::from_ref(&span), Some([0.001, 1.0]));
        assert!(!strip.has_shapes && strip.height == 56, "{strip:?}");
        let counted = |from, to, count| Counted { from, to, count };
        let told = Span {
            counted: vec![
                counted(0.1, 1.0, 99),
                counted(1.0, 10.0, 0),
                counted(10.0, 100.0, 9),
            ],
            ..span
        };
        let tall = Strip::of(&[told], None);
        assert!(tall.has_shapes);
        assert_eq!(
            tall.rows[0].shape, "M115.6 40V14.0H173.2V40zM230.8 40V27.0H288.4V40z",
            "a tenth of the times is half as high; none is nothing"
        );
        let rows: Vec<_> = tall
            .counts
            .iter()
            .map(|row| (&*row.from, &*row.counts))
            .collect();
        assert_eq!(rows, [("0.10", &[99][..]), ("10", &[9])]);
        let row = &strip.rows[0];
        assert_eq!(
            [&row.mean, &row.p99, &row.max],
            ["115.6", "230.8", "346.0"],
            "a fifth, three fifths, and the end"
        );
        assert_eq!(strip.floor, Some(["58.0", "115.2"].map(str::to_owned)));
        assert_eq!(strip.limit, "248.1");
        assert!(
            strip
                .told
                .contains("hit: mean 0.1, 99th percentile 10, maximum 5000")
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
    fn a_scale_ends_at_a_round_number_and_has_room_for_the_first_bound() {
        for (value, most) in [
            (0.3, 0.4),
            (0.5, 0.8),
            (1.0, 1.0),
            (9.0, 10.0),
            (37.0, 40.0),
        ] {
            assert!((nice(value) - most).abs() < 1e-12, "{value}");
        }
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
