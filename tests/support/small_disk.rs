//! A server whose data folder is a small disk, which a test fills and empties while it runs.
//!
//! The disk is a file system in memory that only the server sees, mounted where only the server has a
//! mount: it goes with the process. The test reaches it through the process's root folder.

use crate::{
    program,
    server::{Server, serve},
};
use rustix::fs::statvfs;
use std::{
    fs::{self, OpenOptions},
    io::{ErrorKind, Write as _},
    path::{Path, PathBuf},
    process::Command,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::{self, JoinHandle},
    time::Duration,
};

const PAGE_BYTES: usize = 4096;
const FILLER: &str = "filler";

/// Mounts a disk of `$0` at `$1`, then becomes the rest; `$2` is where its log goes.
const MOUNT_AND_RUN: &str = r#"mount -t tmpfs -o "size=$0,mode=0700" faceoff "$1" && log="$2" && shift 2 &&
if [ -n "$log" ]; then exec "$@" 2>>"$log"; else exec "$@"; fi"#;

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
    /// The server.
    pub server: Server,
    /// The data folder, as this process sees it.
    pub data_dir: PathBuf,
}

impl SmallDisk {
    /// Starts a server with a data folder of `bytes`; its configuration lies beside that, in `folder`.
    ///
    /// # Panics
    /// If it does not start: this needs root, as the sandbox does.
    #[must_use]
    pub fn start(folder: &Path, bytes: u64, config: &str, log: LogTo) -> Self {
        let mount = folder.join("disk");
        fs::create_dir_all(&mount).expect("a scratch folder can be made");
        let config_file = folder.join("faceoff.toml");
        fs::write(&config_file, config).expect("a scratch file can be written");
        let mut command = Command::new("unshare");
        command
            .args(["--mount", "sh", "-c", MOUNT_AND_RUN])
            .arg(bytes.to_string())
            .arg(&mount)
            .arg(match log {
                LogTo::Test => PathBuf::new(),
                LogTo::Disk => mount.join("log"),
            })
            .arg(program("faceoff"));
        serve(&mut command, &mount, &config_file);
        // Every program on the way becomes the next one: the id stays.
        let inside = |process: u32| {
            let absolute = mount.canonicalize().expect("the folder was made");
            let below_root = absolute.strip_prefix("/").expect("it is absolute");
            PathBuf::from(format!("/proc/{process}/root")).join(below_root)
        };
        let server = Server::answering(command, inside);
        let data_dir = inside(server.process_id());
        Self { server, data_dir }
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
