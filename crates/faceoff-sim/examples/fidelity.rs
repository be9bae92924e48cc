//! Draws the figures of `docs/simulator.md`: the differences between the simulator and recordings of the *reference* (the simulator of the
//! 2023 Robot Air Hockey Challenge). A *replay* is a simulated episode with the recorded actions. A *contact* of the puck is
//! a *bounce* off a rim or an *impact* of a mallet.
//!
//! `cargo run -p faceoff-sim --example fidelity -- docs/images/fidelity`

#![expect(clippy::print_stdout, reason = "the example reports its results")]
#![expect(
    clippy::unwrap_used,
    reason = "a recording that cannot be read ends the program"
)]

#[path = "../tests/it/reference.rs"]
mod reference;
#[path = "../tests/it/replay.rs"]
#[expect(dead_code, reason = "only the tests use all of it")]
mod replay;

use faceoff_sim::{Interpolation, Plant, World};
use plotters::{coord::Shift, prelude::*};
use reference::{array, flat, max_difference, quantile, recording, rows};
use replay::{Replay, bounces, episodes, impacts};
use std::{error::Error, ops::Range, path::Path};

type DrawResult = Result<(), Box<dyn Error>>;
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// A line of a chart: name and points.
type Line = (String, Vec<(f64, f64)>);

/// Differences below this are drawn at this value: the recordings have 9 digits.
const FLOOR: f64 = 1e-11;

const BLUE_LINE: RGBColor = RGBColor(0, 90, 160);
const COLOURS: [RGBColor; 4] = [
    BLUE_LINE,
    RGBColor(200, 80, 0),
    RGBColor(0, 130, 90),
    RGBColor(140, 60, 150),
];

fn main() -> DrawResult {
    let folder = std::env::args_os()
        .nth(1)
        .ok_or("expected the output folder, for example docs/images/fidelity")?;
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    draw_arm(&folder.join("arm.svg"))?;
    draw_contacts(&folder.join("contacts.svg"))?;
    let replays = episodes();
    draw_episodes(&folder.join("episodes.svg"), &replays)?;
    draw_paths(&folder.join("paths.svg"), &replays)?;
    println!("drawn in {}", folder.display());
    Ok(())
}

/// Draws one recorded motion of the arm with the simulated one, and the largest joint difference of each motion over time.
fn draw_arm(file: &Path) -> DrawResult {
    const CONTROL_STEP_S: f64 = 0.02;
    let recording = recording("arm_tracking");
    let initial_q: [f64; 7] = array(&recording["init_q"]);
    let mut lines = vec![];
    let mut sample_motion: Vec<Line> = vec![];
    for case in recording["cases"].as_array().unwrap() {
        let interpolation = Interpolation::from_code(case["interpolation_order"].as_i64()).unwrap();
        let mut world = World::new(
            &Plant::nominal(),
            &[initial_q],
            [0.5, 0.0, 0.0, 0.0, 0.0, 0.0],
        );
        let recorded: Vec<[f64; 7]> = rows(&case["q"]);
        let mut line = vec![];
        let mut simulated = vec![];
        for (step, action) in case["actions"].as_array().unwrap().iter().enumerate() {
            world.command(0, interpolation, &flat(action));
            // No air flow: no force on the puck.
            world.control_step(|_| [0.0; 2]);
            let t = CONTROL_STEP_S * (step + 1) as f64;
            let difference = max_difference(&recorded[step + 1], &world.joints(0));
            line.push((t, difference.max(FLOOR)));
            simulated.push((t, world.joints(0)));
        }
        if sample_motion.is_empty() && interpolation == Interpolation::Quintic {
            for joint in 0..4 {
                let recorded_line = recorded.iter().enumerate();
                let recorded_line =
                    recorded_line.map(|(k, q)| (CONTROL_STEP_S * k as f64, q[joint]));
                sample_motion.push((format!("joint {}", joint + 1), recorded_line.collect()));
                let simulated_line = simulated.iter().map(|(t, q)| (*t, q[joint]));
                sample_motion.push((String::new(), simulated_line.collect()));
            }
        }
        lines.push((String::new(), line));
    }
    let largest = lines
        .iter()
        .flat_map(|(_, line)| line)
        .fold(0.0, |largest: f64, (_, difference)| {
            largest.max(*difference)
        });
    println!(
        "arm: {} motions, largest difference {largest:.1e} rad",
        lines.len()
    );
    let motions = lines.len();
    picture(file, (960, 360), |root| {
        let (left, right) = root.split_horizontally(480);
        overlay(
            &left,
            "one motion: recorded (wide) and simulated (thin)",
            ["t, s", "q, rad"],
            &sample_motion,
        )?;
        logarithmic(
            &right,
            &format!("all {motions} motions: largest joint difference"),
            ["t, s", "rad"],
            1e-11..1e-5,
            &lines,
            Some((1e-6, "bound")),
        )
    })
}

/// Draws cumulative distributions of the difference in the puck's velocity after a contact.
fn draw_contacts(file: &Path) -> DrawResult {
    let (bounces, impacts) = (bounces(), impacts());
    let bounce_errors = |kinds: &[&str]| -> Vec<f64> {
        let selected = bounces
            .iter()
            .filter(|bounce| kinds.contains(&bounce.kind.as_str()));
        selected.map(|bounce| bounce.errors().0).collect()
    };
    let impact_errors = |moved_by_arm: bool| -> Vec<f64> {
        let selected = impacts
            .iter()
            .filter(|impact| impact.is_moved_by_arm() == moved_by_arm);
        selected.map(|impact| impact.velocity_error).collect()
    };
    let lines = [
        ("rim", bounce_errors(&["wall", "wall_spin"])),
        ("corner", bounce_errors(&["corner"])),
        ("mallet, moved by the arm", impact_errors(true)),
        ("mallet, imposed", impact_errors(false)),
    ]
    .map(|(name, mut errors)| {
        let (median, p90) = (quantile(&mut errors, 0.5), quantile(&mut errors, 0.9));
        println!(
            "{name}: {} cases, velocity median {:.3} %, 90th percentile {:.3} %",
            errors.len(),
            100.0 * median,
            100.0 * p90
        );
        (format!("{name} ({})", errors.len()), cumulative(&errors))
    });
    picture(file, (720, 380), |root| {
        let mut chart = ChartBuilder::on(root)
            .caption(
                "velocity after a contact: difference over the speed",
                ("sans-serif", 16),
            )
            .margin(12)
            .x_label_area_size(36)
            .y_label_area_size(48)
            .build_cartesian_2d((1e-7..0.1).log_scale(), 0.0..1.0)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .x_desc("relative difference")
            .y_desc("share of the cases")
            .x_label_formatter(&|x| format!("{x:.0e}"))
            .draw()?;
        for ((name, line), colour) in lines.iter().zip(COLOURS) {
            chart
                .draw_series(LineSeries::new(
                    line.iter().copied(),
                    colour.stroke_width(2),
                ))?
                .label(name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour));
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .background_style(WHITE.mix(0.8))
            .draw()?;
        Ok(())
    })
}

/// Draws the differences of puck and joints in the replays, around the puck's first contact and its first impact with a mallet.
fn draw_episodes(file: &Path, replays: &[Replay]) -> DrawResult {
    // From 10 control steps before `zero_step` to 60 after it.
    let line = |replay: &Replay, zero_step: usize, value: &dyn Fn(usize) -> f64| -> Line {
        let first = zero_step.saturating_sub(10).min(replay.steps.len());
        let points = (first..replay.steps.len().min(zero_step.saturating_add(60)))
            .map(|step| (step as f64 - zero_step as f64, value(step).max(FLOOR)));
        (String::new(), points.collect())
    };
    let pucks: Vec<Line> = replays
        .iter()
        .map(|replay| {
            line(replay, replay.first_contact_step, &|step| {
                replay.steps[step].puck_m
            })
        })
        .collect();
    let joints: Vec<Line> = replays
        .iter()
        .filter(|replay| replay.first_mallet_impact_step != usize::MAX)
        .map(|replay| {
            line(replay, replay.first_mallet_impact_step, &|step| {
                replay.steps[step].joints_rad
            })
        })
        .collect();
    let mut distances: Vec<f64> = replays
        .iter()
        .map(|replay| replay.largest(|step| step <= replay.first_contact_step + 8, |d| d.puck_m))
        .collect();
    println!(
        "episodes: puck until 8 steps after its first contact: median {:.1e} m, 90th percentile {:.1e} m, \
         {} of {} within 5 mm",
        quantile(&mut distances, 0.5),
        quantile(&mut distances, 0.9),
        distances.iter().filter(|d| **d <= 0.005).count(),
        distances.len()
    );
    picture(file, (960, 380), |root| {
        let (left, right) = root.split_horizontally(480);
        logarithmic(
            &left,
            "puck: distance from the recorded one",
            ["control steps after its first contact", "m"],
            1e-9..1.0,
            &pucks,
            Some((0.005, "5 mm")),
        )?;
        logarithmic(
            &right,
            "joints: largest difference",
            ["control steps after the first mallet impact", "rad"],
            1e-10..1e-1,
            &joints,
            Some((5e-4, "bound")),
        )
    })
}

/// Draws the paths of some pucks over the table.
fn draw_paths(file: &Path, replays: &[Replay]) -> DrawResult {
    let path = |puck: &[[f64; 6]]| puck.iter().map(|p| (p[0], p[1])).collect();
    let mut lines = vec![];
    for name in ["hit 7", "defend 3", "prepare 0", "defend 14"] {
        let replay = replays.iter().find(|replay| replay.name == name).unwrap();
        lines.push((name.to_owned(), path(&replay.recorded_puck)));
        lines.push((String::new(), path(&replay.puck)));
    }
    picture(file, (960, 520), |root| {
        overlay(
            root,
            "pucks of four episodes: recorded (wide) and simulated (thin)",
            ["x, m", "y, m"],
            &lines,
        )
    })
}

/// Creates an SVG file of `size` pixels and draws into it.
fn picture(
    file: &Path,
    size: (u32, u32),
    draw: impl FnOnce(&Area<'_>) -> DrawResult,
) -> DrawResult {
    let root = SVGBackend::new(file, size).into_drawing_area();
    root.fill(&WHITE)?;
    draw(&root)?;
    root.present()?;
    Ok(())
}

/// Draws pairs of lines: the recorded one wide and pale, the simulated one thin on top.
fn overlay(area: &Area<'_>, caption: &str, [x, y]: [&str; 2], lines: &[Line]) -> DrawResult {
    let points = || lines.iter().flat_map(|(_, line)| line);
    let mut chart = ChartBuilder::on(area)
        .caption(caption, ("sans-serif", 16))
        .margin(12)
        .x_label_area_size(36)
        .y_label_area_size(48)
        .build_cartesian_2d(
            range(points().map(|(x, _)| *x)),
            range(points().map(|(_, y)| *y)),
        )?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .x_desc(x)
        .y_desc(y)
        .draw()?;
    for (pair, colour) in lines.chunks(2).zip(COLOURS) {
        let [(name, recorded), (_, simulated)] = pair else {
            continue;
        };
        let wide = colour.mix(0.3).stroke_width(6);
        chart
            .draw_series(LineSeries::new(recorded.iter().copied(), wide))?
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour));
        chart.draw_series(LineSeries::new(
            simulated.iter().copied(),
            colour.stroke_width(1),
        ))?;
    }
    chart
        .configure_series_labels()
        .background_style(WHITE.mix(0.8))
        .draw()?;
    Ok(())
}

/// Draws many lines over a logarithmic axis, and a bound.
fn logarithmic(
    area: &Area<'_>,
    caption: &str,
    [x, y]: [&str; 2],
    y_range: Range<f64>,
    lines: &[Line],
    bound: Option<(f64, &str)>,
) -> DrawResult {
    let x_range = range(lines.iter().flat_map(|(_, line)| line).map(|(x, _)| *x));
    let mut chart = ChartBuilder::on(area)
        .caption(caption, ("sans-serif", 16))
        .margin(12)
        .x_label_area_size(36)
        .y_label_area_size(60)
        .build_cartesian_2d(x_range.clone(), y_range.log_scale())?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .x_desc(x)
        .y_desc(y)
        .y_label_formatter(&|y| format!("{y:.0e}"))
        .draw()?;
    for (_, line) in lines {
        chart.draw_series(LineSeries::new(line.iter().copied(), BLUE_LINE.mix(0.35)))?;
    }
    if let Some((value, name)) = bound {
        let ends = [(x_range.start, value), (x_range.end, value)];
        chart
            .draw_series(LineSeries::new(ends, RED.stroke_width(2)))?
            .label(name)
            .legend(|(x, y)| PathElement::new([(x, y), (x + 18, y)], RED));
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.8))
            .draw()?;
    }
    Ok(())
}

/// The range of some numbers, with a margin.
fn range(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    let margin = 0.03 * (high - low);
    low - margin..high + margin
}

/// Sorted values with the share of values up to each.
fn cumulative(sorted: &[f64]) -> Vec<(f64, f64)> {
    let n = sorted.len() as f64;
    let steps = sorted.iter().enumerate();
    steps
        .map(|(k, value)| (value.max(1e-7), (k + 1) as f64 / n))
        .collect()
}
