//! A link that can be cut, and leads elsewhere when it is told to: connections to an address that stays are passed on.

use std::{
    io::{Read as _, Write as _},
    net::{Shutdown, SocketAddr, TcpListener, TcpStream},
    sync::{Arc, Mutex, MutexGuard},
    thread,
    time::Duration,
};

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

    /// Where it listens.
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
    let to = link.lock().expect("nobody panics with the link").to;
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
    for (from, to) in [there, back] {
        let link = Arc::clone(link);
        thread::spawn(move || pass(&link, from, to));
    }
}

fn pass(link: &Mutex<Link>, mut from: TcpStream, mut to: TcpStream) {
    let mut piece = vec![0; 1 << 16];
    loop {
        let bytes = from.read(&mut piece).unwrap_or_default();
        let delay = link.lock().expect("nobody panics with the link").delay;
        if !delay.is_zero() {
            thread::sleep(delay);
        }
        if bytes == 0 || to.write_all(&piece[..bytes]).is_err() {
            break;
        }
    }
    // The other way goes on until its own end.
    let _ = to.shutdown(Shutdown::Write);
}
