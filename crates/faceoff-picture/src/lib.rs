//! Pictures: SVG with text as outlines, drawn to pixels, and written as PNG or as an animated GIF.
//!
//! An SVG drawing of this crate has no text elements: [`text`] writes the outlines of two fonts that are part of the program. So a
//! picture is the same on each machine, and needs no fonts there. The crate knows nothing about what is drawn.

mod animation;
mod canvas;
mod font;
mod hypotf;
mod pixels;
pub mod text;

pub use animation::{Animation, FRAME_TIME_CS, Palette};
pub use canvas::Drawing;
pub use font::Weight;
pub use pixels::{Picture, PictureError};
pub use text::{Align, TextStyle};
