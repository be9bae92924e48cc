//! Checks and unpacks untrusted archives of a season.

use crate::{
    error::ArchiveError,
    manifest::{Entry, MANIFEST_MAX_BYTES, MANIFEST_NAME, Manifest},
};
use std::{
    cell::Cell,
    collections::BTreeMap,
    fs::{self, File},
    io::{self, BufReader, Read, Write},
    path::Path,
    rc::Rc,
};
use tar::EntryType;

/// The first bytes of a zstd frame.
const ZSTD_MAGIC: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];
/// Maximum window of decompression as a power of 2, in bytes: 128 MiB, which all zstd decompressors support.
const MAX_WINDOW_LOG2: u32 = 27;
/// Maximum ratio of the unpacked to the packed length …
const MAX_EXPANSION_FACTOR: u64 = 200;
/// … plus this many bytes. Results and logs are text, other files are already compressed.
const MAX_EXPANSION_EXTRA_BYTES: u64 = 256 << 20;
/// Maximum length of a file's header and padding.
const ENTRY_OVERHEAD_BYTES: u64 = 1024;
/// Maximum length of the data after the last file: end markers and padding of a whole tar record.
const END_BYTES: u64 = 64 << 10;
/// Length of the buffers through which files are read.
const BUFFER_BYTES: usize = 256 << 10;

/// Reads a whole archive and verifies it against its manifest, without writing files.
///
/// # Errors
/// As [`unpack`].
pub fn check(archive: &Path) -> Result<Manifest, ArchiveError> {
    read(archive, &|_| Ok(()), &|_| Ok(None))
}

/// Unpacks an archive into an empty folder. After an error the content of the folder is invalid.
///
/// # Errors
/// [`ArchiveError::Refused`] if the archive differs from its manifest: another file, a link or device, a path outside of
/// the folder, another length or hash, a missing end; or if it is too large for its packed length or the free disk space.
/// [`ArchiveError::Newer`]; [`ArchiveError::Io`] if the disk fails.
pub fn unpack(archive: &Path, folder: &Path) -> Result<Manifest, ArchiveError> {
    let check_free_space = |manifest: &Manifest| {
        let disk = rustix::fs::statvfs(folder).map_err(io::Error::from)?;
        let free_bytes = disk.f_bavail.saturating_mul(disk.f_frsize);
        let total_bytes = manifest.total_bytes();
        if total_bytes > free_bytes {
            return Err(ArchiveError::Refused(format!(
                "the archive unpacks to {total_bytes} bytes, and {free_bytes} are free in {}: free some space, or choose \
                 a folder on another disk",
                folder.display()
            )));
        }
        Ok(())
    };
    read(archive, &check_free_space, &|entry| {
        // The path has plain parts and no links are created, so it stays within the folder.
        let path = folder.join(&entry.path);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent)?;
        }
        File::create_new(path).map(Some)
    })
}

/// Reads an archive. `check_manifest` may refuse its manifest; `create_file` opens the file to write an entry to, if any.
fn read(
    archive: &Path,
    check_manifest: &dyn Fn(&Manifest) -> Result<(), ArchiveError>,
    create_file: &dyn Fn(&Entry) -> io::Result<Option<File>>,
) -> Result<Manifest, ArchiveError> {
    let mut file = File::open(archive)?;
    let packed_bytes = file.metadata()?.len();
    let mut head = Vec::new();
    (&mut file)
        .take(ZSTD_MAGIC.len() as u64)
        .read_to_end(&mut head)?;
    if head != ZSTD_MAGIC {
        return Err(ArchiveError::Refused(format!(
            "{} is no archive of a season: expected a .tar.zst",
            archive.display()
        )));
    }
    let file = io::Cursor::new(head).chain(file);
    let mut decoder = zstd::Decoder::with_buffer(BufReader::with_capacity(BUFFER_BYTES, file))?;
    decoder.window_log_max(MAX_WINDOW_LOG2)?;
    let remaining_bytes = Rc::new(Cell::new(
        MANIFEST_MAX_BYTES + ENTRY_OVERHEAD_BYTES + END_BYTES,
    ));
    let mut tar = tar::Archive::new(BoundedReader {
        inner: decoder,
        remaining_bytes: Rc::clone(&remaining_bytes),
    });

    let mut manifest: Option<Manifest> = None;
    let mut missing_files: BTreeMap<String, Entry> = BTreeMap::new();
    // `raw` lists extensions of the tar format as entries, so that they are refused below.
    for entry in tar.entries()?.raw(true) {
        let mut entry = entry.map_err(read_error)?;
        let path = String::from_utf8_lossy(&entry.path_bytes()).into_owned();
        let printed_path: String = path.chars().take(200).collect();
        let kind = entry.header().entry_type();
        if kind != EntryType::Regular {
            return Err(ArchiveError::Refused(format!(
                "the archive's entry {printed_path:?} is {}: a season's archive contains only files",
                kind_label(kind)
            )));
        }
        if manifest.is_none() {
            let parsed = read_manifest(&mut entry, &path)?;
            let total_bytes = parsed.total_bytes();
            let max_bytes = packed_bytes
                .saturating_mul(MAX_EXPANSION_FACTOR)
                .saturating_add(MAX_EXPANSION_EXTRA_BYTES);
            if total_bytes > max_bytes {
                return Err(ArchiveError::Refused(format!(
                    "{MANIFEST_NAME} names files with {total_bytes} bytes, too many for an archive of {packed_bytes} \
                     bytes: at most {max_bytes} are allowed"
                )));
            }
            check_manifest(&parsed)?;
            let overhead = ENTRY_OVERHEAD_BYTES.saturating_mul(parsed.files.len() as u64);
            remaining_bytes.set(
                total_bytes
                    .saturating_add(overhead)
                    .saturating_add(END_BYTES),
            );
            missing_files = parsed
                .files
                .iter()
                .map(|file| (file.path.clone(), file.clone()))
                .collect();
            manifest = Some(parsed);
            continue;
        }
        let Some(expected) = missing_files.remove(&path) else {
            return Err(ArchiveError::Refused(format!(
                "the archive contains {printed_path:?}, which {MANIFEST_NAME} does not name, or contains it twice"
            )));
        };
        copy_verified(&mut entry, &expected, create_file(&expected)?)?;
    }
    let Some(manifest) = manifest else {
        return Err(ArchiveError::Refused(format!(
            "the archive is empty: expected {MANIFEST_NAME} and the files that it names"
        )));
    };
    if let Some(path) = missing_files.keys().next() {
        return Err(ArchiveError::Refused(format!(
            "the archive ends before {} of its files, {path:?} among them: it is truncated, copy or create it again",
            missing_files.len()
        )));
    }
    // Read to the end, where the checksum of the zstd frame is.
    io::copy(&mut tar.into_inner(), &mut io::sink()).map_err(read_error)?;
    Ok(manifest)
}

/// Reads the manifest from the first entry.
fn read_manifest(
    entry: &mut tar::Entry<'_, impl Read>,
    path: &str,
) -> Result<Manifest, ArchiveError> {
    if path != MANIFEST_NAME {
        let printed_path: String = path.chars().take(200).collect();
        return Err(ArchiveError::Refused(format!(
            "the archive begins with {printed_path:?}: expected {MANIFEST_NAME}"
        )));
    }
    if entry.size() > MANIFEST_MAX_BYTES {
        return Err(ArchiveError::Refused(format!(
            "{MANIFEST_NAME} has {} bytes; at most {MANIFEST_MAX_BYTES} are allowed",
            entry.size()
        )));
    }
    let mut json = Vec::new();
    entry.read_to_end(&mut json).map_err(read_error)?;
    Manifest::parse(&json)
}

/// Copies an entry to `target`, if there is one, and verifies its length and hash.
fn copy_verified(
    entry: &mut tar::Entry<'_, impl Read>,
    expected: &Entry,
    mut target: Option<File>,
) -> Result<(), ArchiveError> {
    if entry.size() != expected.bytes {
        return Err(ArchiveError::Refused(format!(
            "{} has {} bytes in the archive, but {} in {MANIFEST_NAME}",
            expected.path,
            entry.size(),
            expected.bytes
        )));
    }
    let mut hasher = blake3::Hasher::new();
    let mut buffer = vec![0; BUFFER_BYTES];
    loop {
        let read = entry.read(&mut buffer).map_err(read_error)?;
        if read == 0 {
            break;
        }
        hasher.update(&buffer[..read]);
        if let Some(target) = &mut target {
            target.write_all(&buffer[..read])?;
        }
    }
    let hash = hasher.finalize().to_string();
    if hash != expected.blake3.to_lowercase() {
        return Err(ArchiveError::Refused(format!(
            "{} has the hash {hash}, but {} in {MANIFEST_NAME}; the archive is damaged or was changed",
            expected.path, expected.blake3
        )));
    }
    if let Some(target) = target {
        target.sync_all()?;
    }
    Ok(())
}

fn kind_label(kind: EntryType) -> &'static str {
    match kind {
        EntryType::Symlink | EntryType::Link => "a link",
        EntryType::Directory => "a folder",
        EntryType::Char | EntryType::Block => "a device",
        EntryType::Fifo => "a named pipe",
        EntryType::GNUSparse => "a sparse file",
        _ => "of an unknown kind",
    }
}

/// An error while reading is attributed to the archive, not to the disk.
fn read_error(error: io::Error) -> ArchiveError {
    ArchiveError::Refused(format!(
        "the archive cannot be read to its end: {error}. It is truncated or damaged: copy or create it again"
    ))
}

/// Reads at most `remaining_bytes`, then fails if there are more.
struct BoundedReader<R> {
    inner: R,
    /// Shared with [`read`], which sets it to the total of the files once the manifest is known.
    remaining_bytes: Rc<Cell<u64>>,
}

impl<R: Read> Read for BoundedReader<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let remaining = self.remaining_bytes.get();
        if remaining == 0 && !buffer.is_empty() {
            return match self.inner.read(&mut [0])? {
                0 => Ok(0),
                _ => Err(io::Error::other("it is longer than its manifest says")),
            };
        }
        let max = usize::try_from(remaining)
            .map_or(buffer.len(), |remaining| remaining.min(buffer.len()));
        let read = self.inner.read(&mut buffer[..max])?;
        self.remaining_bytes.set(remaining - read as u64);
        Ok(read)
    }
}
