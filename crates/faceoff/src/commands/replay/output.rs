//! The file that `faceoff replay` writes.

use super::video::{Video, VideoOptions};
use crate::commands::atomic_file::AtomicFile;
use anyhow::bail;
use std::path::{Path, PathBuf};

/// What is drawn into the file.
#[derive(Debug, Clone, PartialEq)]
pub enum Format {
    Html,
    Svg,
    Video(Video),
}

impl Format {
    /// The format of the file of `--out`.
    fn of(path: &Path) -> anyhow::Result<Self> {
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("html" | "htm") => Ok(Self::Html),
            Some("svg") => Ok(Self::Svg),
            _ => bail!(
                "--out: expected a file that ends in .html or .svg, got {}; videos are written by --video",
                path.display()
            ),
        }
    }
}

/// The file to write, and what is printed about it.
#[derive(Debug)]
pub struct Output {
    pub file: PathBuf,
    pub format: Format,
    /// Print the summary of the recording as JSON instead of text.
    pub json: bool,
}

impl Output {
    /// The output of `--out`, or else of `--video`.
    pub fn new(out: Option<PathBuf>, video: &VideoOptions, json: bool) -> anyhow::Result<Self> {
        if let Some((file, video)) = video.video()? {
            return Ok(Self {
                file,
                format: Format::Video(video),
                json,
            });
        }
        let Some(file) = out else {
            bail!("name the file to write: --out FILE (.html, .svg) or --video FILE (.gif, .mp4)");
        };
        Ok(Self {
            format: Format::of(&file)?,
            file,
            json,
        })
    }

    pub fn write(&self, text: String) -> anyhow::Result<()> {
        AtomicFile::create(&self.file)?.write(text)
    }
}
