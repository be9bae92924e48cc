//! A link with high latency but unlimited bandwidth: data arrives after a delay, and more can be sent meanwhile. The tests'
//! `Relay` reads the next chunk only after the previous one has arrived, so it also limits the bandwidth.

use std::{net::SocketAddr, sync::Arc, time::Duration};
use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _},
    net::{
        TcpListener, TcpStream,
        tcp::{OwnedReadHalf, OwnedWriteHalf},
    },
    sync::{OwnedSemaphorePermit, Semaphore, mpsc},
    time::Instant,
};

/// The largest amount of data in flight in each direction: as much as Linux buffers of one connection (`net.ipv4.tcp_wmem`).
pub(crate) const IN_FLIGHT_BYTES: u32 = 4 << 20;
const CHUNK_BYTES: usize = 64 << 10;

/// Forwards connections to `target` in the background. Returns the listening address.
pub(crate) async fn forward(target: SocketAddr, delay: Duration) -> anyhow::Result<SocketAddr> {
    let listener = TcpListener::bind(("127.0.0.1", 0)).await?;
    let address = listener.local_addr()?;
    tokio::spawn(async move {
        while let Ok((near, _)) = listener.accept().await {
            let Ok(far) = TcpStream::connect(target).await else {
                continue;
            };
            // A chunk waits for its delay only.
            for end in [&near, &far] {
                // A failure makes measurements slower, but not wrong.
                let _ = end.set_nodelay(true);
            }
            let ((near_in, near_out), (far_in, far_out)) = (near.into_split(), far.into_split());
            tokio::spawn(one_way(near_in, far_out, delay));
            tokio::spawn(one_way(far_in, near_out, delay));
        }
    });
    Ok(address)
}

struct Chunk {
    due: Instant,
    bytes: Vec<u8>,
    /// Its part of the data in flight.
    _permit: OwnedSemaphorePermit,
}

/// Forwards one direction until its source is closed. Closes the target once all data has arrived.
async fn one_way(mut from: OwnedReadHalf, mut to: OwnedWriteHalf, delay: Duration) {
    let permits = Arc::new(Semaphore::new(IN_FLIGHT_BYTES as usize));
    // Bounded by the permits of its chunks.
    let (send, mut sent) = mpsc::unbounded_channel::<Chunk>();
    let reading = async move {
        let mut chunk = vec![0; CHUNK_BYTES];
        while let Ok(bytes @ 1..) = from.read(&mut chunk).await {
            let count = u32::try_from(bytes).unwrap_or(IN_FLIGHT_BYTES);
            let Ok(permit) = Arc::clone(&permits).acquire_many_owned(count).await else {
                break;
            };
            let chunk = Chunk {
                due: Instant::now() + delay,
                bytes: chunk[..bytes].to_vec(),
                _permit: permit,
            };
            if send.send(chunk).is_err() {
                break;
            }
        }
    };
    let writing = async move {
        while let Some(chunk) = sent.recv().await {
            if !delay.is_zero() {
                tokio::time::sleep_until(chunk.due).await;
            }
            if to.write_all(&chunk.bytes).await.is_err() {
                break;
            }
        }
        // The connection may be closed already.
        let _ = to.shutdown().await;
    };
    tokio::join!(reading, writing);
}
