//! An archive on its way: written by a thread of its own, a few pieces ahead of the reader.

use super::Prepared;
use axum::body::{Body, Bytes};
use faceoff_archive::{ArchiveError, Writer};
use std::{
    fs::File,
    io::{self, BufReader, Write},
};
use tokio::sync::{OwnedSemaphorePermit, mpsc};

/// Length of a piece, in bytes …
const PIECE_BYTES: usize = 256 << 10;
/// … and how many of them wait for the reader.
const AHEAD: usize = 4;

/// The archive as the body of an answer. It breaks off, so that nobody takes it for whole, if a file is not what it was;
/// it ends with the reader.
pub(crate) fn send(prepared: Prepared, permit: OwnedSemaphorePermit) -> Body {
    let (pieces, received) = mpsc::channel(AHEAD);
    tokio::task::spawn_blocking(move || {
        // the next one may begin once the files of this one are gone
        let (_permit, prepared) = (permit, prepared);
        let mut sink = Pieces {
            pieces: pieces.clone(),
            buffer: Vec::with_capacity(PIECE_BYTES),
        };
        match write(&prepared, &mut sink) {
            Ok(()) => {
                tracing::info!(edition = %prepared.manifest.edition, "an archive of the season was sent")
            }
            Err(ArchiveError::Io(error)) if error.kind() == io::ErrorKind::BrokenPipe => {
                tracing::info!("who asked for an archive of the season went away");
            }
            Err(error) => {
                tracing::error!(%error, "an archive of the season breaks off");
                // Nobody waits for it any more if that fails.
                let _ = pieces.blocking_send(Err(io::Error::other("the archive breaks off")));
            }
        }
    });
    Body::from_stream(futures::stream::unfold(received, |mut received| async {
        received.recv().await.map(|piece| (piece, received))
    }))
}

fn write(prepared: &Prepared, sink: &mut Pieces) -> Result<(), ArchiveError> {
    let mut writer = Writer::begin(&mut *sink, &prepared.manifest)?;
    for place in &prepared.places {
        writer.next(|_| Ok(BufReader::with_capacity(PIECE_BYTES, File::open(place)?)))?;
    }
    writer.finish()?;
    sink.flush()?;
    Ok(())
}

/// Hands on what is written.
struct Pieces {
    pieces: mpsc::Sender<io::Result<Bytes>>,
    buffer: Vec<u8>,
}

impl Write for Pieces {
    fn write(&mut self, written: &[u8]) -> io::Result<usize> {
        let room = PIECE_BYTES - self.buffer.len();
        let taken = written.len().min(room);
        self.buffer.extend_from_slice(&written[..taken]);
        if self.buffer.len() == PIECE_BYTES {
            self.flush()?;
        }
        Ok(taken)
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.buffer.is_empty() {
            return Ok(());
        }
        let fresh = Vec::with_capacity(PIECE_BYTES);
        let piece = Bytes::from(std::mem::replace(&mut self.buffer, fresh));
        self.pieces
            .blocking_send(Ok(piece))
            .map_err(|_| io::ErrorKind::BrokenPipe.into())
    }
}
