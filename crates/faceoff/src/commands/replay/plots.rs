//! Plots of an episode over time: positions, joint speeds, constraints and computation times.

use super::recording::{CONSTRAINTS, EpisodeRecording, time_s};
use faceoff_scoring::COMPUTATION_TIME_LIMITS_S;
use faceoff_sim::{JOINTS, model::LIMIT_FRACTION};
use plotters::prelude::*;
use std::ops::Range;

/// Space for labels left of the plot, px.
const LABELS_PX: u32 = 56;
/// Space around each chart, px.
const MARGIN_PX: u32 = 8;
/// Space for the legend right of the plot, px.
const LEGEND_PX: u32 = 150;
/// Height of a chart, px.
const CHART_PX: u32 = 150;

/// One colour per line, the palette of Okabe and Ito, which colour-blind readers can distinguish.
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(80, 80, 80),
];

struct Chart {
    caption: String,
    lines: Vec<Line>,
    /// Limits of the values, drawn as red lines.
    limits: Vec<f64>,
    /// Values outside of this range are drawn at its edge.
    max_range: Range<f64>,
}

struct Line {
    name: String,
    /// Time (s) and value.
    points: Vec<(f64, f64)>,
    /// Draw dots instead of a line.
    is_dotted: bool,
}

/// All plots of an episode, one below the other.
pub struct Plots {
    pub svg: String,
    pub height_px: u32,
    /// Start and end of the time axis, px from the left.
    pub axis_px: [i32; 2],
}

pub fn draw(recording: &EpisodeRecording, width_px: u32) -> anyhow::Result<Plots> {
    let charts = charts(recording);
    let end_s = time_s(recording.puck.len().max(2) - 1);
    let height_px = CHART_PX * u32::try_from(charts.len())?;
    let mut svg = String::new();
    let mut axis_px = [0, 0];
    {
        let root = SVGBackend::with_string(&mut svg, (width_px, height_px)).into_drawing_area();
        for (area, chart) in root.split_evenly((charts.len(), 1)).iter().zip(&charts) {
            axis_px = chart.draw(area, end_s)?;
        }
        root.present()?;
    }
    Ok(Plots {
        svg,
        height_px,
        axis_px,
    })
}

fn charts(recording: &EpisodeRecording) -> Vec<Chart> {
    let puck_chart = |axis: usize, name: &str| Chart {
        caption: format!("puck {name} (m), table frame: true and observed"),
        lines: vec![
            Line::from_start(
                "observed",
                recording
                    .observed_puck
                    .iter()
                    .map(|position| position[axis]),
            )
            .dotted(),
            Line::from_start("true", recording.puck.iter().map(|position| position[axis])),
        ],
        limits: Vec::new(),
        max_range: f64::MIN..f64::MAX,
    };
    // `constraint` is an index of `CONSTRAINTS`; `scale` converts its unit to the chart's.
    let constraint_line = |constraint: usize, scale: f64| {
        let values = recording
            .constraints
            .iter()
            .map(move |values| scale * values[constraint]);
        Line::after_steps(CONSTRAINTS[constraint].0, values)
    };
    vec![
        puck_chart(0, "x"),
        puck_chart(1, "y"),
        Chart {
            caption: "mallet (m), table frame".to_owned(),
            lines: vec![
                Line::from_start("x", recording.mallet.iter().map(|position| position[0])),
                Line::from_start("y", recording.mallet.iter().map(|position| position[1])),
            ],
            limits: Vec::new(),
            max_range: f64::MIN..f64::MAX,
        },
        Chart {
            caption: "joint speeds, % of their limits (filtered; at most 95 % allowed)".to_owned(),
            lines: (0..JOINTS)
                .map(|joint| {
                    let shares = recording
                        .speed_share
                        .iter()
                        .map(|share| 100.0 * share[joint]);
                    Line::after_steps(&format!("{}", joint + 1), shares)
                })
                .collect(),
            limits: vec![-100.0 * LIMIT_FRACTION, 100.0 * LIMIT_FRACTION],
            max_range: -120.0..120.0,
        },
        Chart {
            caption: "constraints (mm): violated above 0".to_owned(),
            lines: vec![constraint_line(2, 1e3), constraint_line(3, 1e3)],
            limits: vec![0.0],
            max_range: -60.0..40.0,
        },
        Chart {
            caption: "constraints (rad, rad/s): violated above 0".to_owned(),
            lines: vec![constraint_line(0, 1.0), constraint_line(1, 1.0)],
            limits: vec![0.0],
            max_range: -1.5..0.5,
        },
        Chart {
            caption: "computation time (ms): penalty from 20 ms".to_owned(),
            lines: vec![Line::after_steps(
                "per step",
                recording.computation_time_s.iter().map(|s| 1e3 * s),
            )],
            limits: vec![1e3 * COMPUTATION_TIME_LIMITS_S[0]],
            max_range: 0.0..f64::MAX,
        },
    ]
}

impl Line {
    /// A line through values after 0, 1, 2 … steps.
    fn from_start(name: &str, values: impl Iterator<Item = f64>) -> Self {
        Self {
            name: name.to_owned(),
            points: values
                .enumerate()
                .map(|(k, value)| (time_s(k), value))
                .collect(),
            is_dotted: false,
        }
    }

    /// A line through values after 1, 2, 3 … steps.
    fn after_steps(name: &str, values: impl Iterator<Item = f64>) -> Self {
        let mut line = Self::from_start(name, values);
        for (time, _) in &mut line.points {
            *time += time_s(1);
        }
        line
    }

    fn dotted(mut self) -> Self {
        self.is_dotted = true;
        self
    }
}

impl Chart {
    /// The range of the value axis.
    fn range(&self) -> Range<f64> {
        let values = self
            .lines
            .iter()
            .flat_map(|line| &line.points)
            .map(|(_, value)| *value);
        let values = values.map(|value| value.clamp(self.max_range.start, self.max_range.end));
        let (low, high) = values
            .chain(self.limits.iter().copied())
            .fold((f64::MAX, f64::MIN), |(low, high), value| {
                (low.min(value), high.max(value))
            });
        let margin = 0.06 * (high - low).max(0.02);
        if low > high {
            -1.0..1.0
        } else {
            low - margin..high + margin
        }
    }

    fn draw<DB: DrawingBackend>(
        &self,
        area: &DrawingArea<DB, plotters::coord::Shift>,
        end_s: f64,
    ) -> anyhow::Result<[i32; 2]>
    where
        DB::ErrorType: 'static,
    {
        let range = self.range();
        let (low, high) = (range.start, range.end);
        let mut chart = ChartBuilder::on(area)
            .caption(&self.caption, ("sans-serif", 13))
            .margin(MARGIN_PX)
            .margin_right(LEGEND_PX)
            .x_label_area_size(20)
            .y_label_area_size(LABELS_PX)
            .build_cartesian_2d(0.0..end_s, range)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .x_labels(11)
            .y_labels(5)
            .x_label_formatter(&|time| format!("{time:.1} s"))
            .y_label_formatter(&|value| format!("{}", (value * 1e3).round() / 1e3 + 0.0))
            .label_style(("sans-serif", 11))
            .draw()?;
        for limit in &self.limits {
            chart.draw_series(LineSeries::new([(0.0, *limit), (end_s, *limit)], RED))?;
        }
        for (line, colour) in self.lines.iter().zip(COLOURS) {
            let shown = line
                .points
                .iter()
                .map(|(time, value)| (*time, value.clamp(low, high)));
            if line.is_dotted {
                chart.draw_series(
                    shown.map(|point| Circle::new(point, 1, BLACK.mix(0.6).filled())),
                )?;
            } else {
                chart.draw_series(LineSeries::new(shown, colour.stroke_width(1)))?;
            }
        }
        let (axis, _) = chart.plotting_area().get_pixel_range();
        // The library can only place a legend inside the plot, where it would hide the end of the episode. Positions are in px.
        let mut y = 14;
        for (line, colour) in self.lines.iter().zip(COLOURS) {
            let colour = if line.is_dotted { BLACK } else { colour };
            let x = axis.end + 10;
            area.draw(&PathElement::new(
                [(x, y), (x + 14, y)],
                colour.stroke_width(2),
            ))?;
            area.draw(&Text::new(
                line.name.clone(),
                (x + 19, y - 5),
                ("sans-serif", 11),
            ))?;
            y += 14;
        }
        Ok([axis.start, axis.end])
    }
}
