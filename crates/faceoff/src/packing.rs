//! Packs the folder of a *bundle*, the files of an agent, into an archive. The same files always give the same bytes. `submit`
//! uploads the archive, `eval` and `play` unpack it like the server.

mod bundle_file;
mod rules;
mod selection;
mod sized_reader;
pub use bundle_file::BundleFile;
pub use rules::IGNORE_FILE;
pub use selection::{EntryKind, Selection};
use sized_reader::SizedReader;

use anyhow::Context;
use flate2::{Compression, GzBuilder};
use std::{
    fs::File,
    io::{self, BufWriter, Write},
    path::Path,
};

/// Packed files of at least this size are listed for the user. One may be a model, but also a recording or core dump by mistake.
pub const LARGE_BYTES: u64 = 20_000_000;

impl Selection {
    /// Writes the archive, a `.tar.gz`.
    ///
    /// # Errors
    /// If a file cannot be read, or its size has changed since the selection.
    pub fn pack(&self, target: File) -> anyhow::Result<()> {
        // The header contains no name and no time.
        let gzip = GzBuilder::new().write(BufWriter::new(target), Compression::default());
        let mut archive = tar::Builder::new(gzip);
        for entry in self.entries() {
            self.append(&mut archive, &entry.path, &entry.kind)
                .with_context(|| format!("packing {}", entry.path.display()))?;
        }
        let writer = archive
            .into_inner()
            .and_then(flate2::write::GzEncoder::finish);
        let writer = writer.context("packing")?;
        writer
            .into_inner()
            .map_err(io::IntoInnerError::into_error)
            .context("packing")?;
        Ok(())
    }

    fn append<W: Write>(
        &self,
        archive: &mut tar::Builder<W>,
        path: &Path,
        kind: &EntryKind,
    ) -> io::Result<()> {
        let mut header = tar::Header::new_gnu();
        // Time and owner are left out, so that the archive only depends on the files.
        header.set_mtime(0);
        header.set_uid(0);
        header.set_gid(0);
        match kind {
            EntryKind::Folder => {
                header.set_entry_type(tar::EntryType::Directory);
                header.set_mode(0o755);
                header.set_size(0);
                archive.append_data(&mut header, path, io::empty())
            }
            EntryKind::File {
                bytes, executable, ..
            } => {
                header.set_mode(if *executable { 0o755 } else { 0o644 });
                header.set_size(*bytes);
                let file = File::open(self.folder().join(path))?;
                let current_bytes = file.metadata()?.len();
                if current_bytes != *bytes {
                    return Err(io::Error::other(format!(
                        "its size changed from {bytes} to {current_bytes} bytes; is another program still writing it?"
                    )));
                }
                archive.append_data(&mut header, path, SizedReader::new(file, *bytes))
            }
            // The link itself is packed, because its target could be outside of the folder.
            EntryKind::Link { target } => {
                header.set_entry_type(tar::EntryType::Symlink);
                header.set_mode(0o777);
                header.set_size(0);
                archive.append_link(&mut header, path, target)
            }
        }
    }
}

#[cfg(test)]
mod tests;
