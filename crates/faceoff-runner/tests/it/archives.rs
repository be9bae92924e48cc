//! Builders of archives (tar, zip) as teams and attackers make them.

use flate2::{Compression, write::GzEncoder};
use std::{
    fs,
    io::{Cursor, Write},
    path::{Path, PathBuf},
};
use tar::{EntryType, Header};
use zip::{ZipWriter, write::SimpleFileOptions};

/// A valid `agent.toml`.
pub const MANIFEST: &str =
    "name = \"test\"\ncommand = [\"python3\", \"agent.py\"]\nruntime = \"python3\"\n";

/// Time of change of all entries, in seconds since 1970: 2009-02-13.
pub const MODIFIED_S: u64 = 1_234_567_890;

/// Builder of a tar archive; writes names and modes unchanged.
#[derive(Clone)]
pub struct Tar(Vec<u8>);

impl Tar {
    pub fn new() -> Self {
        Self(Vec::new())
    }

    /// An archive with an `agent.toml` at its root.
    pub fn with_manifest() -> Self {
        Self::new().file("agent.toml", 0o644, MANIFEST.as_bytes())
    }

    /// Adds an entry of any kind; `link` is the target of a link.
    pub fn entry(
        mut self,
        kind: EntryType,
        name: &str,
        mode: u32,
        link: &str,
        content: &[u8],
    ) -> Self {
        let mut header = Header::new_gnu();
        let field = |field: &mut [u8], text: &str| {
            field[..text.len()].copy_from_slice(text.as_bytes());
        };
        let gnu = header.as_gnu_mut().unwrap();
        field(&mut gnu.name, name);
        field(&mut gnu.linkname, link);
        header.set_entry_type(kind);
        header.set_mode(mode);
        header.set_uid(0);
        header.set_gid(0);
        header.set_mtime(MODIFIED_S);
        header.set_size(content.len() as u64);
        header.set_cksum();
        self.0.extend_from_slice(header.as_bytes());
        self.0.extend_from_slice(content);
        self.0.resize(self.0.len().next_multiple_of(512), 0);
        self
    }

    pub fn file(self, name: &str, mode: u32, content: &[u8]) -> Self {
        self.entry(EntryType::Regular, name, mode, "", content)
    }

    pub fn folder(self, name: &str) -> Self {
        self.entry(EntryType::Directory, name, 0o755, "", b"")
    }

    pub fn symlink(self, name: &str, target: &str) -> Self {
        self.entry(EntryType::Symlink, name, 0o777, target, b"")
    }

    /// The finished archive, uncompressed.
    pub fn bytes(mut self) -> Vec<u8> {
        self.0.extend_from_slice(&[0; 1024]);
        self.0
    }

    pub fn gz(self) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(&self.bytes()).unwrap();
        encoder.finish().unwrap()
    }

    pub fn zst(self) -> Vec<u8> {
        zstd::encode_all(Cursor::new(self.bytes()), 1).unwrap()
    }
}

/// A zip archive of files with modes.
pub fn zip(entries: &[(&str, u32, &[u8])]) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, mode, content) in entries {
        let options = SimpleFileOptions::default().unix_permissions(*mode);
        match name.strip_suffix('/') {
            Some(folder) => zip.add_directory(folder, options).unwrap(),
            None => {
                zip.start_file(*name, options).unwrap();
                zip.write_all(content).unwrap();
            }
        }
    }
    zip.finish().unwrap().into_inner()
}

/// Writes bytes to a file of `dir`.
pub fn write(dir: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = dir.join(name);
    fs::write(&path, bytes).unwrap();
    path
}
