//! Drawings as pixels, and pixels as PNG.

use crate::canvas::Drawing;
use resvg::{
    tiny_skia::{Pixmap, Transform},
    usvg::{Options, Tree},
};
use thiserror::Error;

/// Pixels of a drawing.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture(Pixmap);

/// Why a picture cannot be made.
#[derive(Debug, Error)]
pub enum PictureError {
    #[error("expected a drawing in SVG: {0}")]
    Svg(String),
    #[error(
        "expected a picture of at least one pixel and of less than 2 GB, got {width} × {height} pixels"
    )]
    Size { width: u32, height: u32 },
    #[error("writing PNG: {0}")]
    Png(String),
    #[error("writing GIF: {0}")]
    Gif(String),
}

impl Picture {
    /// Draws an SVG drawing.
    ///
    /// # Errors
    /// If the drawing is not SVG, or has no pixel or too many.
    pub fn draw(drawing: &Drawing) -> Result<Self, PictureError> {
        let tree = parse(&drawing.svg())?;
        let size = tree.size().to_int_size();
        let (width, height) = (size.width(), size.height());
        let mut pixels = Pixmap::new(width, height).ok_or(PictureError::Size { width, height })?;
        resvg::render(&tree, Transform::identity(), &mut pixels.as_mut());
        Ok(Self(pixels))
    }

    /// Draws an SVG drawing over the picture.
    ///
    /// # Errors
    /// If the drawing is not SVG.
    pub fn draw_over(&mut self, drawing: &Drawing) -> Result<(), PictureError> {
        let tree = parse(&drawing.svg())?;
        resvg::render(&tree, Transform::identity(), &mut self.0.as_mut());
        Ok(())
    }

    /// Width and height in pixels.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        [self.0.width(), self.0.height()]
    }

    /// Red, green and blue of each pixel, line by line. Only for pictures without transparent pixels.
    #[must_use]
    pub fn rgb(&self) -> Vec<u8> {
        let pixels = self.0.pixels().iter();
        pixels
            .flat_map(|pixel| [pixel.red(), pixel.green(), pixel.blue()])
            .collect()
    }

    /// The picture as a PNG file.
    ///
    /// # Errors
    /// If the encoder fails.
    pub fn png(&self) -> Result<Vec<u8>, PictureError> {
        let png = self.0.encode_png();
        png.map_err(|error| PictureError::Png(error.to_string()))
    }
}

fn parse(svg: &str) -> Result<Tree, PictureError> {
    Tree::from_str(svg, &Options::default()).map_err(|error| PictureError::Svg(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        font::Weight,
        text::{Align, TextStyle},
    };

    #[test]
    fn drawing_has_its_size_and_colours() {
        let mut drawing = Drawing::new(30, 20, "#ffffff");
        drawing.rectangle([10.0, 0.0], [10.0, 20.0], "#1a43b8");
        let picture = Picture::draw(&drawing).unwrap();
        assert_eq!(picture.size(), [30, 20]);
        let rgb = picture.rgb();
        assert_eq!(rgb.len(), 30 * 20 * 3);
        assert_eq!(rgb[..3], [255, 255, 255]);
        assert_eq!(rgb[3 * 15..3 * 16], [0x1a, 0x43, 0xb8]);
        let png = picture.png().unwrap();
        assert!(png.starts_with(b"\x89PNG\r\n\x1a\n"));
        // Width and height follow the name of the first chunk.
        assert_eq!(png[16..24], [0, 0, 0, 30, 0, 0, 0, 20]);
    }

    #[test]
    fn text_is_drawn_in_its_colour() {
        let mut drawing = Drawing::new(200, 60, "#ffffff");
        let style = TextStyle::new(Weight::Semibold, 48.0, "#ff0000");
        drawing.text("HHH", &style, [5.0, 50.0], Align::Left);
        let rgb = Picture::draw(&drawing).unwrap().rgb();
        let is_red = |pixel: &[u8]| pixel == [255, 0, 0];
        let red = rgb.chunks(3).filter(|pixel| is_red(pixel)).count();
        assert!((500..6000).contains(&red), "{red} red pixels");
    }

    #[test]
    fn drawing_over_a_picture_keeps_the_rest() {
        let mut picture = Picture::draw(&Drawing::new(20, 10, "#00ff00")).unwrap();
        let mut spot = Drawing::transparent(20, 10);
        spot.rectangle([0.0, 0.0], [10.0, 10.0], "#0000ff");
        picture.draw_over(&spot).unwrap();
        let rgb = picture.rgb();
        assert_eq!(
            (&rgb[..3], &rgb[3 * 15..3 * 16]),
            (&[0, 0, 255][..], &[0, 255, 0][..])
        );
    }

    #[test]
    fn malformed_drawing_and_empty_picture_are_refused() {
        let mut drawing = Drawing::new(10, 10, "#fff");
        drawing.elements("<g>");
        let error = Picture::draw(&drawing).unwrap_err().to_string();
        assert!(error.starts_with("expected a drawing in SVG"), "{error}");
        assert!(Picture::draw(&Drawing::new(0, 10, "#fff")).is_err());
    }
}
