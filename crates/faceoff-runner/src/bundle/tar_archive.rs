//! Reads a tar archive and passes its entries to a sink.

use super::{
    budget::{Budget, MeteredReader},
    entry::unusable,
    error::BundleError,
    sink::{EntrySink, FileAttributes, Special},
};
use std::io::{self, Read};
use tar::{Archive, EntryType, Header};

/// Longest *extension header*: one that only describes the next entry (long names, extended attributes). Headers are
/// held in memory, and no ordinary bundle has a longer one.
const EXTENSION_MAX_BYTES: u64 = 1 << 20;

/// Values of extension headers for the following entry.
#[derive(Default)]
struct Extensions {
    path: Option<Vec<u8>>,
    link: Option<Vec<u8>>,
    size: Option<u64>,
    is_sparse: bool,
    /// The name of a sparse file; its `path` is that of a substitute.
    sparse_name: Option<Vec<u8>>,
}

/// Unpacks a decompressed tar stream.
///
/// The headers are read raw, because the library would hold an extension header of any size in memory. Bytes after the
/// archive's end are not read.
pub(super) fn unpack<'a>(
    reader: impl Read,
    sink: &mut impl EntrySink,
    budget: &'a Budget<'a>,
) -> Result<(), BundleError> {
    let mut archive = Archive::new(MeteredReader::new(reader, budget));
    let mut extensions = Extensions::default();
    for entry in archive
        .entries()
        .map_err(BundleError::from_archive_read_error)?
        .raw(true)
    {
        let mut entry = entry.map_err(BundleError::from_archive_read_error)?;
        budget.count_entry()?;
        let kind = entry.header().entry_type();
        match kind {
            EntryType::GNULongName => extensions.path = Some(read_name(&mut entry)?),
            EntryType::GNULongLink => extensions.link = Some(read_name(&mut entry)?),
            EntryType::XHeader => {
                let bytes = read_extension(&mut entry)?;
                read_pax(&bytes, &mut extensions)?;
            }
            // Comments on the whole archive, as `git archive` writes them.
            EntryType::XGlobalHeader => {
                read_extension(&mut entry)?;
            }
            _ => {
                let entry_extensions = std::mem::take(&mut extensions);
                let header = entry.header();
                let path = entry_extensions
                    .path
                    .unwrap_or_else(|| header.path_bytes().into_owned());
                let name = utf8_name(path)?;
                if entry_extensions.is_sparse {
                    let real_name = entry_extensions.sparse_name.map(utf8_name).transpose()?;
                    return Err(sparse_error(real_name.as_deref().unwrap_or(&name)));
                }
                // A size that does not fit into the header's field exceeds every limit. A different size would make
                // readers disagree about the start of the next entry.
                if entry_extensions
                    .size
                    .is_some_and(|size| size != entry.size())
                {
                    return Err(BundleError::Invalid(format!(
                        "the archive states a size outside of its header, near entry {name:?}"
                    )));
                }
                let mode = mode_of(header).map_err(BundleError::from_read_error(&name))?;
                let link = entry_extensions.link;
                let link = link.or_else(|| header.link_name_bytes().map(|link| link.into_owned()));
                match kind {
                    EntryType::Regular | EntryType::Continuous if name.ends_with('/') => {
                        // Old archives mark a folder by its name only.
                        sink.add_folder(&name)?;
                    }
                    EntryType::Regular | EntryType::Continuous => {
                        budget.allow(entry.size());
                        let attributes = FileAttributes {
                            mode,
                            modified_s: time_of(header),
                        };
                        sink.add_file(&name, attributes, &mut entry)?;
                        count_rest(&name, &mut entry, budget)?;
                    }
                    EntryType::Directory => sink.add_folder(&name)?,
                    EntryType::Symlink => {
                        sink.add_link(&name, &utf8_name(link.unwrap_or_default())?)?
                    }
                    EntryType::Link => {
                        sink.add_hard_link(&name, &utf8_name(link.unwrap_or_default())?)?
                    }
                    EntryType::Char | EntryType::Block => {
                        // An empty field is 0.
                        let is_zero =
                            |part: io::Result<Option<u32>>| part.ok().flatten().unwrap_or(0) == 0;
                        let is_null = kind == EntryType::Char
                            && is_zero(header.device_major())
                            && is_zero(header.device_minor());
                        let special = if is_null {
                            Special::OverlayfsWhiteout
                        } else {
                            Special::Device
                        };
                        sink.add_special(&name, special)?;
                    }
                    EntryType::Fifo => sink.add_special(&name, Special::Pipe)?,
                    EntryType::GNUSparse => return Err(sparse_error(&name)),
                    _ => return Err(unusable(&name, "of an unknown kind")),
                }
            }
        }
    }
    Ok(())
}

fn read_extension(entry: &mut tar::Entry<'_, impl Read>) -> Result<Vec<u8>, BundleError> {
    let size = entry.size();
    if size > EXTENSION_MAX_BYTES {
        return Err(BundleError::Invalid(format!(
            "the archive has a header of {size} bytes; at most {EXTENSION_MAX_BYTES} are allowed"
        )));
    }
    let mut bytes = Vec::new();
    entry
        .read_to_end(&mut bytes)
        .map_err(BundleError::from_archive_read_error)?;
    Ok(bytes)
}

/// Reads a name that is too long for a header; it ends with a zero byte.
fn read_name(entry: &mut tar::Entry<'_, impl Read>) -> Result<Vec<u8>, BundleError> {
    let mut bytes = read_extension(entry)?;
    if bytes.last() == Some(&0) {
        bytes.pop();
    }
    Ok(bytes)
}

/// Reads and counts the rest of a file's content that the sink has not read: skipping costs as much as writing.
fn count_rest(name: &str, content: &mut impl Read, budget: &Budget<'_>) -> Result<(), BundleError> {
    let mut buffer = [0; 8 << 10];
    loop {
        match content.read(&mut buffer) {
            Ok(0) => return Ok(()),
            Ok(read) => budget.count_content(name, read)?,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(BundleError::from_read_error(name)(error)),
        }
    }
}

/// The mode of an entry; the default if the field is empty.
fn mode_of(header: &Header) -> io::Result<u32> {
    let is_empty = |field: &[u8]| field.iter().all(|byte| matches!(byte, 0 | b' '));
    if is_empty(&header.as_old().mode) {
        return Ok(0o644);
    }
    header.mode()
}

/// The time of an entry's last change, in seconds since 1970. Programs that pack the same bytes every time write 0 in its place.
fn time_of(header: &Header) -> Option<u32> {
    let seconds = header.mtime().ok()?.try_into().ok()?;
    (seconds > 0).then_some(seconds)
}

fn sparse_error(name: &str) -> BundleError {
    unusable(
        name,
        "a sparse file, whose holes are left out: write it in full (tar without --sparse)",
    )
}

/// Reads pax records. Each is `LENGTH KEY=VALUE` and a newline; the length is that of the whole record, because values
/// may contain newlines.
fn read_pax(mut bytes: &[u8], extensions: &mut Extensions) -> Result<(), BundleError> {
    while !bytes.is_empty() {
        let (key, value, rest) = pax_record(bytes).ok_or_else(|| {
            BundleError::Invalid("the archive is damaged: a malformed pax extension".to_owned())
        })?;
        bytes = rest;
        match key {
            b"path" => extensions.path = Some(value.to_vec()),
            b"linkpath" => extensions.link = Some(value.to_vec()),
            // An invalid number becomes a size that no header has.
            b"size" => extensions.size = Some(parse_number(value).unwrap_or(u64::MAX)),
            b"GNU.sparse.name" => {
                extensions.is_sparse = true;
                extensions.sparse_name = Some(value.to_vec());
            }
            key if key.starts_with(b"GNU.sparse") => extensions.is_sparse = true,
            _ => {}
        }
    }
    Ok(())
}

/// Key, value, and the remaining bytes.
fn pax_record(bytes: &[u8]) -> Option<(&[u8], &[u8], &[u8])> {
    let space = bytes.iter().position(|&byte| byte == b' ')?;
    let length = usize::try_from(parse_number(&bytes[..space])?).ok()?;
    let (record, rest) = bytes.split_at_checked(length)?;
    let (key_and_value, end) = record
        .get(space + 1..)?
        .split_at_checked((length - space).checked_sub(2)?)?;
    let equals = key_and_value.iter().position(|&byte| byte == b'=')?;
    (end == b"\n").then_some((&key_and_value[..equals], &key_and_value[equals + 1..], rest))
}

fn parse_number(digits: &[u8]) -> Option<u64> {
    std::str::from_utf8(digits).ok()?.parse().ok()
}

fn utf8_name(bytes: Vec<u8>) -> Result<String, BundleError> {
    String::from_utf8(bytes).map_err(|error| {
        BundleError::Invalid(format!(
            "the archive has a name that is not UTF-8: {:?}",
            String::from_utf8_lossy(error.as_bytes())
        ))
    })
}
