//! Reading an archive that a stranger may have made.

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
const MAGIC: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];
/// How much memory unpacking may take: 2 to this power. It is what every decompressor allows.
const WINDOW_LOG: u32 = 27;
/// How many times its own length an archive may unpack to …
const EXPANSION: u64 = 200;
/// … and how many bytes more. Results and logs are text, the rest is compressed already.
const EXPANSION_EXTRA_BYTES: u64 = 256 << 20;
/// Of each file, beside its content: its header and its padding.
const BESIDE_BYTES: u64 = 1024;
/// Behind the last file: the marks of the end, and the padding of a whole tar record.
const END_BYTES: u64 = 64 << 10;
const PIECE_BYTES: usize = 256 << 10;

/// Reads all of an archive and holds it against its manifest, writing nothing.
///
/// # Errors
/// As [`unpack`].
pub fn check(archive: &Path) -> Result<Manifest, ArchiveError> {
    read(archive, &|_| Ok(()), &|_| Ok(None))
}

/// Unpacks an archive into the empty folder `into`, where what is left after an error is worth nothing.
///
/// # Errors
/// [`ArchiveError::Refused`] for all that is not as its manifest says: another file, a link or a device, a path that
/// leads elsewhere, another length or hash, a missing end, more than its length explains or than there is room for;
/// [`ArchiveError::Newer`]; [`ArchiveError::Io`] if the disk fails.
pub fn unpack(archive: &Path, into: &Path) -> Result<Manifest, ArchiveError> {
    let fits = |manifest: &Manifest| {
        let disk = rustix::fs::statvfs(into).map_err(io::Error::from)?;
        let free_bytes = disk.f_bavail.saturating_mul(disk.f_frsize);
        let total_bytes = manifest.total_bytes();
        if total_bytes > free_bytes {
            return Err(ArchiveError::Refused(format!(
                "the archive unpacks to {total_bytes} bytes, and {free_bytes} are free in {}: make room, or choose \
                 a folder on another disk",
                into.display()
            )));
        }
        Ok(())
    };
    read(archive, &fits, &|entry| {
        // Of plain parts, and nothing here makes a link: it stays inside.
        let place = into.join(&entry.path);
        if let Some(folder) = place.parent() {
            fs::create_dir_all(folder)?;
        }
        File::create_new(place).map(Some)
    })
}

fn read(
    archive: &Path,
    accept: &dyn Fn(&Manifest) -> Result<(), ArchiveError>,
    place: &dyn Fn(&Entry) -> io::Result<Option<File>>,
) -> Result<Manifest, ArchiveError> {
    let mut file = File::open(archive)?;
    let packed_bytes = file.metadata()?.len();
    let mut head = Vec::new();
    (&mut file)
        .take(MAGIC.len() as u64)
        .read_to_end(&mut head)?;
    if head != MAGIC {
        return Err(ArchiveError::Refused(format!(
            "{} is no archive of a season: expected a .tar.zst",
            archive.display()
        )));
    }
    let file = io::Cursor::new(head).chain(file);
    let mut decoder = zstd::Decoder::with_buffer(BufReader::with_capacity(PIECE_BYTES, file))?;
    decoder.window_log_max(WINDOW_LOG)?;
    let allowed = Rc::new(Cell::new(MANIFEST_MAX_BYTES + BESIDE_BYTES + END_BYTES));
    let mut tar = tar::Archive::new(Bounded {
        inner: decoder,
        left: Rc::clone(&allowed),
    });

    let mut found: Option<Manifest> = None;
    let mut missing: BTreeMap<String, Entry> = BTreeMap::new();
    // Raw: extensions of the format are entries like others, and refused with them.
    for entry in tar.entries()?.raw(true) {
        let mut entry = entry.map_err(broken)?;
        let path = String::from_utf8_lossy(&entry.path_bytes()).into_owned();
        let shown: String = path.chars().take(200).collect();
        let kind = entry.header().entry_type();
        if kind != EntryType::Regular {
            return Err(ArchiveError::Refused(format!(
                "the archive's entry {shown:?} is {}: a season's archive holds files only",
                named(kind)
            )));
        }
        if found.is_none() {
            let manifest = first(&mut entry, &path)?;
            let total_bytes = manifest.total_bytes();
            let most = packed_bytes
                .saturating_mul(EXPANSION)
                .saturating_add(EXPANSION_EXTRA_BYTES);
            if total_bytes > most {
                return Err(ArchiveError::Refused(format!(
                    "{MANIFEST_NAME} tells of {total_bytes} bytes, which an archive of {packed_bytes} bytes does not \
                     explain: at most {most} are allowed"
                )));
            }
            accept(&manifest)?;
            let beside = BESIDE_BYTES.saturating_mul(manifest.files.len() as u64);
            allowed.set(total_bytes.saturating_add(beside).saturating_add(END_BYTES));
            missing = manifest
                .files
                .iter()
                .map(|file| (file.path.clone(), file.clone()))
                .collect();
            found = Some(manifest);
            continue;
        }
        let Some(wanted) = missing.remove(&path) else {
            return Err(ArchiveError::Refused(format!(
                "the archive holds {shown:?}, which {MANIFEST_NAME} does not name, or a second time"
            )));
        };
        take(&mut entry, &wanted, place(&wanted)?)?;
    }
    let Some(manifest) = found else {
        return Err(ArchiveError::Refused(format!(
            "the archive is empty: expected {MANIFEST_NAME} and the files that it names"
        )));
    };
    if let Some(path) = missing.keys().next() {
        return Err(ArchiveError::Refused(format!(
            "the archive ends before {} of its files, {path:?} among them: it was cut off, copy or make it again",
            missing.len()
        )));
    }
    // The last bytes hold the sum of all.
    io::copy(&mut tar.into_inner(), &mut io::sink()).map_err(broken)?;
    Ok(manifest)
}

/// The manifest, which comes first.
fn first(entry: &mut tar::Entry<'_, impl Read>, path: &str) -> Result<Manifest, ArchiveError> {
    if path != MANIFEST_NAME {
        let shown: String = path.chars().take(200).collect();
        return Err(ArchiveError::Refused(format!(
            "the archive begins with {shown:?}: expected {MANIFEST_NAME}"
        )));
    }
    if entry.size() > MANIFEST_MAX_BYTES {
        return Err(ArchiveError::Refused(format!(
            "{MANIFEST_NAME} has {} bytes; at most {MANIFEST_MAX_BYTES} are allowed",
            entry.size()
        )));
    }
    let mut json = Vec::new();
    entry.read_to_end(&mut json).map_err(broken)?;
    Manifest::parse(&json)
}

/// Copies a file to its place, if it has one, and holds it against what is said of it.
fn take(
    entry: &mut tar::Entry<'_, impl Read>,
    wanted: &Entry,
    mut target: Option<File>,
) -> Result<(), ArchiveError> {
    if entry.size() != wanted.bytes {
        return Err(ArchiveError::Refused(format!(
            "{} has {} bytes in the archive: {MANIFEST_NAME} tells of {}",
            wanted.path,
            entry.size(),
            wanted.bytes
        )));
    }
    let mut hasher = blake3::Hasher::new();
    let mut piece = vec![0; PIECE_BYTES];
    loop {
        let read = entry.read(&mut piece).map_err(broken)?;
        if read == 0 {
            break;
        }
        hasher.update(&piece[..read]);
        if let Some(target) = &mut target {
            target.write_all(&piece[..read])?;
        }
    }
    let hash = hasher.finalize().to_string();
    if hash != wanted.blake3.to_lowercase() {
        return Err(ArchiveError::Refused(format!(
            "{} has the hash {hash}: {MANIFEST_NAME} tells of {}; the archive is damaged or was changed",
            wanted.path, wanted.blake3
        )));
    }
    if let Some(target) = target {
        target.sync_all()?;
    }
    Ok(())
}

fn named(kind: EntryType) -> &'static str {
    match kind {
        EntryType::Symlink | EntryType::Link => "a link",
        EntryType::Directory => "a folder",
        EntryType::Char | EntryType::Block => "a device",
        EntryType::Fifo => "a named pipe",
        EntryType::GNUSparse => "a sparse file",
        _ => "of an unknown kind",
    }
}

/// What goes wrong while reading is the archive's, as far as can be told.
fn broken(error: io::Error) -> ArchiveError {
    ArchiveError::Refused(format!(
        "the archive cannot be read to its end: {error}. It was cut off or is damaged: copy or make it again"
    ))
}

/// Gives up to so many bytes, then an error.
struct Bounded<R> {
    inner: R,
    left: Rc<Cell<u64>>,
}

impl<R: Read> Read for Bounded<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let left = self.left.get();
        if left == 0 && !buffer.is_empty() {
            return match self.inner.read(&mut [0])? {
                0 => Ok(0),
                _ => Err(io::Error::other("it is longer than its manifest tells")),
            };
        }
        let most = usize::try_from(left).map_or(buffer.len(), |left| left.min(buffer.len()));
        let read = self.inner.read(&mut buffer[..most])?;
        self.left.set(left - read as u64);
        Ok(read)
    }
}
