//! A real `nats-server`, the message broker between server and remote workers, with its message store JetStream.

use crate::server::{Process, TIMEOUT};
use std::{
    fs,
    net::{SocketAddr, TcpStream},
    path::{Path, PathBuf},
    process::{Command, Stdio},
    thread,
    time::{Duration, Instant},
};

const CONFIG: &str = "nats-server.conf";
/// A setting for NATS: its streams may have 16 GB. By default the free disk space limits them, on which tests must not depend.
pub const ENOUGH_SPACE: &str = "jetstream: {max_file_store: 16GB}\n";

/// A NATS server on a free port. Dropping it kills it (SIGKILL).
#[derive(Debug)]
pub struct Nats {
    process: Process,
    folder: PathBuf,
    address: SocketAddr,
}

impl Nats {
    /// Starts a server that stores its streams below `folder`.
    ///
    /// # Panics
    /// If `nats-server` is not installed, or does not start.
    #[must_use]
    pub fn start(folder: &Path) -> Self {
        Self::start_with_config(folder, ENOUGH_SPACE)
    }

    /// Starts a server with this configuration; port and folder are set here.
    ///
    /// # Panics
    /// As [`start`](Self::start).
    #[must_use]
    pub fn start_with_config(folder: &Path, config: &str) -> Self {
        fs::create_dir_all(folder).expect("a scratch folder can be made");
        fs::write(folder.join(CONFIG), config).expect("a scratch file can be written");
        let process = run(folder, "-1");
        // The server writes its port to a file named after its process id.
        let ports_file = folder.join(format!("nats-server_{}.ports", process.0.id()));
        let address = wait_for(|| {
            let ports: serde_json::Value =
                serde_json::from_slice(&fs::read(&ports_file).ok()?).ok()?;
            let url = ports["nats"][0].as_str()?;
            let (_, address) = url.split_once("://")?;
            address.parse().ok()
        });
        Self {
            process,
            folder: folder.to_owned(),
            address,
        }
    }

    #[must_use]
    pub fn process_id(&self) -> u32 {
        self.process.0.id()
    }

    #[must_use]
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// `nats://127.0.0.1:PORT`
    #[must_use]
    pub fn url(&self) -> String {
        format!("nats://{}", self.address)
    }

    /// Writes a configuration that applies from the next start.
    ///
    /// # Panics
    /// If the file cannot be written.
    pub fn configure(&self, config: &str) {
        fs::write(self.folder.join(CONFIG), config).expect("a scratch file can be written");
    }

    /// Kills the server and starts it again on the same port and folder.
    ///
    /// # Panics
    /// If it does not start.
    pub fn kill_and_restart(&mut self) {
        self.process.kill();
        self.restart();
    }

    /// Kills the server, removes its streams, and starts it again.
    ///
    /// # Panics
    /// If it does not start, or its streams cannot be removed.
    pub fn lose_streams_and_restart(&mut self) {
        self.process.kill();
        fs::remove_dir_all(self.folder.join("jetstream")).expect("its streams can be removed");
        self.restart();
    }

    /// Kills the server, removes the messages of its streams but not the consumers' positions, as a power cut can, and starts
    /// it again.
    ///
    /// # Panics
    /// If it does not start, or the messages cannot be removed.
    pub fn lose_messages_and_restart(&mut self) {
        self.process.kill();
        let streams = fs::read_dir(self.folder.join("jetstream/$G/streams"));
        for stream in streams.expect("the server has streams") {
            let messages = stream.expect("a folder can be read").path().join("msgs");
            fs::remove_dir_all(&messages).expect("a stream has messages");
            fs::create_dir(&messages).expect("a folder can be made");
        }
        self.restart();
    }

    fn restart(&mut self) {
        self.process = run(&self.folder, &self.address.port().to_string());
        wait_for(|| TcpStream::connect(self.address).ok());
    }
}

fn run(folder: &Path, port: &str) -> Process {
    // Debian installs it in /usr/sbin, which is not in the PATH of ordinary users.
    let debian_path = Path::new("/usr/sbin/nats-server");
    let name = match debian_path.exists() {
        true => debian_path,
        false => Path::new("nats-server"),
    };
    let started = Command::new(name)
        .args(["-js", "-a", "127.0.0.1", "-p", port])
        .arg("-c")
        .arg(folder.join(CONFIG))
        .arg("-sd")
        .arg(folder)
        .arg("--ports_file_dir")
        .arg(folder)
        .arg("-l")
        .arg(folder.join("log"))
        .stdin(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    Process(started.expect("nats-server is installed; `make setup-test` installs it"))
}

fn wait_for<T>(mut check: impl FnMut() -> Option<T>) -> T {
    let started = Instant::now();
    loop {
        if let Some(found) = check() {
            return found;
        }
        assert!(started.elapsed() < TIMEOUT, "nats-server does not start");
        // The server does not signal that it is ready.
        thread::sleep(Duration::from_millis(20));
    }
}
