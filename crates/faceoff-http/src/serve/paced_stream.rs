//! A connection whose reader must read.

use faceoff_service::pace::{LeastRate, Pace};
use std::{
    io::{self, IoSlice},
    pin::Pin,
    task::{Context, Poll, ready},
};
use tokio::{
    io::{AsyncRead, AsyncWrite, ReadBuf},
    time::{Instant, Sleep},
};

/// Fails to write once the peer has taken less than the least rate for longer than its grace. Only time
/// in which there is something for it to take counts, however long we make it wait for an answer.
#[derive(Debug)]
pub(super) struct PacedStream<S> {
    stream: S,
    pace: Pace,
    waiting: Option<Waiting>,
    /// What is done to a stream that is given up.
    reset: fn(&S),
}

/// The peer is to take something.
#[derive(Debug)]
struct Waiting {
    since: Instant,
    over: Pin<Box<Sleep>>,
}

impl<S> PacedStream<S> {
    pub(super) const fn new(stream: S, rate: LeastRate, reset: fn(&S)) -> Self {
        Self {
            stream,
            pace: Pace::new(rate),
            waiting: None,
            reset,
        }
    }

    /// What a write has come to.
    fn written(
        &mut self,
        context: &mut Context<'_>,
        written: Poll<io::Result<usize>>,
    ) -> Poll<io::Result<usize>> {
        if let Poll::Ready(written) = written {
            if let Some(waiting) = self.waiting.take() {
                self.pace.waited(waiting.since.elapsed());
            }
            let bytes = written?;
            self.pace.moved(bytes);
            return Poll::Ready(Ok(bytes));
        }
        let left = self.pace.left();
        let waiting = self.waiting.get_or_insert_with(|| Waiting {
            since: Instant::now(),
            over: Box::pin(tokio::time::sleep(left)),
        });
        ready!(waiting.over.as_mut().poll(context));
        (self.reset)(&self.stream);
        Poll::Ready(Err(io::Error::new(
            io::ErrorKind::TimedOut,
            "the peer takes too little of its answer",
        )))
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for PacedStream<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for PacedStream<S> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write(context, bytes);
        self.written(context, written)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        pieces: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write_vectored(context, pieces);
        self.written(context, written)
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

    const RATE: LeastRate = LeastRate {
        bytes_per_s: 1000,
        grace: Duration::from_secs(30),
    };

    fn paced() -> (PacedStream<DuplexStream>, DuplexStream) {
        let (ours, peers) = duplex(100);
        (PacedStream::new(ours, RATE, |_| {}), peers)
    }

    #[tokio::test(start_paused = true)]
    async fn a_reader_that_takes_nothing_is_let_go_after_its_grace() {
        let (mut stream, _peer) = paced();
        let began = Instant::now();
        let error = stream.write_all(&[7; 1000]).await.unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::TimedOut);
        assert_eq!(began.elapsed().as_secs(), 30);
    }

    #[tokio::test(start_paused = true)]
    async fn a_reader_that_keeps_the_rate_may_take_all_day_and_we_may_take_our_time() {
        let (mut stream, mut peer) = paced();
        let reading = tokio::spawn(async move {
            let mut taken = [0; 100];
            for _ in 0..1000 {
                tokio::time::sleep(Duration::from_millis(90)).await;
                peer.read_exact(&mut taken).await.unwrap();
            }
            peer
        });
        stream.write_all(&[7; 100_000]).await.unwrap();
        let _peer = reading.await.unwrap();
        tokio::time::sleep(Duration::from_secs(1000)).await;
        stream.write_all(&[7; 100]).await.unwrap();
    }

    #[tokio::test(start_paused = true)]
    async fn a_trickle_below_the_rate_ends_too() {
        let (mut stream, mut peer) = paced();
        tokio::spawn(async move {
            while peer.read_u8().await.is_ok() {
                tokio::time::sleep(Duration::from_secs(1)).await;
            }
        });
        let began = Instant::now();
        let error = stream.write_all(&[7; 1000]).await.unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::TimedOut);
        assert!((30..=32).contains(&began.elapsed().as_secs()));
    }
}
