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
/// Largest amount of data that is forwarded at once.
const CHUNK_BYTES: usize = 64 << 10;

/// Forwards connections to `target` in the background. Returns the listening address.
pub(crate) async fn forward(target: SocketAddr, delay: Duration) -> anyhow::Result<SocketAddr> {
    let listener = TcpListener::bind(("127.0.0.1", 0)).await?;
    let address = listener.local_addr()?;
    tokio::spawn(async move {
        while let Ok((client, _)) = listener.accept().await {
            let Ok(server) = TcpStream::connect(target).await else {
                continue;
            };
            // A chunk waits for its delay only.
            for end in [&client, &server] {
                // A failure makes measurements slower, but not wrong.
                let _ = end.set_nodelay(true);
            }
            let (from_client, to_client) = client.into_split();
            let (from_server, to_server) = server.into_split();
            tokio::spawn(forward_one_way(from_client, to_server, delay));
            tokio::spawn(forward_one_way(from_server, to_client, delay));
        }
    });
    Ok(address)
}

/// Data on the link.
struct Chunk {
    /// When it arrives.
    due: Instant,
    bytes: Vec<u8>,
    /// Its part of the data in flight.
    _permit: OwnedSemaphorePermit,
}

/// Forwards one direction until its source is closed. Closes the target once all data has arrived.
async fn forward_one_way(mut source: OwnedReadHalf, mut target: OwnedWriteHalf, delay: Duration) {
    let permits = Arc::new(Semaphore::new(IN_FLIGHT_BYTES as usize));
    // Bounded by the permits of its chunks.
    let (send, mut sent) = mpsc::unbounded_channel::<Chunk>();
    let reading = async move {
        let mut chunk = vec![0; CHUNK_BYTES];
        while let Ok(bytes @ 1..) = source.read(&mut chunk).await {
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
            if target.write_all(&chunk.bytes).await.is_err() {
                break;
            }
        }
        // The connection may be closed already.
        let _ = target.shutdown().await;
    };
    tokio::join!(reading, writing);
}
