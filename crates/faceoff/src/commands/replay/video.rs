//! Videos of a recording: 25 frames per second of the table from above.

mod encoder;
mod ffmpeg;
mod scene;

use anyhow::{Context, bail};
use clap::Args;
use encoder::Encoder;
use faceoff_picture::FRAME_TIME_CS;
use faceoff_types::CONTROL_STEP_S;
use indicatif::ProgressBar;
pub use scene::{Sample, Scene};
use std::path::{Path, PathBuf};

/// Seconds between two frames.
const FRAME_TIME_S: f64 = FRAME_TIME_CS as f64 / 100.0;
/// Number of times that the last frame is written, so that the end stays for a second.
const FINAL_FRAMES: usize = 25;
/// Largest number of frames of each format, without the copies of the last frame. A GIF of one minute has some megabytes, and
/// most programs show longer GIFs badly. The limit of MPEG-4 suffices for a game of 15 minutes.
const MAX_GIF_FRAMES: usize = 1_500;
const MAX_PNG_FRAMES: usize = 5_000;
const MAX_MPEG4_FRAMES: usize = 30_000;

#[derive(Debug, Args)]
pub struct VideoOptions {
    /// The video to write instead, 25 frames per second: an animated GIF (.gif), MPEG-4 (.mp4, for which ffmpeg must be
    /// installed), or a folder for numbered frames in PNG (its name ends with /, or it exists and is empty). An existing file
    /// is replaced
    #[arg(long, value_name = "FILE")]
    video: Option<PathBuf>,
    /// Of a video: its first moment, in seconds since the start of the recording [default: the start]
    #[arg(long, value_name = "SECONDS", requires = "video", value_parser = parse_seconds, conflicts_with_all = ["rally", "out"])]
    from: Option<f64>,
    /// Of a video: its last moment [default: the end]
    #[arg(long, value_name = "SECONDS", requires = "video", value_parser = parse_seconds, conflicts_with_all = ["rally", "out"])]
    to: Option<f64>,
    /// Of a video: how many seconds of the recording pass in a second, 0.1 to 100 [default: 1]
    #[arg(long, value_name = "FACTOR", requires = "video", conflicts_with = "out", value_parser = parse_speed)]
    speed: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum VideoFormat {
    Gif,
    Mpeg4,
    Png,
}

/// A video to write.
#[derive(Debug, Clone, PartialEq)]
pub struct Video {
    format: VideoFormat,
    from_s: Option<f64>,
    to_s: Option<f64>,
    speed: f64,
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    let seconds = text
        .parse()
        .ok()
        .filter(|s: &f64| s.is_finite() && *s >= 0.0);
    seconds.ok_or_else(|| "expected a number of seconds, such as 12.5".to_owned())
}

fn parse_speed(text: &str) -> Result<f64, String> {
    let factor = text
        .parse()
        .ok()
        .filter(|factor: &f64| (0.1..=100.0).contains(factor));
    factor
        .ok_or_else(|| "expected a number from 0.1 to 100, such as 2 for twice as fast".to_owned())
}

impl VideoFormat {
    fn of(path: &Path) -> anyhow::Result<Self> {
        let is_folder = path.is_dir() || path.as_os_str().as_encoded_bytes().ends_with(b"/");
        match path.extension().and_then(|extension| extension.to_str()) {
            _ if is_folder => Ok(Self::Png),
            Some("gif") => Ok(Self::Gif),
            Some("mp4") => Ok(Self::Mpeg4),
            _ => bail!(
                "--video: expected a file that ends in .gif or .mp4, or a folder for frames that ends with /, got {}",
                path.display()
            ),
        }
    }

    const fn max_frames(self) -> usize {
        match self {
            Self::Gif => MAX_GIF_FRAMES,
            Self::Mpeg4 => MAX_MPEG4_FRAMES,
            Self::Png => MAX_PNG_FRAMES,
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Gif => "a GIF",
            Self::Mpeg4 => "an MPEG-4",
            Self::Png => "a folder of frames",
        }
    }
}

impl VideoOptions {
    /// The video to write and its file; `None` without the option.
    pub fn video(&self) -> anyhow::Result<Option<(PathBuf, Video)>> {
        let Some(file) = &self.video else {
            return Ok(None);
        };
        let video = Video {
            format: VideoFormat::of(file)?,
            from_s: self.from,
            to_s: self.to,
            speed: self.speed.unwrap_or(1.0),
        };
        Ok(Some((file.clone(), video)))
    }
}

impl Video {
    /// Writes the video of a scene. `default_span` is the first and the last sample without `--from` and `--to`.
    pub fn write(
        &self,
        scene: &Scene,
        default_span: [usize; 2],
        file: &Path,
    ) -> anyhow::Result<()> {
        let frames = self.frames(scene, default_span)?;
        let backdrop = scene.backdrop()?;
        let mut encoder = match self.format {
            VideoFormat::Gif => Encoder::gif(file, backdrop.size())?,
            VideoFormat::Mpeg4 => Encoder::mpeg4(file, backdrop.size())?,
            VideoFormat::Png => Encoder::png(file)?,
        };
        let bar = ProgressBar::new(frames.len() as u64);
        for (index, sample) in frames.iter().enumerate() {
            let frame = scene.frame(&backdrop, *sample)?;
            let is_last = index + 1 == frames.len();
            let copies = match is_last && self.format != VideoFormat::Png {
                true => FINAL_FRAMES,
                false => 1,
            };
            for _ in 0..copies {
                encoder.add(&frame)?;
            }
            bar.inc(1);
        }
        bar.finish_and_clear();
        encoder
            .finish()
            .with_context(|| format!("writing {}", file.display()))
    }

    /// The sample of each frame.
    fn frames(&self, scene: &Scene, default_span: [usize; 2]) -> anyhow::Result<Vec<usize>> {
        let [_, end] = scene.whole();
        let sample = |seconds: f64| (seconds / CONTROL_STEP_S).round() as usize;
        let from = self.from_s.map_or(default_span[0], sample);
        let to = self.to_s.map_or(default_span[1], sample).min(end);
        let seconds = |sample: usize| sample as f64 * CONTROL_STEP_S;
        if from > end {
            bail!(
                "--from: the recording ends after {:.2} s, got {:.2} s",
                seconds(end),
                seconds(from)
            );
        }
        if from > to {
            bail!(
                "--to: expected a time after --from ({:.2} s), got {:.2} s",
                seconds(from),
                seconds(to)
            );
        }
        let samples_per_frame = self.speed * FRAME_TIME_S / CONTROL_STEP_S;
        // Without the tolerance, a rounding error could add a frame.
        let steps = ((to - from) as f64 / samples_per_frame - 1e-9).ceil() as usize;
        let max_frames = self.format.max_frames();
        if steps >= max_frames {
            bail!(
                "{:.0} s are {} frames, and {} has at most {max_frames}: choose a part with --from SECONDS and --to SECONDS (of a \
                 game also with --rally N), or a higher --speed{}",
                seconds(to - from),
                steps + 1,
                self.format.name(),
                match self.format {
                    VideoFormat::Mpeg4 => "",
                    VideoFormat::Gif | VideoFormat::Png => "; an .mp4 may be longer",
                }
            );
        }
        let frames = (0..=steps).map(|frame| {
            let passed = (frame as f64 * samples_per_frame).round() as usize;
            (from + passed).min(to)
        });
        Ok(frames.collect())
    }
}
