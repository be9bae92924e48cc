//! A server whose data folder is a small disk, which a test fills and empties while it runs.
//!
//! The disk is a file system in memory, mounted where only a process that does nothing else and the server
//! see it: it goes with that process, which goes with the test, and outlives the server. The test reaches it
//! through the process's root folder.

use crate::{
    program,
    server::{Process, Server, serve},
};
use rustix::fs::statvfs;
use std::{
    fs::{self, OpenOptions},
    io::{BufRead as _, BufReader, ErrorKind, Write as _},
    path::{Path, PathBuf},
    process::{Command, Stdio},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::{self, JoinHandle},
    time::Duration,
};

const PAGE_BYTES: usize = 4096;
const FILLER: &str = "filler";

/// Mounts a disk of `$0` at `$1`, says so, and keeps it until its input ends.
const MOUNT_AND_HOLD: &str =
    r#"mount -t tmpfs -o "size=$0,mode=0700" faceoff "$1" && echo mounted && exec cat"#;
/// Becomes the rest; `$0` is where its log goes, if not where it went.
const LOG_AND_RUN: &str = r#"if [ -n "$0" ]; then exec "$@" 2>>"$0"; else exec "$@"; fi"#;

/// Where the server's log goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogTo {
    /// Where [`Server::log`] finds it.
    Test,
    /// A file on the small disk, [`SmallDisk::log_file`].
    Disk,
}

/// A running server and its disk.
#[derive(Debug)]
pub struct SmallDisk {
    pub server: Server,
    /// The data folder, as this process sees it.
    pub data_dir: PathBuf,
    disk: Disk,
}

/// A small disk, for whoever is started in its sight.
#[derive(Debug)]
pub struct Mounted {
    holder: Process,
    /// Where those that are started in its sight see it.
    pub mount: PathBuf,
}

impl Mounted {
    /// A disk of `bytes` at `folder`.
    ///
    /// # Panics
    /// If it cannot be mounted: this needs root, as the sandbox does.
    #[must_use]
    pub fn at(folder: &Path, bytes: u64) -> Self {
        let mount = folder.to_owned();
        fs::create_dir_all(&mount).expect("a scratch folder can be made");
        let child = Command::new("unshare")
            .args(["--mount", "sh", "-c", MOUNT_AND_HOLD])
            .arg(bytes.to_string())
            .arg(&mount)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn();
        let mut holder = Process(child.expect("the program can be started"));
        let mut told = String::new();
        BufReader::new(holder.0.stdout.take().expect("it is piped"))
            .read_line(&mut told)
            .expect("a pipe can be read");
        assert_eq!(
            told.trim(),
            "mounted",
            "this needs root, as the sandbox does"
        );
        Self { holder, mount }
    }

    /// It, as this process sees it.
    ///
    /// # Panics
    /// If the folder has gone.
    #[must_use]
    pub fn seen_from_here(&self) -> PathBuf {
        let absolute = self.mount.canonicalize().expect("the folder was made");
        let below_root = absolute.strip_prefix("/").expect("it is absolute");
        PathBuf::from(format!("/proc/{}/root", self.holder.0.id())).join(below_root)
    }

    /// What becomes the program that its next word names, in the sight of the disk. The id stays.
    #[must_use]
    pub fn in_sight(&self) -> Command {
        let mut command = Command::new("nsenter");
        command.args(["--mount", "--target", &self.holder.0.id().to_string()]);
        command
    }
}

/// The disk, and how a server on it is started.
#[derive(Debug)]
struct Disk {
    disk: Mounted,
    config_file: PathBuf,
    log: LogTo,
}

impl Disk {
    fn mount(folder: &Path, bytes: u64, config: &str, log: LogTo) -> Self {
        let config_file = folder.join("faceoff.toml");
        fs::create_dir_all(folder).expect("a scratch folder can be made");
        fs::write(&config_file, config).expect("a scratch file can be written");
        Self {
            disk: Mounted::at(&folder.join("disk"), bytes),
            config_file,
            log,
        }
    }

    /// The data folder, as this process sees it.
    fn data_dir(&self) -> PathBuf {
        self.disk.seen_from_here()
    }

    fn start_server(&self) -> Server {
        let mut command = self.disk.in_sight();
        command
            .args(["sh", "-c", LOG_AND_RUN])
            .arg(match self.log {
                LogTo::Test => PathBuf::new(),
                LogTo::Disk => self.disk.mount.join("log"),
            })
            .arg(program("faceoff"));
        serve(&mut command, &self.disk.mount, &self.config_file);
        // Every program on the way becomes the next one: the id stays.
        Server::answering(command, |_| self.data_dir())
    }
}

impl SmallDisk {
    /// Starts a server with a data folder of `bytes`; its configuration lies beside that, in `folder`.
    ///
    /// # Panics
    /// If it does not start: this needs root, as the sandbox does.
    #[must_use]
    pub fn start(folder: &Path, bytes: u64, config: &str, log: LogTo) -> Self {
        let disk = Disk::mount(folder, bytes, config, log);
        Self {
            server: disk.start_server(),
            data_dir: disk.data_dir(),
            disk,
        }
    }

    /// Kills the server, does something, and starts another on the same disk.
    ///
    /// # Panics
    /// If that does not start.
    pub fn kill_and_restart(&mut self, between: impl FnOnce()) {
        self.server.end();
        between();
        self.server = self.disk.start_server();
    }

    /// The log on the disk.
    #[must_use]
    pub fn log_file(&self) -> PathBuf {
        self.data_dir.join("log")
    }

    /// What is free on the disk, in bytes.
    ///
    /// # Panics
    /// If the server has ended.
    #[must_use]
    pub fn free_bytes(&self) -> u64 {
        let disk = statvfs(&self.data_dir).expect("the disk is there");
        disk.f_bavail * disk.f_frsize
    }

    /// Fills the disk to its last page and keeps it full, whatever the server removes, until the
    /// answer is dropped.
    ///
    /// # Panics
    /// If the disk does not fill up.
    #[must_use]
    pub fn full(&self) -> Full {
        Full::of(&self.data_dir)
    }

    /// Fills the disk but for about so many bytes, once; until the answer is dropped.
    ///
    /// # Panics
    /// If less is free.
    #[must_use]
    pub fn all_but(&self, bytes: u64) -> Full {
        let file = self.data_dir.join(FILLER);
        let free = self.free_bytes();
        let taken = free.checked_sub(bytes).expect("so much is free");
        let zeros = vec![0; usize::try_from(taken).expect("a small disk")];
        fs::write(&file, zeros).expect("so much is free");
        Full {
            file,
            over: Arc::default(),
            filling: None,
        }
    }

    /// All files below a folder of the data folder.
    #[must_use]
    pub fn files(&self, folder: &str) -> Vec<PathBuf> {
        let mut files = Vec::new();
        let mut folders = vec![self.data_dir.join(folder)];
        while let Some(folder) = folders.pop() {
            // What the server removes meanwhile is not there.
            let Ok(entries) = fs::read_dir(&folder) else {
                continue;
            };
            for entry in entries.flatten() {
                match entry.file_type() {
                    Ok(kind) if kind.is_dir() => folders.push(entry.path()),
                    Ok(_) => files.push(entry.path()),
                    Err(_) => {}
                }
            }
        }
        files
    }
}

/// A disk that is full for as long as this lives.
#[derive(Debug)]
pub struct Full {
    file: PathBuf,
    over: Arc<AtomicBool>,
    filling: Option<JoinHandle<()>>,
}

impl Full {
    /// Fills the disk of a data folder as [`SmallDisk::full`] does.
    ///
    /// # Panics
    /// If the disk does not fill up.
    #[must_use]
    pub fn of(data_dir: &Path) -> Self {
        let file = data_dir.join(FILLER);
        fill(&file);
        let over = Arc::new(AtomicBool::new(false));
        let filling = thread::spawn({
            let (file, over) = (file.clone(), Arc::clone(&over));
            move || {
                while !over.load(Ordering::Relaxed) {
                    fill(&file);
                    thread::sleep(Duration::from_millis(1));
                }
            }
        });
        Self {
            file,
            over,
            filling: Some(filling),
        }
    }
}

impl Drop for Full {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        if let Some(filling) = self.filling.take() {
            // It can only have failed together with the server, which says so itself.
            let _ = filling.join();
        }
        let _ = fs::remove_file(&self.file);
    }
}

/// Appends until nothing fits.
fn fill(file: &Path) {
    let filler = OpenOptions::new().create(true).append(true).open(file);
    let mut filler = filler.expect("the disk is there");
    let pages = [0; 64 * PAGE_BYTES];
    let mut bytes = pages.len();
    loop {
        match filler.write_all(&pages[..bytes]) {
            Ok(()) => {}
            Err(error) if error.kind() == ErrorKind::StorageFull && bytes > PAGE_BYTES => {
                bytes = PAGE_BYTES;
            }
            Err(error) if error.kind() == ErrorKind::StorageFull => return,
            Err(error) => panic!("filling the disk: {error}"),
        }
    }
}
