//! Animated GIF with a fixed palette: a drawing of few colours, so no frame needs a palette of its own.

use crate::pixels::{Picture, PictureError};
use gif::{Encoder, Frame, Repeat};
use std::{collections::HashMap, iter};

/// Time of a frame, in hundredths of a second, which are the units of GIF: 25 frames per second.
pub const FRAME_TIME_CS: u16 = 4;

/// Red, green, blue.
type Colour = [u8; 3];

/// Largest number of colours: a GIF has 256, of which one stands for unchanged pixels.
const MAX_COLOURS: usize = 255;

/// The colours of an animation: those of a drawing, and blends of each two, which its smooth edges have.
#[derive(Debug, Clone)]
pub struct Palette {
    colours: Vec<Colour>,
    /// The nearest colour of each one that was asked for.
    nearest: HashMap<Colour, u8>,
}

impl Palette {
    /// The palette of a drawing with these colours. Many colours have few blends or none.
    #[must_use]
    pub fn new(colours: &[Colour]) -> Self {
        let mut all: Vec<Colour> = colours.iter().copied().take(MAX_COLOURS).collect();
        let count = all.len();
        let pairs = (count * count.saturating_sub(1) / 2).max(1);
        let blends = (MAX_COLOURS - count) / pairs;
        for (index, first) in colours.iter().enumerate().take(count) {
            for second in &colours[index + 1..count] {
                all.extend((1..=blends).map(|part| blend(*first, *second, part, blends + 1)));
            }
        }
        Self {
            colours: all,
            nearest: HashMap::new(),
        }
    }

    /// The index that stands for unchanged pixels.
    fn unchanged(&self) -> u8 {
        u8::try_from(self.colours.len()).unwrap_or(u8::MAX)
    }

    /// The colours, and one for unchanged pixels.
    fn bytes(&self) -> Vec<u8> {
        let mut bytes = self.colours.concat();
        bytes.extend([0; 3]);
        bytes
    }

    /// The index of the nearest colour.
    fn index(&mut self, colour: Colour) -> u8 {
        let colours = &self.colours;
        *self.nearest.entry(colour).or_insert_with(|| {
            let distances = colours.iter().map(|other| distance(*other, colour));
            let nearest = (0_u8..=u8::MAX)
                .zip(distances)
                .min_by_key(|(_, distance)| *distance);
            nearest.map_or(0, |(index, _)| index)
        })
    }
}

/// The colour at `part` of `parts` of the way from one colour to another.
fn blend(first: Colour, second: Colour, part: usize, parts: usize) -> Colour {
    std::array::from_fn(|channel| {
        let [first, second] = [first, second].map(|colour| usize::from(colour[channel]));
        let sum = first * (parts - part) + second * part;
        u8::try_from(sum / parts).unwrap_or(u8::MAX)
    })
}

/// How much two colours differ: the squared distance of their channels.
fn distance(first: Colour, second: Colour) -> u32 {
    let squares = first.iter().zip(second).map(|(a, b)| {
        let difference = u32::from(a.abs_diff(b));
        difference * difference
    });
    squares.sum()
}

/// An animated GIF that is being written, in memory. It repeats without end.
pub struct Animation {
    encoder: Encoder<Vec<u8>>,
    palette: Palette,
    size: [u16; 2],
    /// The colours of the last frame by their index; empty before the first one.
    shown: Vec<u8>,
}

impl Animation {
    /// An animation with frames of this size.
    ///
    /// # Errors
    /// If the size is above 65,535 pixels, or the encoder fails.
    pub fn new([width, height]: [u32; 2], palette: Palette) -> Result<Self, PictureError> {
        let size = u16::try_from(width).ok().zip(u16::try_from(height).ok());
        let (columns, lines) = size.ok_or(PictureError::Size { width, height })?;
        let mut encoder =
            Encoder::new(Vec::new(), columns, lines, &palette.bytes()).map_err(gif_error)?;
        encoder.set_repeat(Repeat::Infinite).map_err(gif_error)?;
        Ok(Self {
            encoder,
            palette,
            size: [columns, lines],
            shown: Vec::new(),
        })
    }

    /// Appends a picture as a frame, of which only the part that has changed is written.
    ///
    /// # Errors
    /// If the picture has another size, or the encoder fails.
    pub fn add(&mut self, picture: &Picture) -> Result<(), PictureError> {
        let [width, height] = picture.size();
        if [width, height] != self.size.map(u32::from) {
            return Err(PictureError::Size { width, height });
        }
        let rgb = picture.rgb();
        // Most pixels have the colour of the one before.
        let mut last = None;
        let mut index = |colour: Colour| match last {
            Some((same, index)) if same == colour => index,
            _ => {
                let index = self.palette.index(colour);
                last = Some((colour, index));
                index
            }
        };
        let colours = rgb.chunks_exact(3);
        let indices: Vec<u8> = colours.map(|rgb| index([rgb[0], rgb[1], rgb[2]])).collect();
        let columns = usize::from(self.size[0]);
        let region = match self.shown.is_empty() {
            true => Region::all(self.size),
            false => Region::changed(&self.shown, &indices, columns),
        };
        // Pixels that have not changed get one index, since runs of the same index take little space.
        let unchanged = self.palette.unchanged();
        let shown = self
            .shown
            .iter()
            .copied()
            .map(Some)
            .chain(iter::repeat(None));
        let written: Vec<u8> = indices
            .iter()
            .zip(shown)
            .map(|(index, shown)| {
                if shown == Some(*index) {
                    unchanged
                } else {
                    *index
                }
            })
            .collect();
        let frame = Frame {
            delay: FRAME_TIME_CS,
            left: region.left,
            top: region.top,
            width: region.width,
            height: region.height,
            transparent: Some(unchanged),
            buffer: region.cut(&written, columns).into(),
            ..Frame::default()
        };
        self.shown = indices;
        self.encoder.write_frame(&frame).map_err(gif_error)
    }

    /// The complete file.
    ///
    /// # Errors
    /// If the encoder fails.
    pub fn finish(self) -> Result<Vec<u8>, PictureError> {
        self.encoder.into_inner().map_err(gif_error)
    }
}

fn gif_error(error: impl ToString) -> PictureError {
    PictureError::Gif(error.to_string())
}

/// A rectangle of a picture, in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Region {
    left: u16,
    top: u16,
    width: u16,
    height: u16,
}

impl Region {
    const fn all([width, height]: [u16; 2]) -> Self {
        Self {
            left: 0,
            top: 0,
            width,
            height,
        }
    }

    /// The smallest region in which two frames differ; one pixel if they are equal.
    fn changed(before: &[u8], after: &[u8], columns: usize) -> Self {
        let differing = before.iter().zip(after).enumerate();
        let differing = differing.filter(|(_, (before, after))| before != after);
        let mut ends: Option<[usize; 4]> = None;
        for (index, _) in differing {
            let (x, y) = (index % columns, index / columns);
            let [left, top, right, bottom] = ends.unwrap_or([x, y, x, y]);
            ends = Some([left.min(x), top.min(y), right.max(x), bottom.max(y)]);
        }
        let [left, top, right, bottom] = ends.unwrap_or_default();
        let pixels = |count: usize| u16::try_from(count).unwrap_or(u16::MAX);
        Self {
            left: pixels(left),
            top: pixels(top),
            width: pixels(right - left + 1),
            height: pixels(bottom - top + 1),
        }
    }

    /// The part of a frame inside the region.
    fn cut(self, indices: &[u8], columns: usize) -> Vec<u8> {
        let [left, width] = [self.left, self.width].map(usize::from);
        let lines = indices.chunks(columns);
        let lines = lines.skip(self.top.into()).take(self.height.into());
        lines
            .flat_map(|line| &line[left..left + width])
            .copied()
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canvas::Drawing;
    use gif::DecodeOptions;

    const COLOURS: [Colour; 3] = [[255, 255, 255], [0, 0, 0], [200, 0, 0]];

    #[test]
    fn palette_has_colours_and_their_blends() {
        let mut palette = Palette::new(&COLOURS);
        assert_eq!(palette.colours.len(), 3 + 3 * 84);
        assert_eq!(palette.unchanged(), 255);
        for (index, colour) in (0..).zip(COLOURS) {
            assert_eq!(palette.index(colour), index);
        }
        for grey in [40, 128, 220] {
            let index = palette.index([grey; 3]);
            let found = palette.colours[usize::from(index)];
            assert!(
                found.iter().all(|channel| channel.abs_diff(grey) <= 2),
                "{found:?}"
            );
        }
        let many: Vec<Colour> = (0..=u8::MAX).map(|grey| [grey; 3]).collect();
        assert_eq!(Palette::new(&many).colours.len(), MAX_COLOURS);
    }

    #[test]
    fn animation_has_frames_with_what_has_changed() {
        let size = [40, 20];
        let mut animation = Animation::new(size, Palette::new(&COLOURS)).unwrap();
        for x in [0.0, 0.0, 10.0] {
            let mut drawing = Drawing::new(40, 20, "#ffffff");
            drawing.rectangle([x, 5.0], [10.0, 10.0], "#c80000");
            animation.add(&Picture::draw(&drawing).unwrap()).unwrap();
        }
        let other = Picture::draw(&Drawing::new(39, 20, "#ffffff")).unwrap();
        assert!(animation.add(&other).is_err(), "another size");
        let file = animation.finish().unwrap();

        let mut decoder = DecodeOptions::new().read_info(&file[..]).unwrap();
        assert_eq!((decoder.width(), decoder.height()), (40, 20));
        let (mut parts, mut indices) = (Vec::new(), Vec::new());
        while let Some(frame) = decoder.read_next_frame().unwrap() {
            assert_eq!(frame.delay, FRAME_TIME_CS);
            parts.push([frame.left, frame.top, frame.width, frame.height]);
            indices.push(frame.buffer.to_vec());
        }
        assert_eq!(parts, [[0, 0, 40, 20], [0, 0, 1, 1], [0, 5, 20, 10]]);
        assert_eq!(indices[1], [255], "unchanged");
        assert!(
            indices[2]
                .chunks(20)
                .all(|line| line == [[0; 10], [2; 10]].concat())
        );
    }

    #[test]
    fn animation_of_too_large_frames_is_refused() {
        let made = Animation::new([70_000, 10], Palette::new(&COLOURS));
        assert!(made.is_err());
    }
}
