use super::{
    budget::{Budget, Metered},
    entry::unusable,
    error::BundleError,
    sink::{Sink, Special},
};
use std::io::{self, Read};
use tar::{Archive, EntryType, Header, PaxExtensions};

/// Longest header that only describes the next entry (long names, extended attributes). Larger
/// ones would have to be held in memory, and no honest bundle has one.
const EXTENSION_MAX_BYTES: u64 = 1 << 20;

/// What extension headers say about the entry that follows.
#[derive(Default)]
struct Extensions {
    path: Option<Vec<u8>>,
    link: Option<Vec<u8>>,
}

/// Unpacks a decompressed tar stream.
///
/// The headers are read raw, since the library would hold an extension header of any size in
/// memory. What follows the archive's end is not read.
pub(super) fn unpack<'a>(
    reader: impl Read,
    sink: &mut impl Sink,
    budget: &'a Budget<'a>,
) -> Result<(), BundleError> {
    let mut archive = Archive::new(Metered::new(reader, budget));
    let mut extensions = Extensions::default();
    for entry in archive
        .entries()
        .map_err(BundleError::reading(""))?
        .raw(true)
    {
        let mut entry = entry.map_err(BundleError::reading(""))?;
        budget.entry()?;
        let kind = entry.header().entry_type();
        match kind {
            EntryType::GNULongName => extensions.path = Some(read_extension(&mut entry)?),
            EntryType::GNULongLink => extensions.link = Some(read_extension(&mut entry)?),
            EntryType::XHeader => {
                let bytes = read_extension(&mut entry)?;
                read_pax(&bytes, entry.header(), &mut extensions)?;
            }
            // Comments about the whole archive, as `git archive` writes them.
            EntryType::XGlobalHeader => {
                read_extension(&mut entry)?;
            }
            _ => {
                let Extensions { path, link } = std::mem::take(&mut extensions);
                let header = entry.header();
                let path = path.unwrap_or_else(|| header.path_bytes().into_owned());
                let name = text(path)?;
                let mode = header.mode().map_err(BundleError::reading(&name))?;
                let link = link.or_else(|| header.link_name_bytes().map(|link| link.into_owned()));
                match kind {
                    EntryType::Regular | EntryType::Continuous if name.ends_with('/') => {
                        // Old archives mark a folder by its name only.
                        sink.folder(&name, mode)?;
                    }
                    EntryType::Regular | EntryType::Continuous => {
                        budget.allow(entry.size());
                        sink.file(&name, mode, &mut entry)?;
                    }
                    EntryType::Directory => sink.folder(&name, mode)?,
                    EntryType::Symlink => sink.link(&name, &text(link.unwrap_or_default())?)?,
                    EntryType::Link => sink.hard_link(&name, &text(link.unwrap_or_default())?)?,
                    EntryType::Char | EntryType::Block => {
                        // An empty field is 0.
                        let is =
                            |part: io::Result<Option<u32>>| part.ok().flatten().unwrap_or(0) == 0;
                        let is_null = kind == EntryType::Char
                            && is(header.device_major())
                            && is(header.device_minor());
                        let special = if is_null {
                            Special::NullDevice
                        } else {
                            Special::Device
                        };
                        sink.special(&name, special)?;
                    }
                    EntryType::Fifo => sink.special(&name, Special::Pipe)?,
                    EntryType::GNUSparse => return Err(unusable(&name, "a sparse file")),
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
        .map_err(BundleError::reading(""))?;
    if bytes.last() == Some(&0) {
        bytes.pop();
    }
    Ok(bytes)
}

fn read_pax(bytes: &[u8], header: &Header, found: &mut Extensions) -> Result<(), BundleError> {
    for extension in PaxExtensions::new(bytes) {
        let extension = extension.map_err(BundleError::reading(""))?;
        match extension.key_bytes() {
            b"path" => found.path = Some(extension.value_bytes().to_vec()),
            b"linkpath" => found.link = Some(extension.value_bytes().to_vec()),
            // A size beyond the header's field is beyond every limit; another one would make
            // readers disagree about where the next entry starts.
            b"size" => {
                return Err(BundleError::Invalid(format!(
                    "the archive states a size outside of its header, near entry {:?}",
                    String::from_utf8_lossy(&header.path_bytes())
                )));
            }
            key if key.starts_with(b"GNU.sparse") => {
                return Err(BundleError::Invalid(
                    "the archive holds a sparse file; pack without --sparse".to_owned(),
                ));
            }
            _ => {}
        }
    }
    Ok(())
}

fn text(bytes: Vec<u8>) -> Result<String, BundleError> {
    String::from_utf8(bytes).map_err(|error| {
        BundleError::Invalid(format!(
            "the archive has a name that is not UTF-8: {:?}",
            String::from_utf8_lossy(error.as_bytes())
        ))
    })
}
