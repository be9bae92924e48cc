//! A server whose data folder is on a small disk, which a test fills and empties while the server runs.
//!
//! The disk is a file system in memory, in a mount namespace that only a holder process and the server share. It exists
//! as long as the holder, which ends with the test and outlives the server. The test reaches it through the holder's root
//! folder.

use crate::{
    program,
    server::{Process, Server, add_serve_arguments},
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
/// The file that fills the disk.
const FILLER: &str = "filler";

/// A shell script: mounts a disk of size `$0` at `$1`, prints `mounted`, and holds it until its input ends.
const MOUNT_AND_HOLD: &str =
    r#"mount -t tmpfs -o "size=$0,mode=0700" faceoff "$1" && echo mounted && exec cat"#;
/// A shell script: runs its arguments as a command. Standard error is appended to the file `$0`, unless that is empty.
const LOG_AND_RUN: &str = r#"if [ -n "$0" ]; then exec "$@" 2>>"$0"; else exec "$@"; fi"#;

/// The destination of the server's log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogTarget {
    /// The pipe that [`Server::log`] reads.
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
    disk: ServerDisk,
}

/// A small disk in a separate mount namespace.
#[derive(Debug)]
pub struct MountedDisk {
    holder: Process,
    /// Path of the disk inside its mount namespace.
    pub mount: PathBuf,
}

impl MountedDisk {
    /// Mounts a disk of `bytes` at `folder`.
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
        let mut line = String::new();
        BufReader::new(holder.0.stdout.take().expect("it is piped"))
            .read_line(&mut line)
            .expect("a pipe can be read");
        assert_eq!(
            line.trim(),
            "mounted",
            "this needs root, as the sandbox does"
        );
        Self { holder, mount }
    }

    /// The disk's path outside of its mount namespace, for the test.
    ///
    /// # Panics
    /// If the folder does not exist.
    #[must_use]
    pub fn outside_path(&self) -> PathBuf {
        let absolute = self.mount.canonicalize().expect("the folder was made");
        let below_root = absolute.strip_prefix("/").expect("it is absolute");
        PathBuf::from(format!("/proc/{}/root", self.holder.0.id())).join(below_root)
    }

    /// A command that runs its arguments as a program in the disk's mount namespace, with the same process id.
    #[must_use]
    pub fn namespace_command(&self) -> Command {
        let mut command = Command::new("nsenter");
        command.args(["--mount", "--target", &self.holder.0.id().to_string()]);
        command
    }
}

/// The disk and the configuration of a server on it.
#[derive(Debug)]
struct ServerDisk {
    disk: MountedDisk,
    config_file: PathBuf,
    log: LogTarget,
    /// Environment variables of the server.
    environment: Vec<(&'static str, String)>,
}

impl ServerDisk {
    fn mount(folder: &Path, bytes: u64, config: &str, log: LogTarget) -> Self {
        let config_file = folder.join("faceoff.toml");
        fs::create_dir_all(folder).expect("a scratch folder can be made");
        fs::write(&config_file, config).expect("a scratch file can be written");
        Self {
            disk: MountedDisk::at(&folder.join("disk"), bytes),
            config_file,
            log,
            environment: Vec::new(),
        }
    }

    /// The data folder, as this process sees it.
    fn data_dir(&self) -> PathBuf {
        self.disk.outside_path()
    }

    fn start_server(&self) -> Server {
        let mut command = self.disk.namespace_command();
        command
            .args(["sh", "-c", LOG_AND_RUN])
            .arg(match self.log {
                LogTarget::Test => PathBuf::new(),
                LogTarget::Disk => self.disk.mount.join("log"),
            })
            .arg(program("faceoff"));
        add_serve_arguments(&mut command, &self.disk.mount, &self.config_file);
        command.envs(self.environment.iter().cloned());
        // Each program executes the next one in its place, so the process id stays.
        Server::start_command(command, |_| self.data_dir())
    }
}

impl SmallDisk {
    /// Starts a server with a data folder of `bytes`; its configuration is beside that, in `folder`.
    ///
    /// # Panics
    /// If it does not start: this needs root, as the sandbox does.
    #[must_use]
    pub fn start(folder: &Path, bytes: u64, config: &str, log: LogTarget) -> Self {
        Self::start_with_environment(folder, bytes, config, log, Vec::new())
    }

    /// The same for a server with these environment variables.
    ///
    /// # Panics
    /// As [`start`](Self::start).
    #[must_use]
    pub fn start_with_environment(
        folder: &Path,
        bytes: u64,
        config: &str,
        log: LogTarget,
        environment: Vec<(&'static str, String)>,
    ) -> Self {
        let disk = ServerDisk {
            environment,
            ..ServerDisk::mount(folder, bytes, config, log)
        };
        Self {
            server: disk.start_server(),
            data_dir: disk.data_dir(),
            disk,
        }
    }

    /// Kills the server, calls `change`, which may change the disk, and starts a new server on it.
    ///
    /// # Panics
    /// If the new server does not start.
    pub fn kill_and_restart(&mut self, change: impl FnOnce()) {
        self.server.kill_process();
        change();
        self.server = self.disk.start_server();
    }

    /// The log file on the disk, for [`LogTarget::Disk`].
    #[must_use]
    pub fn log_file(&self) -> PathBuf {
        self.data_dir.join("log")
    }

    /// Free space on the disk, in bytes.
    ///
    /// # Panics
    /// If the server has ended.
    #[must_use]
    pub fn free_bytes(&self) -> u64 {
        let disk = statvfs(&self.data_dir).expect("the disk is there");
        disk.f_bavail * disk.f_frsize
    }

    /// Fills the disk to its last page and keeps it full, whatever the server removes, until the guard is dropped.
    ///
    /// # Panics
    /// If the disk does not fill up.
    #[must_use]
    pub fn fill(&self) -> FilledDisk {
        FilledDisk::fill(&self.data_dir)
    }

    /// Fills the disk once, except for about this many bytes, until the guard is dropped.
    ///
    /// # Panics
    /// If less is free.
    #[must_use]
    pub fn fill_except(&self, bytes: u64) -> FilledDisk {
        let file = self.data_dir.join(FILLER);
        let free = self.free_bytes();
        let taken = free
            .checked_sub(bytes)
            .expect("the disk has this much free space");
        let zeros = vec![0; usize::try_from(taken).expect("a small disk")];
        fs::write(&file, zeros).expect("the disk has this much free space");
        FilledDisk {
            file,
            stop: Arc::default(),
            filling: None,
        }
    }

    /// All files below a subfolder of the data folder.
    #[must_use]
    pub fn files(&self, folder: &str) -> Vec<PathBuf> {
        let mut files = Vec::new();
        let mut folders = vec![self.data_dir.join(folder)];
        while let Some(folder) = folders.pop() {
            // The server may have removed the folder meanwhile.
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

/// A guard that keeps a disk full.
#[derive(Debug)]
pub struct FilledDisk {
    file: PathBuf,
    stop: Arc<AtomicBool>,
    filling: Option<JoinHandle<()>>,
}

impl FilledDisk {
    /// Fills the disk of a data folder as [`SmallDisk::fill`] does.
    ///
    /// # Panics
    /// If the disk does not fill up.
    #[must_use]
    pub fn fill(data_dir: &Path) -> Self {
        let file = data_dir.join(FILLER);
        fill(&file);
        let stop = Arc::new(AtomicBool::new(false));
        let filling = thread::spawn({
            let (file, stop) = (file.clone(), Arc::clone(&stop));
            move || {
                while !stop.load(Ordering::Relaxed) {
                    fill(&file);
                    thread::sleep(Duration::from_millis(1));
                }
            }
        });
        Self {
            file,
            stop,
            filling: Some(filling),
        }
    }
}

impl Drop for FilledDisk {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(filling) = self.filling.take() {
            // If it failed, the server has failed, too, and the test reports that.
            let _ = filling.join();
        }
        let _ = fs::remove_file(&self.file);
    }
}

/// Appends to the file until the disk is full.
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
