//! Files of films: GIF, numbered pictures, and what ffmpeg makes of pixels.

use super::scene;
use crate::commands::atomic_folder::check_empty;
use anyhow::{Context, bail};
use faceoff_picture::{Animation, FRAME_TIME_CS, Palette, Picture};
use std::{
    ffi::OsString,
    fs,
    io::{ErrorKind, Read, Write},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
};

/// A film that is being written.
pub enum Film {
    Gif {
        file: PathBuf,
        animation: Animation<Vec<u8>>,
    },
    Png {
        folder: PathBuf,
        count: usize,
    },
    Mpeg4(Ffmpeg),
}

/// A process of ffmpeg, which reads pixels.
pub struct Ffmpeg(Child);

impl Drop for Ffmpeg {
    fn drop(&mut self) {
        // Unless it has ended, the film was given up.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Film {
    pub fn gif(file: &Path, size: [u32; 2]) -> anyhow::Result<Self> {
        let palette = Palette::new(&scene::colours());
        Ok(Self::Gif {
            file: file.to_owned(),
            animation: Animation::new(Vec::new(), size, palette)?,
        })
    }

    /// Numbered pictures. The folder is new or empty: pictures of a longer film before it would look like its continuation.
    pub fn png(folder: &Path) -> anyhow::Result<Self> {
        check_empty(
            folder,
            "the pictures of a film are written to a new or an empty folder",
        )?;
        fs::create_dir_all(folder).with_context(|| format!("creating {}", folder.display()))?;
        Ok(Self::Png {
            folder: folder.to_owned(),
            count: 0,
        })
    }

    pub fn mpeg4(file: &Path, [width, height]: [u32; 2]) -> anyhow::Result<Self> {
        // Without the prefix, a name with a colon would be an address.
        let mut target = OsString::from("file:");
        target.push(file);
        let rate = 100 / FRAME_TIME_CS;
        let mut command = Command::new("ffmpeg");
        command
            .args(["-hide_banner", "-loglevel", "error", "-y", "-f", "rawvideo"])
            .args(["-pixel_format", "rgb24", "-video_size"])
            .arg(format!("{width}x{height}"))
            .args(["-framerate", &rate.to_string(), "-i", "-", "-an"])
            .args(["-pix_fmt", "yuv420p", "-movflags", "+faststart"])
            .arg(target)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        match command.spawn() {
            Ok(child) => Ok(Self::Mpeg4(Ffmpeg(child))),
            Err(error) if error.kind() == ErrorKind::NotFound => bail!(
                "an .mp4 is made by ffmpeg, which is not installed: install it (Debian and Ubuntu: apt install ffmpeg; Fedora: dnf \
                 install ffmpeg-free), or write an animated GIF, which needs nothing else: --video {}",
                file.with_extension("gif").display()
            ),
            Err(error) => Err(error).context("starting ffmpeg, which makes an .mp4"),
        }
    }

    pub fn add(&mut self, picture: &Picture) -> anyhow::Result<()> {
        match self {
            Self::Gif { animation, .. } => animation.add(picture)?,
            Self::Png { folder, count } => {
                *count += 1;
                let file = folder.join(format!("frame-{count:05}.png"));
                fs::write(&file, picture.png()?)
                    .with_context(|| format!("writing {}", file.display()))?;
            }
            Self::Mpeg4(ffmpeg) => {
                let input = ffmpeg.0.stdin.as_mut();
                let written = input.map(|input| input.write_all(&picture.rgb()));
                if written.is_none_or(|written| written.is_err()) {
                    // Its message says more than the broken pipe.
                    ffmpeg.end()?;
                    bail!("ffmpeg ended before the film did");
                }
            }
        }
        Ok(())
    }

    /// Completes the file.
    pub fn finish(self) -> anyhow::Result<()> {
        match self {
            Self::Gif { file, animation } => Ok(fs::write(file, animation.finish()?)?),
            Self::Png { .. } => Ok(()),
            Self::Mpeg4(mut ffmpeg) => ffmpeg.end(),
        }
    }
}

impl Ffmpeg {
    /// Ends its input and waits for it.
    fn end(&mut self) -> anyhow::Result<()> {
        drop(self.0.stdin.take());
        let mut message = String::new();
        if let Some(mut errors) = self.0.stderr.take() {
            // Without a message there is the status.
            let _ = errors.read_to_string(&mut message);
        }
        let status = self.0.wait().context("waiting for ffmpeg")?;
        if !status.success() {
            bail!("ffmpeg ended with {status}: {}", message.trim());
        }
        Ok(())
    }
}
