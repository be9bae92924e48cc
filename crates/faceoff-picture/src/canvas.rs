//! An SVG drawing, element by element.

use crate::text::{Align, TextStyle};
use std::fmt::Write;

/// An SVG drawing on a ground of one colour. Lengths are in pixels.
#[derive(Debug, Clone)]
pub struct Drawing {
    width_px: u32,
    height_px: u32,
    elements: String,
}

impl Drawing {
    /// A drawing with nothing but its ground.
    #[must_use]
    pub fn new(width_px: u32, height_px: u32, ground: &str) -> Self {
        let mut drawing = Self::transparent(width_px, height_px);
        drawing.rectangle([0.0, 0.0], [width_px.into(), height_px.into()], ground);
        drawing
    }

    /// An empty drawing, to be drawn over another one.
    #[must_use]
    pub const fn transparent(width_px: u32, height_px: u32) -> Self {
        Self {
            width_px,
            height_px,
            elements: String::new(),
        }
    }

    pub fn rectangle(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2], fill: &str) {
        // Writing to a string does not fail.
        let _written = write!(
            self.elements,
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"{fill}\"/>"
        );
    }

    /// Adds a text with its baseline at `position`.
    pub fn text(&mut self, text: &str, style: &TextStyle, position: [f64; 2], align: Align) {
        self.elements += &style.svg(text, position, align);
    }

    /// Adds SVG elements.
    pub fn elements(&mut self, svg: &str) {
        self.elements += svg;
    }

    /// The drawing as an SVG file.
    #[must_use]
    pub fn svg(&self) -> String {
        let Self {
            width_px,
            height_px,
            elements,
        } = self;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width_px}\" height=\"{height_px}\" \
             viewBox=\"0 0 {width_px} {height_px}\">{elements}</svg>"
        )
    }
}
