//! A link that is long and not narrow: what is sent arrives after a delay, and more may be sent meanwhile. The tests' `Relay` takes its
//! next piece only once the last has arrived, which makes a link as narrow as it is long, for whoever sends much at once.

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

/// So much is under way at most, in either direction: as much as Linux keeps of what one connection has sent (`net.ipv4.tcp_wmem`).
pub(crate) const UNDER_WAY_BYTES: u32 = 4 << 20;
const PIECE_BYTES: usize = 64 << 10;

/// Passes on connections to `to`, in the background; returns where it listens.
pub(crate) async fn to(to: SocketAddr, delay: Duration) -> anyhow::Result<SocketAddr> {
    let listener = TcpListener::bind(("127.0.0.1", 0)).await?;
    let address = listener.local_addr()?;
    tokio::spawn(async move {
        while let Ok((near, _)) = listener.accept().await {
            let Ok(far) = TcpStream::connect(to).await else {
                continue;
            };
            // A piece waits for its delay, and for nothing else.
            for end in [&near, &far] {
                // Without it a measurement is slower, and not wrong.
                let _ = end.set_nodelay(true);
            }
            let ((near_in, near_out), (far_in, far_out)) = (near.into_split(), far.into_split());
            tokio::spawn(one_way(near_in, far_out, delay));
            tokio::spawn(one_way(far_in, near_out, delay));
        }
    });
    Ok(address)
}

struct Piece {
    due: Instant,
    bytes: Vec<u8>,
    /// Of what may be under way.
    _room: OwnedSemaphorePermit,
}

/// Until one end is closed; then so is the other, once all has arrived.
async fn one_way(mut from: OwnedReadHalf, mut to: OwnedWriteHalf, delay: Duration) {
    let room = Arc::new(Semaphore::new(UNDER_WAY_BYTES as usize));
    // Bounded by the room that its pieces take.
    let (send, mut sent) = mpsc::unbounded_channel::<Piece>();
    let reading = async move {
        let mut piece = vec![0; PIECE_BYTES];
        while let Ok(bytes @ 1..) = from.read(&mut piece).await {
            let taken = u32::try_from(bytes).unwrap_or(UNDER_WAY_BYTES);
            let Ok(room) = Arc::clone(&room).acquire_many_owned(taken).await else {
                break;
            };
            let piece = Piece {
                due: Instant::now() + delay,
                bytes: piece[..bytes].to_vec(),
                _room: room,
            };
            if send.send(piece).is_err() {
                break;
            }
        }
    };
    let writing = async move {
        while let Some(piece) = sent.recv().await {
            if !delay.is_zero() {
                tokio::time::sleep_until(piece.due).await;
            }
            if to.write_all(&piece.bytes).await.is_err() {
                break;
            }
        }
        // It may be closed already.
        let _ = to.shutdown().await;
    };
    tokio::join!(reading, writing);
}
