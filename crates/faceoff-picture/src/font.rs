//! The fonts: advances and outlines of their glyphs.

use std::{fmt::Write, sync::OnceLock};
use ttf_parser::{Face, GlyphId, OutlineBuilder};

/// A font of the program by its weight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weight {
    Regular,
    Semibold,
}

/// Size of the box that replaces a character which the font lacks, in em.
const BOX_EM: [f64; 2] = [0.5, 0.7];
/// Advance of such a box, in em.
const BOX_ADVANCE_EM: f64 = 0.6;

/// How the font draws a character.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shape {
    Glyph(GlyphId),
    /// The font lacks the character.
    Box,
}

/// Where a glyph is drawn: the left end of its baseline, and the size of an em, in pixels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Placement {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) size_px: f64,
}

impl Weight {
    fn face(self) -> &'static Face<'static> {
        static REGULAR: OnceLock<Face<'static>> = OnceLock::new();
        static SEMIBOLD: OnceLock<Face<'static>> = OnceLock::new();
        let (face, bytes): (_, &'static [u8]) = match self {
            Self::Regular => (&REGULAR, include_bytes!("../fonts/regular.ttf")),
            Self::Semibold => (&SEMIBOLD, include_bytes!("../fonts/semibold.ttf")),
        };
        face.get_or_init(|| Face::parse(bytes, 0).expect("the font is a part of the program"))
    }

    /// Does the font have this character?
    pub(crate) fn covers(self, character: char) -> bool {
        self.face().glyph_index(character).is_some()
    }

    pub(crate) fn shape(self, character: char) -> Shape {
        let glyph = self.face().glyph_index(character);
        glyph.map_or(Shape::Box, Shape::Glyph)
    }

    /// The advance of a character, in em.
    pub(crate) fn advance_em(self, shape: Shape) -> f64 {
        match shape {
            Shape::Glyph(glyph) => {
                let units = self.face().glyph_hor_advance(glyph).unwrap_or_default();
                f64::from(units) / self.units_per_em()
            }
            Shape::Box => BOX_ADVANCE_EM,
        }
    }

    /// Appends the outline of a character to SVG path data.
    pub(crate) fn outline(self, shape: Shape, placement: Placement, path: &mut String) {
        match shape {
            Shape::Glyph(glyph) => {
                let mut outline = PathWriter {
                    path,
                    placement,
                    scale: placement.size_px / self.units_per_em(),
                };
                // A glyph without an outline, such as the space, draws nothing.
                let _bounds = self.face().outline_glyph(glyph, &mut outline);
            }
            Shape::Box => draw_box(placement, path),
        }
    }

    fn units_per_em(self) -> f64 {
        f64::from(self.face().units_per_em())
    }
}

/// The frame of a box: an outer rectangle, and an inner one in the opposite direction.
fn draw_box(placement: Placement, path: &mut String) {
    let Placement { x, y, size_px } = placement;
    let [width, height] = BOX_EM.map(|em| em * size_px);
    let (left, line) = (x + 0.05 * size_px, 0.06 * size_px);
    let (inner_width, inner_height) = (width - 2.0 * line, height - 2.0 * line);
    // Writing to a string does not fail.
    let _written = write!(
        path,
        "M{left:.1} {y:.1}h{width:.1}v{:.1}h{:.1}zM{:.1} {:.1}v{:.1}h{inner_width:.1}v{inner_height:.1}z",
        -height,
        -width,
        left + line,
        y - line,
        -inner_height,
    );
}

/// Writes an outline as SVG path data. Fonts have their y axis up.
struct PathWriter<'a> {
    path: &'a mut String,
    placement: Placement,
    /// Pixels per font unit.
    scale: f64,
}

impl PathWriter<'_> {
    fn command<const N: usize>(&mut self, letter: char, points: [[f32; 2]; N]) {
        self.path.push(letter);
        for (index, [x, y]) in points.into_iter().enumerate() {
            let x = self.placement.x + self.scale * f64::from(x);
            let y = self.placement.y - self.scale * f64::from(y);
            let gap = if index == 0 { "" } else { " " };
            // Writing to a string does not fail.
            let _written = write!(self.path, "{gap}{x:.1} {y:.1}");
        }
    }
}

impl OutlineBuilder for PathWriter<'_> {
    fn move_to(&mut self, x: f32, y: f32) {
        self.command('M', [[x, y]]);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.command('L', [[x, y]]);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.command('Q', [[x1, y1], [x, y]]);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.command('C', [[x1, y1], [x2, y2], [x, y]]);
    }

    fn close(&mut self) {
        self.path.push('Z');
    }
}
