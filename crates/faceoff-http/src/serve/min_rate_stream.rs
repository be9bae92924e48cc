//! A connection that is closed when its client reads too slowly.

use faceoff_service::transfer_rate::{MinTransferRate, TransferRateGuard};
use std::{
    io::{self, IoSlice},
    pin::Pin,
    task::{Context, Poll, ready},
};
use tokio::{
    io::{AsyncRead, AsyncWrite, ReadBuf},
    time::{Instant, Sleep},
};

/// A stream whose writes fail once its client lags behind the minimum rate by more than the *grace*, a time. Only the time in
/// which data is ready for the client counts, not the time in which the client waits for a response.
#[derive(Debug)]
pub(super) struct MinRateStream<S> {
    stream: S,
    rate_guard: TransferRateGuard,
    pending: Option<PendingWrite>,
    /// Called before a write to a slow client fails: makes closing reset the connection.
    reset_on_close: fn(&S),
}

/// A write that waits for the client to read.
#[derive(Debug)]
struct PendingWrite {
    since: Instant,
    deadline: Pin<Box<Sleep>>,
}

impl<S> MinRateStream<S> {
    pub(super) const fn new(stream: S, rate: MinTransferRate, reset_on_close: fn(&S)) -> Self {
        Self {
            stream,
            rate_guard: TransferRateGuard::new(rate),
            pending: None,
            reset_on_close,
        }
    }

    /// Counts the bytes and the waiting time of a write, and fails when the client has used up its grace.
    fn record_write(
        &mut self,
        context: &mut Context<'_>,
        written: Poll<io::Result<usize>>,
    ) -> Poll<io::Result<usize>> {
        if let Poll::Ready(written) = written {
            if let Some(pending) = self.pending.take() {
                self.rate_guard.record_wait(pending.since.elapsed());
            }
            let bytes = written?;
            self.rate_guard.record_bytes(bytes);
            return Poll::Ready(Ok(bytes));
        }
        let remaining = self.rate_guard.remaining();
        let pending = self.pending.get_or_insert_with(|| PendingWrite {
            since: Instant::now(),
            deadline: Box::pin(tokio::time::sleep(remaining)),
        });
        ready!(pending.deadline.as_mut().poll(context));
        (self.reset_on_close)(&self.stream);
        Poll::Ready(Err(io::Error::new(
            io::ErrorKind::TimedOut,
            "the client reads the response too slowly",
        )))
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for MinRateStream<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for MinRateStream<S> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write(context, bytes);
        self.record_write(context, written)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        pieces: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write_vectored(context, pieces);
        self.record_write(context, written)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;
    use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream, duplex};

    const MIN_RATE: MinTransferRate = MinTransferRate {
        bytes_per_s: 1000,
        grace: Duration::from_secs(30),
    };

    /// Bytes between the stream and its client that are written and not yet read.
    const BUFFER_BYTES: usize = 100;

    /// A stream with [`MIN_RATE`], and its client's end.
    fn stream_with_client() -> (MinRateStream<DuplexStream>, DuplexStream) {
        let (server, client) = duplex(BUFFER_BYTES);
        (MinRateStream::new(server, MIN_RATE, |_| {}), client)
    }

    #[tokio::test(start_paused = true)]
    async fn client_that_reads_nothing_is_dropped_after_its_grace() {
        let (mut stream, _client) = stream_with_client();
        let started = Instant::now();
        let error = stream.write_all(&[7; 1000]).await.unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::TimedOut);
        assert_eq!(started.elapsed().as_secs(), 30);
    }

    #[tokio::test(start_paused = true)]
    async fn client_that_keeps_the_rate_is_never_dropped() {
        let (mut stream, mut client) = stream_with_client();
        let reader = tokio::spawn(async move {
            let mut buffer = [0; BUFFER_BYTES];
            for _ in 0..1000 {
                // 100 bytes in 90 ms are more than 1000 bytes per second.
                tokio::time::sleep(Duration::from_millis(90)).await;
                client.read_exact(&mut buffer).await.unwrap();
            }
            client
        });
        stream.write_all(&[7; 100_000]).await.unwrap();
        let _client = reader.await.unwrap();
        // Time without a pending write does not count.
        tokio::time::sleep(Duration::from_secs(1000)).await;
        stream.write_all(&[7; 100]).await.unwrap();
    }

    #[tokio::test(start_paused = true)]
    async fn client_below_the_rate_is_dropped() {
        let (mut stream, mut client) = stream_with_client();
        tokio::spawn(async move {
            // One byte per second.
            while client.read_u8().await.is_ok() {
                tokio::time::sleep(Duration::from_secs(1)).await;
            }
        });
        let started = Instant::now();
        let error = stream.write_all(&[7; 1000]).await.unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::TimedOut);
        assert!((30..=32).contains(&started.elapsed().as_secs()));
    }
}
