//! What a video shows: the table from above with puck and mallets, the puck's trail, a caption and the time.

use super::super::table_parts::{
    self, DISC_COLOURS, PATH_COLOURS, TABLE_COLOURS, disc, height_px, path,
};
use faceoff_picture::{Align, Drawing, Picture, PictureError, TextStyle, Weight};
use faceoff_sim::{model::TOOL, table::geometry::PUCK};

const WIDTH_PX: u32 = 960;
/// Height of the caption above the table.
const CAPTION_PX: u32 = 64;
const MARGIN_PX: f64 = 24.0;
const BACKGROUND: &str = "#fff";
/// Samples of the puck's trail: a second.
const TRAIL_SAMPLES: usize = 50;

const CAPTION_STYLE: TextStyle = TextStyle::new(Weight::Semibold, 30.0, TABLE_COLOURS[1]);
const TIME_STYLE: TextStyle = TextStyle::new(Weight::Regular, 30.0, TABLE_COLOURS[1]);

/// Positions of the bodies after a control step: x, y, m, table frame.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    pub puck: [f64; 2],
    /// `None`: there is no such robot.
    pub mallets: [Option<[f64; 2]>; 2],
}

/// A recording as a video shows it.
#[derive(Debug)]
pub struct Scene {
    /// After 0, 1, 2 … control steps; never empty.
    pub samples: Vec<Sample>,
    /// The samples at which a rally begins, and with it the trail of the puck.
    pub rally_starts: Vec<usize>,
    /// Captions, each with the first sample that has it, in order.
    pub captions: Vec<(usize, String)>,
    /// The time after a number of control steps, as text.
    pub clock: fn(usize) -> String,
    /// SVG elements on the table, below the bodies.
    pub underlay: String,
}

/// The colours of a video.
pub fn colours() -> Vec<[u8; 3]> {
    let all = [BACKGROUND].into_iter().chain(TABLE_COLOURS);
    let all = all.chain(PATH_COLOURS).chain(DISC_COLOURS);
    all.map(rgb).collect()
}

/// A colour such as `#fbfbf8` or `#c33`.
fn rgb(colour: &str) -> [u8; 3] {
    let digits: Vec<u8> = colour
        .chars()
        .filter_map(|digit| u8::try_from(digit.to_digit(16)?).ok())
        .collect();
    let width = digits.len() / 3;
    std::array::from_fn(|channel| match &digits[width * channel..][..width] {
        [high, low] => 16 * high + low,
        [digit] => 17 * digit,
        _ => 0,
    })
}

impl Scene {
    /// The first and the last sample.
    pub fn whole(&self) -> [usize; 2] {
        [0, self.samples.len().saturating_sub(1)]
    }

    /// The picture that all frames have in common: the table without bodies and texts.
    pub fn backdrop(&self) -> Result<Picture, PictureError> {
        // Encoders of videos take even heights only.
        let height = (f64::from(CAPTION_PX) + height_px(WIDTH_PX)) as u32;
        let mut drawing = Drawing::new(WIDTH_PX, height.next_multiple_of(2), BACKGROUND);
        drawing.elements(&table_parts::begin(WIDTH_PX, &table_position()));
        drawing.elements(&self.underlay);
        drawing.elements(table_parts::END);
        Picture::draw(&drawing)
    }

    /// The frame after a number of control steps.
    pub fn frame(&self, backdrop: &Picture, sample: usize) -> Result<Picture, PictureError> {
        let mut frame = backdrop.clone();
        let [width, height] = frame.size();
        let mut drawing = Drawing::transparent(width, height);
        // Vertical position of the text's base line.
        let baseline = f64::from(CAPTION_PX) - 22.0;
        let time = (self.clock)(sample);
        let right = f64::from(WIDTH_PX) - MARGIN_PX;
        drawing.text(&time, &TIME_STYLE, [right, baseline], Align::Right);
        let caption_width = right - MARGIN_PX - TIME_STYLE.width_px("00:00.00 s");
        let caption = CAPTION_STYLE.truncated(self.caption(sample), caption_width);
        drawing.text(&caption, &CAPTION_STYLE, [MARGIN_PX, baseline], Align::Left);
        drawing.elements(&self.bodies(sample));
        frame.draw_over(&drawing)?;
        Ok(frame)
    }

    fn caption(&self, sample: usize) -> &str {
        let current = self.captions.iter().rfind(|(from, _)| *from <= sample);
        current.map_or("", |(_, text)| text)
    }

    fn bodies(&self, sample: usize) -> String {
        let Some(bodies) = self.samples.get(sample) else {
            return String::new();
        };
        let start = self.rally_starts.iter().rfind(|start| **start <= sample);
        let start = sample
            .saturating_sub(TRAIL_SAMPLES)
            .max(start.copied().unwrap_or_default());
        let trail: Vec<[f64; 2]> = self.samples[start..=sample]
            .iter()
            .map(|sample| sample.puck)
            .collect();
        let mut out = table_parts::begin_without_table(WIDTH_PX, &table_position());
        let [.., puck_path] = PATH_COLOURS;
        out += &path(
            &trail,
            puck_path,
            "stroke-linejoin=\"round\" stroke-width=\"0.006\"",
        );
        for (mallet, colour) in bodies.mallets.iter().zip(DISC_COLOURS) {
            if let Some([x, y]) = mallet {
                out += &disc("mallet", *x, *y, TOOL.cylinder_radius_m, colour);
            }
        }
        let ([x, y], [.., puck_disc]) = (bodies.puck, DISC_COLOURS);
        out += &disc("puck", x, y, PUCK.radius_m, puck_disc);
        out + table_parts::END
    }
}

/// The SVG attribute that puts the table below the caption.
fn table_position() -> String {
    format!("y=\"{CAPTION_PX}\"")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_and_long_colours_are_read() {
        assert_eq!(rgb("#fbfbf8"), [0xfb, 0xfb, 0xf8]);
        assert_eq!(rgb("#c33"), [0xcc, 0x33, 0x33]);
        assert_eq!(colours().len(), 12);
    }

    #[test]
    fn caption_changes_at_its_sample() {
        let scene = Scene {
            samples: Vec::new(),
            rally_starts: Vec::new(),
            captions: vec![(0, "0 : 0".to_owned()), (7, "1 : 0".to_owned())],
            clock: |_| String::new(),
            underlay: String::new(),
        };
        assert_eq!(
            [0, 6, 7, 9].map(|sample| scene.caption(sample)),
            ["0 : 0", "0 : 0", "1 : 0", "1 : 0"]
        );
    }
}
