//! Makes files reachable for an agent's user that cannot reach them by path.
//!
//! A root service keeps bundles in a folder closed to other users. bubblewrap runs as the agent's user and
//! looks its sources up by path. So the child, while it is still root, bind-mounts them below `/tmp` of a
//! private mount namespace. No other process sees these mounts, and they end with the namespace.

use crate::{SandboxError, error::IoContext};
use rustix::{
    fs::{CWD, Mode, OFlags, mkdir, open},
    io::Errno,
    mount::{
        MountFlags, MountPropagationFlags, MoveMountFlags, OpenTreeFlags, mount, mount_change,
        move_mount, open_tree,
    },
    thread::{UnshareFlags, unshare_unsafe},
};
use std::{
    ffi::{CStr, CString, OsString},
    fs, io,
    os::{fd::OwnedFd, unix::ffi::OsStrExt},
    path::Path,
};

/// The folder over which the mounts' file system is mounted. Every host has it, and only the private namespace sees the change.
const MOUNT_FOLDER: &CStr = c"/tmp";

/// The bind mounts for one agent's bubblewrap.
#[derive(Debug, Default)]
pub(crate) struct PrivateMounts {
    sources: Vec<Source>,
}

#[derive(Debug)]
struct Source {
    path: CString,
    mount_point: CString,
    is_folder: bool,
    /// In the child: the detached mount of `path`, until it is moved to `mount_point`.
    tree: Option<OwnedFd>,
}

impl PrivateMounts {
    /// Adds `path` and returns the path at which bubblewrap will find it.
    pub(crate) fn add(&mut self, path: &Path) -> Result<OsString, SandboxError> {
        let failure = format!("cannot show {} to the agent", path.display());
        let path = fs::canonicalize(path).context(&failure)?;
        let mount_point = format!("/tmp/{}", self.sources.len());
        let text = |bytes: &[u8]| {
            CString::new(bytes)
                .map_err(io::Error::other)
                .context(&failure)
        };
        self.sources.push(Source {
            path: text(path.as_os_str().as_bytes())?,
            mount_point: text(mount_point.as_bytes())?,
            is_folder: fs::metadata(&path).context(&failure)?.is_dir(),
            tree: None,
        });
        Ok(mount_point.into())
    }

    /// Makes all mounts. It is called between fork and exec, as root, and makes system calls only.
    pub(crate) fn mount_all(&mut self) -> Result<(), Errno> {
        #[expect(
            unsafe_code,
            reason = "rustix marks all unsharing unsafe, since some flags affect shared file descriptors"
        )]
        // SAFETY: NEWNS does not affect the table of file descriptors, and this process has one thread.
        unsafe {
            unshare_unsafe(UnshareFlags::NEWNS)?;
        }
        // Mounts made from here on do not propagate to the host.
        mount_change(
            c"/",
            MountPropagationFlags::DOWNSTREAM | MountPropagationFlags::REC,
        )?;
        // Detach all sources before the folder is covered, since some may be inside it.
        let clone_flags = OpenTreeFlags::OPEN_TREE_CLONE
            | OpenTreeFlags::OPEN_TREE_CLOEXEC
            | OpenTreeFlags::AT_RECURSIVE;
        for source in &mut self.sources {
            source.tree = Some(open_tree(CWD, &source.path, clone_flags)?);
        }
        let flags = MountFlags::NOSUID | MountFlags::NODEV;
        mount(
            c"tmpfs",
            MOUNT_FOLDER,
            c"tmpfs",
            flags,
            c"mode=0755,size=64k",
        )?;
        for source in &mut self.sources {
            if source.is_folder {
                mkdir(&source.mount_point, Mode::from_raw_mode(0o755))?;
            } else {
                let create_flags = OFlags::CREATE | OFlags::WRONLY | OFlags::CLOEXEC;
                drop(open(
                    &source.mount_point,
                    create_flags,
                    Mode::from_raw_mode(0o644),
                )?);
            }
            if let Some(tree) = source.tree.take() {
                move_mount(
                    tree,
                    c"",
                    CWD,
                    &source.mount_point,
                    MoveMountFlags::MOVE_MOUNT_F_EMPTY_PATH,
                )?;
            }
        }
        Ok(())
    }
}
