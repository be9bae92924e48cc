//! Encoders of videos: an animated GIF, numbered frames, and ffmpeg.

use super::{ffmpeg::Ffmpeg, scene};
use crate::commands::{atomic_file::AtomicFile, atomic_folder::check_empty};
use anyhow::{Context, bail};
use faceoff_picture::{Animation, Palette, Picture};
use std::{
    fs,
    path::{Path, PathBuf},
};

/// A video that is being written.
pub enum Encoder {
    Gif {
        animation: Animation,
        file: AtomicFile,
    },
    Png {
        folder: PathBuf,
        count: usize,
    },
    Mpeg4 {
        ffmpeg: Ffmpeg,
        file: AtomicFile,
    },
}

impl Encoder {
    pub fn gif(file: &Path, size: [u32; 2]) -> anyhow::Result<Self> {
        let palette = Palette::new(&scene::colours());
        Ok(Self::Gif {
            animation: Animation::new(size, palette)?,
            file: AtomicFile::create(file)?,
        })
    }

    /// Numbered frames. The folder is new or empty: frames of a longer video before it would look like its continuation.
    pub fn png(folder: &Path) -> anyhow::Result<Self> {
        check_empty(
            folder,
            "the frames of a video are written to a new or an empty folder",
        )?;
        fs::create_dir_all(folder).with_context(|| format!("creating {}", folder.display()))?;
        Ok(Self::Png {
            folder: folder.to_owned(),
            count: 0,
        })
    }

    pub fn mpeg4(file: &Path, size: [u32; 2]) -> anyhow::Result<Self> {
        let partial = AtomicFile::create(file)?;
        let Some(ffmpeg) = Ffmpeg::start(partial.path(), size)? else {
            bail!(
                "an .mp4 is made by ffmpeg, which is not installed: install it (Debian and Ubuntu: apt install ffmpeg; Fedora: dnf \
                 install ffmpeg-free), or write an animated GIF, which needs nothing else: --video {}",
                file.with_extension("gif").display()
            );
        };
        Ok(Self::Mpeg4 {
            ffmpeg,
            file: partial,
        })
    }

    pub fn add(&mut self, frame: &Picture) -> anyhow::Result<()> {
        match self {
            Self::Gif { animation, .. } => Ok(animation.add(frame)?),
            Self::Png { folder, count } => {
                *count += 1;
                let file = folder.join(format!("frame-{count:05}.png"));
                fs::write(&file, frame.png()?)
                    .with_context(|| format!("writing {}", file.display()))
            }
            Self::Mpeg4 { ffmpeg, .. } => ffmpeg.write(&frame.rgb()),
        }
    }

    /// Completes the video, which replaces an existing file now.
    pub fn finish(self) -> anyhow::Result<()> {
        match self {
            Self::Gif { animation, file } => file.write(animation.finish()?),
            Self::Png { .. } => Ok(()),
            Self::Mpeg4 { mut ffmpeg, file } => {
                ffmpeg.end()?;
                file.commit()
            }
        }
    }
}
