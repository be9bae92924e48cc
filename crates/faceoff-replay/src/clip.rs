//! Reading and writing of clips. A clip is the recording of an episode, or of 500 control steps of a game, for replays in
//! the browser: a JSON header and columns of numbers, compressed.

use crate::{
    column::Column,
    error::ReplayError,
    gzip::Gzip,
    header::{CLIP_FORMAT, ColumnHeader, Header},
};
use flate2::read::GzDecoder;
use std::io::{self, Read};

/// A header and its columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Clip {
    /// The header; its `columns` are set when the clip is written.
    pub header: Header,
    pub columns: Vec<Column>,
}

/// Maximum uncompressed size of a clip.
const MAX_BYTES: u64 = 64 << 20;

impl Clip {
    /// A column by its name.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// The gzip-compressed bytes of the clip, as stored in packs and sent by servers: the length of the header (4 bytes), the header,
    /// and the columns' numbers (the *payload*). The same clip gives the same bytes.
    ///
    /// # Errors
    /// [`ReplayError::Io`] if writing to memory fails; [`ReplayError::Unreadable`] if the clip is too long.
    pub(crate) fn compressed(&self, gzip: &mut Gzip) -> Result<Vec<u8>, ReplayError> {
        let too_long = || ReplayError::unreadable("the recording", "it is too long");
        let value_count: usize = self.columns.iter().map(|column| column.counts.len()).sum();
        // Most values take one or two bytes.
        let mut payload = Vec::with_capacity(2 * value_count);
        let mut header = self.header.clone();
        header.columns.clear();
        for column in &self.columns {
            let start = payload.len();
            column.write(&mut payload);
            header.columns.push(ColumnHeader {
                name: column.name.clone(),
                unit: column.unit.clone(),
                scale: column.scale,
                order: column.order,
                first: column.first,
                count: u32::try_from(column.counts.len()).map_err(|_| too_long())?,
                bytes: u32::try_from(payload.len() - start).map_err(|_| too_long())?,
            });
        }
        let header = serde_json::to_vec(&header).map_err(io::Error::other)?;
        let length = u32::try_from(header.len()).map_err(|_| too_long())?;
        Ok(gzip.member(&[&length.to_le_bytes(), &header, &payload])?)
    }

    /// Reads a compressed clip.
    ///
    /// # Errors
    /// [`ReplayError::Unreadable`].
    pub fn read(compressed: &[u8]) -> Result<Self, ReplayError> {
        let wrong = |reason: &dyn ToString| ReplayError::unreadable("the clip", reason.to_string());
        let mut bytes = Vec::new();
        GzDecoder::new(compressed)
            .take(MAX_BYTES)
            .read_to_end(&mut bytes)
            .map_err(|error| wrong(&error))?;
        let cut_off = || wrong(&"it is cut off");
        let (length, rest) = bytes.split_first_chunk::<4>().ok_or_else(cut_off)?;
        let length = usize::try_from(u32::from_le_bytes(*length)).map_err(|error| wrong(&error))?;
        let (header, mut payload) = rest.split_at_checked(length).ok_or_else(cut_off)?;
        let header: Header = serde_json::from_slice(header).map_err(|error| wrong(&error))?;
        if header.format != CLIP_FORMAT {
            return Err(wrong(&format!(
                "its format is {:?}, this version reads {CLIP_FORMAT}",
                header.format
            )));
        }
        let mut columns = Vec::with_capacity(header.columns.len());
        for column_header in &header.columns {
            let bytes = usize::try_from(column_header.bytes).map_err(|error| wrong(&error))?;
            let (column_bytes, rest) = payload.split_at_checked(bytes).ok_or_else(cut_off)?;
            payload = rest;
            let mut column = Column::new(
                column_header.name.as_str(),
                &column_header.unit,
                column_header.scale,
                column_header.order,
            )
            .beginning_at(column_header.first);
            let count = usize::try_from(column_header.count).map_err(|error| wrong(&error))?;
            column.read(column_bytes, count)?;
            columns.push(column);
        }
        Ok(Self { header, columns })
    }
}
