//! A real `nats-server` with JetStream.

use crate::server::{PATIENCE, Process};
use std::{
    fs,
    net::{SocketAddr, TcpStream},
    path::{Path, PathBuf},
    process::{Command, Stdio},
    thread,
    time::{Duration, Instant},
};

/// Its configuration, in its folder.
const CONFIG: &str = "nats-server.conf";

/// It, on a port of its own. Dropping it ends it at once (SIGKILL).
#[derive(Debug)]
pub struct Nats {
    process: Process,
    folder: PathBuf,
    address: SocketAddr,
}

impl Nats {
    /// Starts one that keeps its streams below `folder`.
    ///
    /// # Panics
    /// If none is installed, or it does not start.
    #[must_use]
    pub fn start(folder: &Path) -> Self {
        Self::configured(folder, "")
    }

    /// Starts one with a configuration, but for its port and folder.
    ///
    /// # Panics
    /// As [`start`](Self::start).
    #[must_use]
    pub fn configured(folder: &Path, config: &str) -> Self {
        fs::create_dir_all(folder).expect("a scratch folder can be made");
        fs::write(folder.join(CONFIG), config).expect("a scratch file can be written");
        let process = run(folder, "-1");
        // It tells which port it was given in a file that is named for its process.
        let told = folder.join(format!("nats-server_{}.ports", process.0.id()));
        let address = wait_for(|| {
            let told: serde_json::Value = serde_json::from_slice(&fs::read(&told).ok()?).ok()?;
            let url = told["nats"][0].as_str()?;
            let (_, address) = url.split_once("://")?;
            address.parse().ok()
        });
        Self {
            process,
            folder: folder.to_owned(),
            address,
        }
    }

    /// The id of its process.
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

    /// From its next start on it has this configuration.
    ///
    /// # Panics
    /// If that cannot be written.
    pub fn configure(&self, config: &str) {
        fs::write(self.folder.join(CONFIG), config).expect("a scratch file can be written");
    }

    /// Ends it as a power cut would, and starts it again where it was.
    ///
    /// # Panics
    /// If it does not start.
    pub fn kill_and_start(&mut self) {
        self.process.end();
        self.start_again();
    }

    /// Likewise, and of its streams nothing is left.
    ///
    /// # Panics
    /// If it does not start, or its streams cannot be removed.
    pub fn lose_all_and_start(&mut self) {
        self.process.end();
        fs::remove_dir_all(self.folder.join("jetstream")).expect("its streams can be removed");
        self.start_again();
    }

    /// Likewise, and of its streams only how far they were read is left, as after a power cut.
    ///
    /// # Panics
    /// If it does not start, or what it has stored cannot be removed.
    pub fn lose_messages_and_start(&mut self) {
        self.process.end();
        let streams = fs::read_dir(self.folder.join("jetstream/$G/streams"));
        for stream in streams.expect("it has streams") {
            let messages = stream.expect("a folder can be read").path().join("msgs");
            fs::remove_dir_all(&messages).expect("a stream has messages");
            fs::create_dir(&messages).expect("a folder can be made");
        }
        self.start_again();
    }

    fn start_again(&mut self) {
        self.process = run(&self.folder, &self.address.port().to_string());
        wait_for(|| TcpStream::connect(self.address).ok());
    }
}

fn run(folder: &Path, port: &str) -> Process {
    // Debian has it where ordinary users do not look.
    let debians = Path::new("/usr/sbin/nats-server");
    let name = match debians.exists() {
        true => debians,
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

fn wait_for<T>(mut look: impl FnMut() -> Option<T>) -> T {
    let started = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(started.elapsed() < PATIENCE, "nats-server does not start");
        // It tells nobody that it is ready.
        thread::sleep(Duration::from_millis(20));
    }
}
