//! A link that can be cut, and leads elsewhere when it is told to: connections to an address that stays are passed on.

use std::{
    io::{Read as _, Write as _},
    net::{Shutdown, SocketAddr, TcpListener, TcpStream},
    sync::{Arc, Mutex, MutexGuard},
    thread,
    time::Duration,
};

/// Which connections break. The same seed draws the same.
#[derive(Debug, Clone, Copy)]
pub struct Breaks {
    /// Of all the draws.
    pub seed: u64,
    /// Of a hundred new connections so many are refused.
    pub refused_percent: u64,
    /// Each other one is cut after a drawn number of bytes, at most so many, both ways together.
    pub most_bytes: u64,
}

impl Breaks {
    /// How many bytes the n-th connection passes on before it breaks.
    fn life_bytes(self, connection: u64) -> u64 {
        let [first, second] = [0, 1].map(|index| draw(self.seed, 2 * connection + index));
        if first % 100 < self.refused_percent {
            0
        } else {
            1 + second % self.most_bytes
        }
    }
}

/// SplitMix64.
const fn draw(seed: u64, n: u64) -> u64 {
    let x = seed.wrapping_add(n.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// A link, for as long as the test runs.
#[derive(Debug)]
pub struct Relay {
    address: SocketAddr,
    link: Arc<Mutex<Link>>,
}

#[derive(Debug, Default)]
struct Link {
    /// None: nobody is there.
    to: Option<SocketAddr>,
    /// How long a piece takes.
    delay: Duration,
    breaks: Option<Breaks>,
    connections: u64,
    /// Those of them that were broken.
    broken: u64,
    open: Vec<TcpStream>,
}

impl Relay {
    /// One that leads nowhere yet.
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
                for near in listener.incoming().map_while(Result::ok) {
                    connect(&link, near);
                }
            }
        });
        Self { address, link }
    }

    #[must_use]
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// From now on it leads there.
    pub fn lead_to(&self, to: SocketAddr) {
        self.link().to = Some(to);
    }

    /// From now on each piece of what goes through, in either direction, takes so long.
    pub fn delay(&self, delay: Duration) {
        self.link().delay = delay;
    }

    /// From now on new connections break.
    pub fn breaks(&self, breaks: Breaks) {
        self.link().breaks = Some(breaks);
    }

    /// How many connections were broken so far.
    #[must_use]
    pub fn broken(&self) -> u64 {
        self.link().broken
    }

    /// Cuts all connections; it leads nowhere until it is told again.
    pub fn cut(&self) {
        let mut link = self.link();
        link.to = None;
        for open in link.open.drain(..) {
            // One that has ended is cut.
            let _ = open.shutdown(Shutdown::Both);
        }
    }

    fn link(&self) -> MutexGuard<'_, Link> {
        self.link.lock().expect("nobody panics with the link")
    }
}

/// Passes on what comes, both ways, or drops the connection.
fn connect(link: &Arc<Mutex<Link>>, near: TcpStream) {
    let (to, life_bytes) = {
        let mut link = link.lock().expect("nobody panics with the link");
        let connection = link.connections;
        link.connections += 1;
        let life_bytes = link.breaks.map(|breaks| breaks.life_bytes(connection));
        if life_bytes == Some(0) {
            link.broken += 1;
            return;
        }
        (link.to, life_bytes)
    };
    let Some(far) = to.and_then(|to| TcpStream::connect(to).ok()) else {
        return;
    };
    let ends = [(&near, &far), (&far, &near)];
    let ends = ends.map(|(from, to)| Some((from.try_clone().ok()?, to.try_clone().ok()?)));
    let [Some(there), Some(back)] = ends else {
        return;
    };
    {
        let mut link = link.lock().expect("nobody panics with the link");
        link.open.push(near);
        link.open.push(far);
    }
    // Of both ways together; none: it does not break.
    let left = life_bytes.map(|bytes| Arc::new(Mutex::new(bytes)));
    for (from, to) in [there, back] {
        let (link, left) = (Arc::clone(link), left.clone());
        thread::spawn(move || pass(&link, from, to, left.as_deref()));
    }
}

fn pass(link: &Mutex<Link>, mut from: TcpStream, mut to: TcpStream, left: Option<&Mutex<u64>>) {
    let mut piece = vec![0; 1 << 16];
    loop {
        let bytes = from.read(&mut piece).unwrap_or_default();
        let delay = link.lock().expect("nobody panics with the link").delay;
        if !delay.is_zero() {
            thread::sleep(delay);
        }
        let passes = left.map_or(bytes, |left| take(left, bytes));
        if bytes == 0 || to.write_all(&piece[..passes]).is_err() {
            break;
        }
        if passes < bytes {
            // Whichever way takes the last byte: the other finds both ends shut.
            if from.shutdown(Shutdown::Both).is_ok() {
                link.lock().expect("nobody panics with the link").broken += 1;
            }
            // One that has ended is cut.
            let _ = to.shutdown(Shutdown::Both);
            return;
        }
    }
    // The other way goes on until its own end.
    let _ = to.shutdown(Shutdown::Write);
}

/// Takes so many, or those that are left.
fn take(left: &Mutex<u64>, bytes: usize) -> usize {
    let mut left = left.lock().expect("nobody panics with a number");
    let taken = usize::try_from(*left).map_or(bytes, |left| left.min(bytes));
    *left -= taken as u64;
    taken
}
