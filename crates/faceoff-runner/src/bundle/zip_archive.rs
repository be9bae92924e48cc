//! Reads a zip archive, whose *central directory* at its end lists the entries, and writes them into a tree.

use super::{
    budget::{Budget, MeteredReader},
    entry::{invalid, is_named_like_metadata, is_system_file, unusable},
    error::BundleError,
    plan::Plan,
    sink::{EntrySink, FileAttributes},
    tree::Tree,
};
use std::{
    fs::File,
    io::{BufReader, Read, Seek},
};
use zip::{
    CompressionMethod, System, ZipReadOptions,
    read::{Config, ZipFileEntry},
    result::ZipError,
    unstable::read::ZipIterable,
};

/// The file type in a Unix mode.
const KIND_MASK: u32 = 0o170_000;
const KIND_FOLDER: u32 = 0o040_000;
const KIND_FILE: u32 = 0o100_000;
const KIND_LINK: u32 = 0o120_000;

/// Longest target of a symbolic link, in bytes.
const LINK_MAX_BYTES: u64 = 4096;

/// An entry in the central directory.
struct Header {
    name: String,
    mode: u32,
    kind: Kind,
}

#[derive(PartialEq, Eq)]
enum Kind {
    Folder,
    File,
    Link,
}

impl Header {
    fn from_entry(entry: &ZipFileEntry<'_>) -> Result<Self, BundleError> {
        let name = std::str::from_utf8(entry.name_raw())
            .map_err(|_| {
                BundleError::Invalid(format!(
                    "the archive has a name that is not UTF-8: {:?}",
                    String::from_utf8_lossy(entry.name_raw())
                ))
            })?
            .to_owned();
        if name.contains('\\') {
            return Err(invalid(
                &name,
                "is named with a backslash, as Compress-Archive of Windows PowerShell names the files of folders: send the folder \
                 itself (`faceoff submit FOLDER`), or pack it with tar, which Windows has (`tar -czf agent.tar.gz FOLDER`)",
            ));
        }
        if entry.encrypted() {
            return Err(unusable(&name, "encrypted"));
        }
        if !matches!(
            entry.compression(),
            CompressionMethod::Stored | CompressionMethod::Deflated
        ) {
            return Err(unusable(&name, "compressed by another method than deflate"));
        }
        // The library's own conversion hides set-id bits, which must be refused.
        let mode = match (entry.system(), entry.external_attributes() >> 16) {
            (System::Dos, _) | (_, 0) => entry.unix_mode().unwrap_or(0o644),
            (_, mode) => mode,
        };
        let kind = match mode & KIND_MASK {
            KIND_FOLDER => Kind::Folder,
            0 | KIND_FILE if name.ends_with('/') => Kind::Folder,
            0 | KIND_FILE => Kind::File,
            KIND_LINK => Kind::Link,
            _ => return Err(unusable(&name, "a device, pipe or socket")),
        };
        Ok(Self { name, mode, kind })
    }
}

/// Unpacks a zip archive, entry by entry in the order of its central directory. The directory is never held in memory
/// as a whole, and two entries with the same name are both seen. (The library's indexed reader does neither; its
/// iterating reader may change between versions, which the lock file pins.)
///
/// The directory is read twice, so that everything wrong in it is refused before anything is written.
///
/// The read bytes are counted, because entries may overlap: each entry could make the same bytes be decompressed again,
/// without any output.
pub(super) fn unpack<'a>(
    file: BufReader<File>,
    packed_bytes: u64,
    tree: &mut Tree<'a>,
    budget: &'a Budget<'a>,
) -> Result<(), BundleError> {
    // Each byte is needed about once, and those of the directory once more for its check. Finding the directory behind
    // a prefix of the archive is a search. The allowance per entry covers the seeks of both passes.
    budget.allow(3 * packed_bytes);
    let file = MeteredReader::new(file, budget);
    let mut archive = ZipIterable::try_new(file, Config::default()).map_err(damaged_archive)?;
    check_directory(&mut archive, tree.plan_mut(), budget)?;
    tree.reset_plan();
    let mut archive = archive.enforce_header_consistency(true);
    let files = archive.files().map_err(damaged_archive)?;
    while let Some(entry) = files.next() {
        let entry = entry.map_err(damaged_archive)?;
        let Header { name, mode, kind } = Header::from_entry(&entry)?;
        // The metadata of a link is marked as a link, too, and its content is no target.
        let is_metadata_of_link = kind == Kind::Link && is_named_like_metadata(&name);
        if is_system_file(&name) || is_metadata_of_link {
            continue;
        }
        let mut content = entry
            .with_reader(files.reader_mut(), ZipReadOptions::new())
            .map_err(|error| damaged_entry(&name, error))?;
        match kind {
            Kind::Folder => tree.add_folder(&name)?,
            Kind::File => {
                // The times of a zip are those of an unknown time zone.
                let attributes = FileAttributes {
                    mode,
                    modified_s: None,
                };
                tree.add_file(&name, attributes, &mut content)?;
            }
            Kind::Link => {
                let mut target = Vec::new();
                (&mut content)
                    .take(LINK_MAX_BYTES)
                    .read_to_end(&mut target)
                    .map_err(BundleError::from_read_error(&name))?;
                let target = String::from_utf8(target)
                    .map_err(|_| unusable(&name, "a link to a name that is not UTF-8"))?;
                tree.add_link(&name, &target)?;
            }
        }
    }
    Ok(())
}

/// Checks everything that needs no content. Local headers are not read, because they are spread over the archive; the
/// directory is contiguous.
fn check_directory<R: Read + Seek>(
    archive: &mut ZipIterable<R>,
    plan: &mut Plan,
    budget: &Budget<'_>,
) -> Result<(), BundleError> {
    for entry in archive.files().map_err(damaged_archive)? {
        let entry = entry.map_err(damaged_archive)?;
        budget.count_entry()?;
        let Header { name, mode, kind } = Header::from_entry(&entry)?;
        // Of a file that is named like metadata, the content says whether it is left out.
        if is_system_file(&name) || is_named_like_metadata(&name) {
            continue;
        }
        match kind {
            Kind::Folder => plan.add_folder(&name)?,
            Kind::File => {
                plan.add_file(&name, mode)?;
                budget.count_stated(&name, entry.size())?;
            }
            // The target is the content of the entry, which is not read yet.
            Kind::Link => plan.add_link(&name, "")?,
        }
    }
    Ok(())
}

fn damaged_archive(error: ZipError) -> BundleError {
    match error {
        ZipError::Io(error) => BundleError::from_archive_read_error(error),
        error => BundleError::Invalid(format!("the archive is damaged: {error}")),
    }
}

fn damaged_entry(entry: &str, error: ZipError) -> BundleError {
    match error {
        ZipError::Io(error) => BundleError::from_read_error(entry)(error),
        error if entry.is_empty() => damaged_archive(error),
        error => BundleError::Invalid(format!("the archive is damaged at {entry:?}: {error}")),
    }
}
