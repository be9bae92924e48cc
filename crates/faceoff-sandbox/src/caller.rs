//! The agent's thread whose system call this process answers in place of the kernel: its memory, its process, its files and its network.
//!
//! A thread may be killed while its call is answered, and its number given to another. So each function first opens what it needs by the
//! number, and then asks the listener whether the call still waits.

use crate::call_listener::check_waiting;
use rustix::{
    io::Errno,
    process::{Pid, PidfdFlags, PidfdGetfdFlags, pidfd_getfd, pidfd_open},
};
use std::{
    fs::{self, File},
    io,
    os::{
        fd::{BorrowedFd, OwnedFd},
        unix::fs::{FileExt, MetadataExt},
    },
    path::PathBuf,
};

/// A thread of an agent, which waits for the answer to its call.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Caller<'a> {
    pub listener: BorrowedFd<'a>,
    /// Number of the call.
    pub id: u64,
    /// Number of the thread on the host.
    pub host_thread: u32,
}

impl Caller<'_> {
    /// Writes into the memory of the thread.
    pub(crate) fn write(self, address: u64, bytes: &[u8]) -> io::Result<()> {
        let memory = File::options().write(true).open(self.path("mem"))?;
        check_waiting(self.listener, self.id)?;
        memory.write_all_at(bytes, address)
    }

    /// Reads the memory of the thread.
    pub(crate) fn read(self, address: u64, bytes: &mut [u8]) -> io::Result<()> {
        let memory = File::open(self.path("mem"))?;
        check_waiting(self.listener, self.id)?;
        memory.read_exact_at(bytes, address)
    }

    /// Is the open file that the agent names `number` a regular file or a folder on one of these file systems?
    pub(crate) fn is_file_on(self, number: i32, file_systems: &[u64]) -> io::Result<bool> {
        let found = match fs::metadata(self.path(&format!("fd/{number}"))) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                return Err(Errno::BADF.into());
            }
            found => found?,
        };
        Ok((found.is_file() || found.is_dir()) && file_systems.contains(&found.dev()))
    }

    /// A further descriptor of the open file that the agent names `number`.
    pub(crate) fn file(self, number: i32) -> io::Result<OwnedFd> {
        let process = self.pidfd()?;
        check_waiting(self.listener, self.id)?;
        Ok(pidfd_getfd(&process, number, PidfdGetfdFlags::empty())?)
    }

    /// A descriptor of the thread (Linux 6.9), or of its process, whose first thread may have ended.
    fn pidfd(self) -> io::Result<OwnedFd> {
        const THREAD: PidfdFlags = PidfdFlags::from_bits_retain(libc::PIDFD_THREAD);
        if let Some(thread) = Pid::from_raw(self.host_thread.cast_signed())
            && let Ok(found) = pidfd_open(thread, THREAD)
        {
            return Ok(found);
        }
        let status = fs::read_to_string(self.path("status"))?;
        let process = number_after(&status, "Tgid:").and_then(Pid::from_raw);
        let process = process.ok_or(io::ErrorKind::NotFound)?;
        Ok(pidfd_open(process, PidfdFlags::empty())?)
    }

    /// The number of the file system of a folder, as the agent sees it.
    pub(crate) fn device_of_folder(self, folder: &str) -> io::Result<u64> {
        let found = fs::metadata(self.path("root").join(folder.trim_start_matches('/')))?;
        check_waiting(self.listener, self.id)?;
        Ok(found.dev())
    }

    /// The number of open sockets in the agent's network.
    pub(crate) fn socket_count(self) -> io::Result<i32> {
        let text = fs::read_to_string(self.path("net/sockstat"))?;
        check_waiting(self.listener, self.id)?;
        number_after(&text, "sockets: used").ok_or_else(|| io::ErrorKind::InvalidData.into())
    }

    /// The host's number of the thread that the agent names `number`, 0 for itself: one of its own process, or the first one of another
    /// process of the agent.
    pub(crate) fn thread(self, number: i32) -> io::Result<Option<Pid>> {
        if number == 0 {
            check_waiting(self.listener, self.id)?;
            return Ok(Pid::from_raw(self.host_thread.cast_signed()));
        }
        let own_namespace = fs::read_link(self.path("ns/pid"))?;
        let own_threads = numbered_entries(self.path("task"))?;
        check_waiting(self.listener, self.id)?;
        let is_wanted = |pid: &i32| {
            let folder = PathBuf::from(format!("/proc/{pid}"));
            fs::read_to_string(folder.join("status"))
                .is_ok_and(|status| last_number_after(&status, "NSpid:") == Some(number))
                && fs::read_link(folder.join("ns/pid")).is_ok_and(|found| found == own_namespace)
        };
        let found = match own_threads.into_iter().find(is_wanted) {
            Some(thread) => Some(thread),
            None => numbered_entries("/proc".into())?
                .into_iter()
                .find(is_wanted),
        };
        Ok(found.and_then(Pid::from_raw))
    }

    /// Opens a file of the thread's folder in `/proc`.
    pub(crate) fn open(self, name: &str) -> io::Result<File> {
        let file = File::open(self.path(name))?;
        check_waiting(self.listener, self.id)?;
        Ok(file)
    }

    fn path(self, name: &str) -> PathBuf {
        PathBuf::from(format!("/proc/{}/{name}", self.host_thread))
    }
}

/// The numbers among the names of a folder.
fn numbered_entries(folder: PathBuf) -> io::Result<Vec<i32>> {
    let entries = fs::read_dir(folder)?.flatten();
    Ok(entries
        .filter_map(|entry| entry.file_name().to_str()?.parse().ok())
        .collect())
}

/// The first number of the line that starts with `name`.
fn number_after(text: &str, name: &str) -> Option<i32> {
    let rest = text.lines().find_map(|line| line.strip_prefix(name))?;
    rest.split_whitespace().next()?.parse().ok()
}

/// The last number of the line that starts with `name`.
fn last_number_after(text: &str, name: &str) -> Option<i32> {
    let rest = text.lines().find_map(|line| line.strip_prefix(name))?;
    rest.split_whitespace().last()?.parse().ok()
}
