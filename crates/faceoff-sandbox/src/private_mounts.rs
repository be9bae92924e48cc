//! Shows files to an agent's user that it could not reach by name.
//!
//! A root service keeps bundles in a folder of its own, and bubblewrap, which runs as the agent's user,
//! looks its sources up by name. So the child, while it is still root, binds them below `/tmp` of a
//! mount namespace of its own, where nobody else sees them and whose end is theirs.

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

/// Any folder that every host has; the namespace's own, so nothing of the host's is hidden from anybody.
const FOLDER: &CStr = c"/tmp";

/// What one agent's bubblewrap is to find.
#[derive(Debug, Default)]
pub(crate) struct PrivateMounts {
    sources: Vec<Source>,
}

#[derive(Debug)]
struct Source {
    path: CString,
    place: CString,
    is_folder: bool,
    /// In the child: the file or folder, on its way from the one to the other.
    tree: Option<OwnedFd>,
}

impl PrivateMounts {
    /// Adds `path` and returns the name under which bubblewrap will find it.
    pub(crate) fn add(&mut self, path: &Path) -> Result<OsString, SandboxError> {
        let failure = format!("cannot show {} to the agent", path.display());
        let path = fs::canonicalize(path).context(&failure)?;
        let place = format!("/tmp/{}", self.sources.len());
        let text = |bytes: &[u8]| {
            CString::new(bytes)
                .map_err(io::Error::other)
                .context(&failure)
        };
        self.sources.push(Source {
            path: text(path.as_os_str().as_bytes())?,
            place: text(place.as_bytes())?,
            is_folder: fs::metadata(&path).context(&failure)?.is_dir(),
            tree: None,
        });
        Ok(place.into())
    }

    /// Makes the mounts. Called between fork and exec, as root: system calls only.
    pub(crate) fn make(&mut self) -> Result<(), Errno> {
        #[expect(
            unsafe_code,
            reason = "rustix marks all unsharing unsafe for the sake of shared descriptors"
        )]
        // SAFETY: the flag leaves the table of descriptors alone; this process has one thread.
        unsafe {
            unshare_unsafe(UnshareFlags::NEWNS)?;
        }
        // Nothing that is mounted from here on reaches the host.
        mount_change(
            c"/",
            MountPropagationFlags::DOWNSTREAM | MountPropagationFlags::REC,
        )?;
        // All are taken before the folder is covered, for some may be in it.
        let take = OpenTreeFlags::OPEN_TREE_CLONE
            | OpenTreeFlags::OPEN_TREE_CLOEXEC
            | OpenTreeFlags::AT_RECURSIVE;
        for source in &mut self.sources {
            source.tree = Some(open_tree(CWD, &source.path, take)?);
        }
        let flags = MountFlags::NOSUID | MountFlags::NODEV;
        mount(c"tmpfs", FOLDER, c"tmpfs", flags, c"mode=0755,size=64k")?;
        for source in &mut self.sources {
            if source.is_folder {
                mkdir(&source.place, Mode::from_raw_mode(0o755))?;
            } else {
                let make = OFlags::CREATE | OFlags::WRONLY | OFlags::CLOEXEC;
                drop(open(&source.place, make, Mode::from_raw_mode(0o644))?);
            }
            if let Some(tree) = source.tree.take() {
                move_mount(
                    tree,
                    c"",
                    CWD,
                    &source.place,
                    MoveMountFlags::MOVE_MOUNT_F_EMPTY_PATH,
                )?;
            }
        }
        Ok(())
    }
}
