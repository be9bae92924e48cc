//! Sending a season archive. A separate thread writes it, a few chunks ahead of the client that downloads it.

use super::PreparedArchive;
use axum::body::{Body, Bytes};
use faceoff_archive::{ArchiveError, Writer};
use std::{
    fs::File,
    io::{self, BufReader, Write},
};
use tokio::sync::{OwnedSemaphorePermit, mpsc};

/// Length of a chunk of the response.
const CHUNK_BYTES: usize = 256 << 10;
/// Chunks that may wait for the client; the thread waits while there are so many.
const MAX_BUFFERED_CHUNKS: usize = 4;

/// The archive as the body of a response. If a file has changed since the archive was prepared, the body breaks off, so that
/// the client cannot mistake it for a complete archive. Writing stops when the client disconnects.
pub(crate) fn send(prepared: PreparedArchive, permit: OwnedSemaphorePermit) -> Body {
    let (chunks, received) = mpsc::channel(MAX_BUFFERED_CHUNKS);
    tokio::task::spawn_blocking(move || {
        // Variables are dropped in reverse order: the permit for the next archive comes back after the files of this one are removed.
        let (_permit, prepared) = (permit, prepared);
        let mut sink = ChunkWriter {
            chunks: chunks.clone(),
            buffer: Vec::with_capacity(CHUNK_BYTES),
        };
        match write(&prepared, &mut sink) {
            Ok(()) => {
                tracing::info!(edition = %prepared.manifest.edition, "season archive sent")
            }
            Err(ArchiveError::Io(error)) if error.kind() == io::ErrorKind::BrokenPipe => {
                tracing::info!("the client of a season archive disconnected");
            }
            Err(error) => {
                tracing::error!(%error, "sending a season archive failed");
                // If this fails, the client has disconnected.
                let _ = chunks.blocking_send(Err(io::Error::other("the archive is incomplete")));
            }
        }
    });
    Body::from_stream(futures::stream::unfold(received, |mut received| async {
        received.recv().await.map(|chunk| (chunk, received))
    }))
}

fn write(prepared: &PreparedArchive, sink: &mut ChunkWriter) -> Result<(), ArchiveError> {
    let mut writer = Writer::begin(&mut *sink, &prepared.manifest)?;
    for path in &prepared.local_paths {
        writer.next(|_| Ok(BufReader::with_capacity(CHUNK_BYTES, File::open(path)?)))?;
    }
    writer.finish()?;
    sink.flush()?;
    Ok(())
}

/// Collects written bytes into chunks and sends them to the client.
struct ChunkWriter {
    chunks: mpsc::Sender<io::Result<Bytes>>,
    buffer: Vec<u8>,
}

impl Write for ChunkWriter {
    fn write(&mut self, written: &[u8]) -> io::Result<usize> {
        let space = CHUNK_BYTES - self.buffer.len();
        let accepted = written.len().min(space);
        self.buffer.extend_from_slice(&written[..accepted]);
        if self.buffer.len() == CHUNK_BYTES {
            self.flush()?;
        }
        Ok(accepted)
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.buffer.is_empty() {
            return Ok(());
        }
        let empty = Vec::with_capacity(CHUNK_BYTES);
        let chunk = Bytes::from(std::mem::replace(&mut self.buffer, empty));
        self.chunks
            .blocking_send(Ok(chunk))
            .map_err(|_| io::ErrorKind::BrokenPipe.into())
    }
}
