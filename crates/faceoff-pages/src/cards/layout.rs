//! The layout of a card: the head of the pages, and below it text and bars. Readable at a third of its size, which is what a chat
//! shows.

use super::style::colour;
use crate::{
    assets,
    format::{self, one_decimal},
};
use faceoff_api::views::task::TaskView;
use faceoff_picture::{Align, Drawing, TextStyle, Weight, text::is_legible};
use faceoff_types::{Competition, TaskMap, TaskWeights, Tier};

/// The size that programs expect of cards.
const WIDTH_PX: u32 = 1200;
const HEIGHT_PX: u32 = 630;
/// The left and right end of the content.
pub(super) const LEFT: f64 = 60.0;
pub(super) const RIGHT: f64 = 1140.0;
/// The line below the head.
const HEAD_LINE: f64 = 104.0;
/// Largest number of tasks with a bar.
const MAX_TASKS: usize = 4;

/// A card that is being drawn.
pub(super) struct Card {
    drawing: Drawing,
}

/// The style of the title of a tier.
pub(super) fn tier_style(tier: Tier, size_px: f64) -> TextStyle {
    let colour_name = match tier {
        Tier::Deployable => "good",
        Tier::Improvable => "fair",
        Tier::NonDeployable => "poor",
    };
    text_style(Weight::Semibold, size_px, colour_name)
}

/// The style of a text in a colour of the pages.
pub(super) fn text_style(weight: Weight, size_px: f64, colour_name: &str) -> TextStyle {
    TextStyle::new(weight, size_px, colour(colour_name))
}

impl Card {
    /// A card with the name of the site on the left of its head, and `context`, such as the competition, on the right.
    pub(super) fn new(context: &str) -> Self {
        let mut card = Self {
            drawing: Drawing::new(WIDTH_PX, HEIGHT_PX, colour("ground")),
        };
        let icon = assets::ICON.text();
        let placed_svg = format!("<svg x=\"{LEFT}\" y=\"34\" width=\"48\" height=\"48\" ");
        card.drawing
            .elements(&icon.replacen("<svg ", &placed_svg, 1));
        let brand = text_style(Weight::Semibold, 36.0, "ink");
        card.text("Faceoff", &brand, [LEFT + 66.0, 71.0], 300.0);
        let soft = text_style(Weight::Regular, 32.0, "soft");
        card.text_at_end(context, &soft, [RIGHT, 70.0], 700.0);
        card.drawing
            .rectangle([LEFT, HEAD_LINE], [RIGHT - LEFT, 4.0], colour("ink"));
        card
    }

    pub(super) fn into_drawing(self) -> Drawing {
        self.drawing
    }

    /// A text from `position` on, truncated to its width. A text of which no letter can be drawn is replaced.
    pub(super) fn text(&mut self, text: &str, style: &TextStyle, position: [f64; 2], width: f64) {
        self.aligned_text(text, style, position, width, Align::Left);
    }

    /// [`text`](Self::text) up to `position`.
    pub(super) fn text_at_end(
        &mut self,
        text: &str,
        style: &TextStyle,
        position: [f64; 2],
        width: f64,
    ) {
        self.aligned_text(text, style, position, width, Align::Right);
    }

    pub(super) fn aligned_text(
        &mut self,
        text: &str,
        style: &TextStyle,
        position: [f64; 2],
        width: f64,
        align: Align,
    ) {
        let text = style.truncated(legible(text), width);
        self.drawing.text(&text, style, position, align);
    }

    /// Lines of text; returns the baseline of the next line.
    pub(super) fn paragraph(
        &mut self,
        text: &str,
        style: &TextStyle,
        [x, mut y]: [f64; 2],
        (width, max_lines): (f64, usize),
    ) -> f64 {
        for line in style.wrapped(legible(text), width, max_lines) {
            self.drawing.text(&line, style, [x, y], Align::Left);
            y += 1.25 * style.size_px;
        }
        y
    }

    /// SVG elements.
    pub(super) fn elements(&mut self, svg: &str) {
        self.drawing.elements(svg);
    }

    /// Title and subtitle below the head.
    pub(super) fn title(&mut self, title: &str, subtitle: &str) {
        let width = RIGHT - LEFT;
        let large = text_style(Weight::Semibold, 64.0, "ink");
        self.text(title, &large, [LEFT, 190.0], width);
        let soft = text_style(Weight::Regular, 36.0, "soft");
        self.text(subtitle, &soft, [LEFT, 244.0], width);
    }

    /// A sentence in place of a result, with its first line at `y`.
    pub(super) fn note(&mut self, text: &str, y: f64) {
        let soft = text_style(Weight::Regular, 40.0, "soft");
        self.paragraph(text, &soft, [LEFT, y], (RIGHT - LEFT, 3));
    }

    /// The score in large figures with its interval and its tier.
    pub(super) fn score(&mut self, score: &PercentWithInterval, tier: Option<Tier>) {
        let soft = text_style(Weight::Regular, 34.0, "soft");
        self.text("Score", &soft, [LEFT, 336.0], 400.0);
        let figure = text_style(Weight::Semibold, 116.0, "ink");
        self.text(
            &format!("{} %", score.percent()),
            &figure,
            [LEFT - 4.0, 446.0],
            500.0,
        );
        self.text(
            &format!("{}, 95 % interval", score.interval()),
            &soft,
            [LEFT, 504.0],
            500.0,
        );
        if let Some(tier) = tier {
            self.text(tier.title(), &tier_style(tier, 40.0), [LEFT, 570.0], 500.0);
        }
    }

    /// A bar per task with its title and success rate, in the order of the competition.
    pub(super) fn tasks(&mut self, competition: &Competition, results: &TaskMap<TaskView>) {
        const BARS_LEFT: f64 = 640.0;
        let label = text_style(Weight::Regular, 36.0, "ink");
        let figure = text_style(Weight::Semibold, 38.0, "ink");
        let tasks = competition.tasks.iter();
        let tasks = tasks.filter_map(|info| Some((&info.title, results.get(&info.task)?)));
        let mut y = 336.0;
        for (title, result) in tasks.take(MAX_TASKS) {
            let rate = PercentWithInterval::of_task(result);
            self.text(title, &label, [BARS_LEFT, y], 330.0);
            let percent = format!("{} %", rate.percent());
            self.text_at_end(&percent, &figure, [RIGHT, y], 200.0);
            self.bar(&rate, [BARS_LEFT, y + 28.0], (RIGHT - BARS_LEFT, 18.0));
            y += 100.0;
        }
    }

    /// A scale from 0 to 100 with a mark at 50, the interval as a range of this thickness and the value as a line, as on the
    /// board.
    pub(super) fn bar(
        &mut self,
        value: &PercentWithInterval,
        [x, y]: [f64; 2],
        (width, thickness): (f64, f64),
    ) {
        let at = |percent: f64| x + width * percent.clamp(0.0, 100.0) / 100.0;
        let [low, high] = value.interval.map(at);
        let mut rectangle_around = |x: f64, width: f64, height: f64, colour_name: &str| {
            let corner = [x - width / 2.0, y - height / 2.0];
            self.drawing
                .rectangle(corner, [width, height], colour(colour_name));
        };
        rectangle_around(x + width / 2.0, width, 3.0, "track");
        for mark in [0.0, 50.0, 100.0] {
            rectangle_around(at(mark), 3.0, thickness, "track");
        }
        rectangle_around(
            f64::midpoint(low, high),
            (high - low).max(2.0),
            thickness,
            "range",
        );
        rectangle_around(at(value.percent), 6.0, thickness + 8.0, "ink");
    }
}

/// The text, or a replacement if the fonts have none of its characters.
pub(super) fn legible(text: &str) -> &str {
    match is_legible(text) {
        true => text,
        false => "(name in another script)",
    }
}

/// A score or a success rate with its interval, in percent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PercentWithInterval {
    percent: f64,
    interval: [f64; 2],
}

impl PercentWithInterval {
    pub(super) fn of_task(result: &TaskView) -> Self {
        Self {
            percent: 100.0 * result.success_rate,
            interval: result.success_ci95.map(|end| 100.0 * end),
        }
    }

    pub(super) fn of_score(score: f64, tasks: &TaskMap<TaskView>, weights: &TaskWeights) -> Self {
        Self {
            percent: score,
            interval: format::score_interval(score, tasks, weights),
        }
    }

    pub(super) fn percent(&self) -> String {
        one_decimal(self.percent)
    }

    pub(super) fn interval(&self) -> String {
        let [low, high] = self.interval.map(one_decimal);
        format!("{low} – {high}")
    }
}
