//! A TCP relay with a fixed address, whose target can change, and whose connections can be delayed or cut.

use std::{
    io::{Read as _, Write as _},
    net::{Shutdown, SocketAddr, TcpListener, TcpStream},
    sync::{Arc, Mutex, MutexGuard},
    thread,
    time::Duration,
};

/// Which connections break, and when. Random numbers from a seed decide it.
#[derive(Debug, Clone, Copy)]
pub struct ConnectionBreaks {
    pub seed: u64,
    /// Percentage of new connections that are refused.
    pub refused_percent: u64,
    /// Other connections break after a random number of bytes up to this, counted in both directions.
    pub max_bytes: u64,
}

impl ConnectionBreaks {
    /// Bytes that the n-th connection forwards before it breaks; 0: it is refused.
    fn bytes_until_break(self, connection: u64) -> u64 {
        let [first, second] = [0, 1].map(|index| draw(self.seed, 2 * connection + index));
        if first % 100 < self.refused_percent {
            0
        } else {
            1 + second % self.max_bytes
        }
    }
}

/// The number with this index of the random generator SplitMix64.
const fn draw(seed: u64, index: u64) -> u64 {
    let x = seed.wrapping_add(index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// A relay, which runs until the test ends.
#[derive(Debug)]
pub struct Relay {
    address: SocketAddr,
    link: Arc<Mutex<Link>>,
}

/// The state of a relay, which its threads share: target, disturbances and open connections.
#[derive(Debug, Default)]
struct Link {
    /// `None`: connections are dropped.
    target: Option<SocketAddr>,
    /// Delay of each forwarded chunk.
    delay: Duration,
    breaks: Option<ConnectionBreaks>,
    /// Number of connections so far.
    connections: u64,
    /// Connections that broke by [`ConnectionBreaks`].
    broken: u64,
    /// Both ends of the open connections, so that they can be cut.
    open: Vec<TcpStream>,
}

impl Relay {
    /// Starts a relay without a target.
    ///
    /// # Panics
    /// If the host has no port left.
    #[must_use]
    pub fn start() -> Self {
        let listener = TcpListener::bind(("127.0.0.1", 0)).expect("there is a port");
        let address = listener.local_addr().expect("it is bound");
        let link = Arc::<Mutex<Link>>::default();
        thread::spawn({
            let link = Arc::clone(&link);
            move || {
                for client in listener.incoming().map_while(Result::ok) {
                    forward_connection(&link, client);
                }
            }
        });
        Self { address, link }
    }

    #[must_use]
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// Sets the target of new connections.
    pub fn set_target(&self, target: SocketAddr) {
        self.link().target = Some(target);
    }

    /// Delays each chunk in both directions from now on.
    pub fn set_delay(&self, delay: Duration) {
        self.link().delay = delay;
    }

    /// Makes new connections break from now on.
    pub fn set_breaks(&self, breaks: ConnectionBreaks) {
        self.link().breaks = Some(breaks);
    }

    /// The number of connections that broke so far.
    #[must_use]
    pub fn broken_connections(&self) -> u64 {
        self.link().broken
    }

    /// Cuts all connections and removes the target.
    pub fn disconnect(&self) {
        let mut link = self.link();
        link.target = None;
        for open in link.open.drain(..) {
            // The connection may have ended already.
            let _ = open.shutdown(Shutdown::Both);
        }
    }

    fn link(&self) -> MutexGuard<'_, Link> {
        self.link
            .lock()
            .expect("no thread panics while it holds the link")
    }
}

/// Forwards a connection in both directions, or drops it.
fn forward_connection(link: &Arc<Mutex<Link>>, client: TcpStream) {
    let (target, bytes_until_break) = {
        let mut link = link
            .lock()
            .expect("no thread panics while it holds the link");
        let connection = link.connections;
        link.connections += 1;
        let bytes_until_break = link
            .breaks
            .map(|breaks| breaks.bytes_until_break(connection));
        if bytes_until_break == Some(0) {
            link.broken += 1;
            return;
        }
        (link.target, bytes_until_break)
    };
    let Some(server) = target.and_then(|target| TcpStream::connect(target).ok()) else {
        return;
    };
    let ends = [(&client, &server), (&server, &client)];
    let ends = ends.map(|(from, to)| Some((from.try_clone().ok()?, to.try_clone().ok()?)));
    let [Some(outbound), Some(inbound)] = ends else {
        return;
    };
    {
        let mut link = link
            .lock()
            .expect("no thread panics while it holds the link");
        link.open.push(client);
        link.open.push(server);
    }
    // In both directions together; `None`: the connection does not break.
    let remaining_bytes = bytes_until_break.map(|bytes| Arc::new(Mutex::new(bytes)));
    for (from, to) in [outbound, inbound] {
        let (link, remaining_bytes) = (Arc::clone(link), remaining_bytes.clone());
        thread::spawn(move || forward(&link, from, to, remaining_bytes.as_deref()));
    }
}

/// Forwards one direction of a connection, until it ends or breaks.
fn forward(
    link: &Mutex<Link>,
    mut from: TcpStream,
    mut to: TcpStream,
    remaining_bytes: Option<&Mutex<u64>>,
) {
    let mut chunk = vec![0; 1 << 16];
    loop {
        let bytes = from.read(&mut chunk).unwrap_or_default();
        let delay = link
            .lock()
            .expect("no thread panics while it holds the link")
            .delay;
        if !delay.is_zero() {
            thread::sleep(delay);
        }
        let forwarded = remaining_bytes.map_or(bytes, |remaining| take_bytes(remaining, bytes));
        if bytes == 0 || to.write_all(&chunk[..forwarded]).is_err() {
            break;
        }
        if forwarded < bytes {
            // The direction that takes the last byte closes both ends.
            if from.shutdown(Shutdown::Both).is_ok() {
                link.lock()
                    .expect("no thread panics while it holds the link")
                    .broken += 1;
            }
            // The connection may have ended already.
            let _ = to.shutdown(Shutdown::Both);
            return;
        }
    }
    // The other direction continues until its end.
    let _ = to.shutdown(Shutdown::Write);
}

/// Takes up to `bytes` from the remaining bytes; returns the number taken.
fn take_bytes(remaining: &Mutex<u64>, bytes: usize) -> usize {
    let mut remaining = remaining
        .lock()
        .expect("no thread panics while it holds the number");
    let taken = usize::try_from(*remaining).map_or(bytes, |remaining| remaining.min(bytes));
    *remaining -= taken as u64;
    taken
}
