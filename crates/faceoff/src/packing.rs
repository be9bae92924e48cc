//! A bundle's folder as an archive: what goes in and what does not, the same bytes of the same files whenever and
//! wherever it is packed. `submit` sends it, `eval` and `play` unpack it as the server would.

mod bundle_file;
mod rules;
mod selection;
mod whole;

pub use bundle_file::BundleFile;
pub use rules::IGNORE_FILE;
pub use selection::{Kind, Selection};
use whole::Whole;

use anyhow::Context;
use flate2::{Compression, GzBuilder};
use std::{
    fs::File,
    io::{self, BufWriter, Write},
    path::Path,
};

/// A file as large as this is worth a word: a model may be, a recording or a core dump has slipped in.
pub const LARGE_BYTES: u64 = 20_000_000;

impl Selection {
    /// Writes the archive, a `.tar.gz`.
    ///
    /// # Errors
    /// If a file cannot be read, or has another size than when it was looked at.
    pub fn pack(&self, to: File) -> anyhow::Result<()> {
        // No name and no time in its header.
        let gzip = GzBuilder::new().write(BufWriter::new(to), Compression::default());
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
        kind: &Kind,
    ) -> io::Result<()> {
        let mut header = tar::Header::new_gnu();
        // When, by whom and where it was made is left out.
        header.set_mtime(0);
        header.set_uid(0);
        header.set_gid(0);
        match kind {
            Kind::Folder => {
                header.set_entry_type(tar::EntryType::Directory);
                header.set_mode(0o755);
                header.set_size(0);
                archive.append_data(&mut header, path, io::empty())
            }
            Kind::File {
                bytes, executable, ..
            } => {
                header.set_mode(if *executable { 0o755 } else { 0o644 });
                header.set_size(*bytes);
                let file = File::open(self.folder().join(path))?;
                let found = file.metadata()?.len();
                if found != *bytes {
                    return Err(io::Error::other(format!(
                        "it had {bytes} bytes a moment ago and has {found} now; is something still writing it?"
                    )));
                }
                archive.append_data(&mut header, path, Whole::of(file, *bytes))
            }
            // As a link: following it could pick up files from outside of the folder.
            Kind::Link { target } => {
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
