//! A process of ffmpeg, which makes an MPEG-4 of pixels.

use anyhow::{Context, bail};
use faceoff_picture::FRAME_TIME_CS;
use rustix::{
    event::{PollFd, PollFlags, Timespec, poll},
    io::{Errno, ioctl_fionbio},
};
use std::{
    ffi::OsString,
    io::{self, ErrorKind, Read, Write},
    path::Path,
    process::{Child, ChildStderr, Command, Stdio},
    sync::mpsc::{self, Receiver},
    thread,
    time::{Duration, Instant},
};

/// Longest time in which ffmpeg reads nothing, and in which it completes the file. It encodes many frames per second: the rest is
/// for slow disks and busy machines.
const TIMEOUT: Duration = Duration::from_secs(120);
/// Longest wait for ffmpeg's error output after ffmpeg has ended: a child process of ffmpeg may still hold the pipe open.
const MESSAGE_TIMEOUT: Duration = Duration::from_secs(10);
/// The error output of ffmpeg is read to its end, and this much of the end is stored.
const MAX_MESSAGE_BYTES: usize = 4096;
/// Time between two looks at whether it has ended.
const POLL_INTERVAL: Duration = Duration::from_millis(10);

/// A process of ffmpeg. Unless it has ended, it is killed.
pub struct Ffmpeg {
    process: Child,
    /// Receives the last line of ffmpeg's error output.
    message: Receiver<String>,
    timeout: Duration,
}

impl Ffmpeg {
    /// Starts a video of this size; `None` if ffmpeg is not installed. An existing file is overwritten.
    pub fn start(file: &Path, [width, height]: [u32; 2]) -> anyhow::Result<Option<Self>> {
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
            // The name of the temporary file does not tell ffmpeg the format.
            .args(["-f", "mp4"])
            .arg(target);
        match Self::spawn(&mut command, TIMEOUT) {
            Ok(ffmpeg) => Ok(Some(ffmpeg)),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error).context("starting ffmpeg, which makes an .mp4"),
        }
    }

    fn spawn(command: &mut Command, timeout: Duration) -> io::Result<Self> {
        command
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        let mut process = command.spawn()?;
        let errors = process.stderr.take();
        let ffmpeg = Self {
            process,
            message: last_line(errors),
            timeout,
        };
        if let Some(input) = &ffmpeg.process.stdin {
            // A write to a pipe that is not read would have no deadline.
            ioctl_fionbio(input, true)?;
        }
        Ok(ffmpeg)
    }

    /// Writes the pixels of a frame.
    pub fn write(&mut self, mut pixels: &[u8]) -> anyhow::Result<()> {
        while !pixels.is_empty() {
            let Some(input) = &mut self.process.stdin else {
                bail!("ffmpeg ended before the video did");
            };
            match input.write(pixels) {
                Ok(count) => pixels = &pixels[count..],
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    self.wait_until_writable()?
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(_) => {
                    // Its message says more than the broken pipe.
                    self.end()?;
                    bail!("ffmpeg ended before the video did");
                }
            }
        }
        Ok(())
    }

    /// Waits until ffmpeg accepts further pixels, or has ended.
    fn wait_until_writable(&self) -> anyhow::Result<()> {
        let Some(input) = &self.process.stdin else {
            return Ok(());
        };
        let timeout = Timespec::try_from(self.timeout)?;
        let mut inputs = [PollFd::new(input, PollFlags::OUT)];
        match poll(&mut inputs, Some(&timeout)) {
            Ok(0) => bail!(
                "ffmpeg has read no pixels for {} s and was ended",
                self.timeout.as_secs()
            ),
            Ok(_) | Err(Errno::INTR) => Ok(()),
            Err(error) => Err(error).context("waiting for ffmpeg"),
        }
    }

    /// Ends its input, and waits until it has completed the file.
    pub fn end(&mut self) -> anyhow::Result<()> {
        drop(self.process.stdin.take());
        let give_up_at = Instant::now() + self.timeout;
        let status = loop {
            if let Some(status) = self.process.try_wait().context("waiting for ffmpeg")? {
                break status;
            }
            if Instant::now() >= give_up_at {
                bail!(
                    "ffmpeg did not complete the video within {} s after the last frame and was ended",
                    self.timeout.as_secs()
                );
            }
            thread::sleep(POLL_INTERVAL);
        };
        if !status.success() {
            // Without a message there is the status.
            let message = self.message.recv_timeout(MESSAGE_TIMEOUT);
            bail!(
                "ffmpeg ended with {status}: {}",
                message.unwrap_or_default()
            );
        }
        Ok(())
    }
}

impl Drop for Ffmpeg {
    fn drop(&mut self) {
        // Unless it has ended, the video was given up.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Reads errors to their end, so that their writer never waits, and sends the last line.
fn last_line(errors: Option<ChildStderr>) -> Receiver<String> {
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || {
        let Some(mut errors) = errors else {
            return;
        };
        let mut tail: Vec<u8> = Vec::new();
        let mut chunk = [0_u8; 1024];
        while let Ok(count @ 1..) = errors.read(&mut chunk) {
            tail.extend_from_slice(&chunk[..count]);
            let excess = tail.len().saturating_sub(MAX_MESSAGE_BYTES);
            tail.drain(..excess);
        }
        let text = String::from_utf8_lossy(&tail);
        let line = text.trim_end().lines().next_back().unwrap_or_default();
        // Fails if ffmpeg has succeeded, because then no one receives the message.
        let _ = sender.send(line.to_owned());
    });
    receiver
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hanging_process_is_ended_at_its_deadline() {
        let start = || {
            let mut command = Command::new("sleep");
            Ffmpeg::spawn(command.arg("600"), Duration::from_millis(20)).unwrap()
        };
        // More than a pipe holds.
        let error = start().write(&vec![0; 1 << 22]).unwrap_err();
        let error = error.to_string();
        assert!(error.starts_with("ffmpeg has read no pixels"), "{error}");
        let error = start().end().unwrap_err().to_string();
        assert!(error.starts_with("ffmpeg did not complete"), "{error}");
    }

    #[test]
    fn last_line_of_long_errors_is_shown() {
        let mut command = Command::new("sh");
        // More than a pipe holds.
        let script = "head -c 200000 /dev/zero >&2; printf '\\nno such codec\\n' >&2; exit 3";
        let mut process = Ffmpeg::spawn(command.args(["-c", script]), TIMEOUT).unwrap();
        let error = process.end().unwrap_err().to_string();
        assert_eq!(error, "ffmpeg ended with exit status: 3: no such codec");
    }
}
