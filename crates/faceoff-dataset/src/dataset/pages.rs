//! Checks what the pages of a Parquet table state about themselves. Each page states its size before compression, as the
//! footer does for the whole column. The Parquet library allocates what a page states, so a page must not exceed its column.

use bytes::Bytes;
use parquet::{
    errors::{ParquetError, Result},
    file::{
        metadata::{ColumnChunkMetaData, ParquetMetaData, RowGroupMetaData},
        page_index::offset_index::PageLocation,
        reader::{ChunkReader, Length},
    },
};
use std::{collections::HashMap, ops::Range, sync::Arc};

/// Bytes that are read for a page's header at first; a header with bounds of long texts is longer.
const HEADER_BYTES: usize = 128;
/// Maximum length of a page's header.
const MAX_HEADER_BYTES: usize = 1 << 20;
/// Maximum depth of nested structures in a header; the format has three.
const MAX_DEPTH: usize = 8;

/// Sizes of a page, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct PageSizes {
    header: u64,
    /// Size of the page's data before compression.
    uncompressed: u64,
    /// Size of the page's data in the table.
    compressed: u64,
}

/// Reads the headers of all pages. Refuses pages that together exceed what the footer states for their column. The columns must
/// lie within the table (`footer::check`).
pub(super) fn check(table: &impl ChunkReader, footer: &ParquetMetaData) -> Result<()> {
    let mut columns = footer
        .row_groups()
        .iter()
        .flat_map(RowGroupMetaData::columns);
    columns.try_for_each(|column| check_column(table, column))
}

fn check_column(table: &impl ChunkReader, column: &ColumnChunkMetaData) -> Result<()> {
    let (mut position, length) = column.byte_range();
    let end = position + length;
    // Bytes before compression that the pages may still state.
    let mut remaining_uncompressed = column.uncompressed_size().unsigned_abs();
    // Each page has a value, but for a dictionary and a page of no rows.
    let mut remaining_pages = column.num_values().unsigned_abs().saturating_add(2);
    while position < end {
        let page = read_header(table, position..end)?;
        remaining_uncompressed = remaining_uncompressed
            .checked_sub(page.uncompressed)
            .ok_or_else(|| larger_than_stated(column))?;
        remaining_pages = remaining_pages.checked_sub(1).ok_or_else(|| {
            ParquetError::General(format!(
                "the column {} has more pages than values",
                column.column_path().string()
            ))
        })?;
        position += page.header + page.compressed;
    }
    Ok(())
}

fn larger_than_stated(column: &ColumnChunkMetaData) -> ParquetError {
    ParquetError::General(format!(
        "pages of the column {} state more bytes than the footer, which states {}",
        column.column_path().string(),
        column.uncompressed_size()
    ))
}

/// Reads the header of the page at the start of a range that the page must not leave.
fn read_header(table: &impl ChunkReader, range: Range<u64>) -> Result<PageSizes> {
    let available = usize::try_from(range.end - range.start).unwrap_or(usize::MAX);
    let lengths = std::iter::successors(Some(HEADER_BYTES), |length| Some(2 * length));
    for length in lengths.take_while(|length| *length <= MAX_HEADER_BYTES) {
        let bytes = table.get_bytes(range.start, length.min(available))?;
        match parse_header(&bytes) {
            Ok(page) if page.header + page.compressed <= range.end - range.start => {
                return Ok(page);
            }
            Err(HeaderError::Incomplete) if length < available.min(MAX_HEADER_BYTES) => {}
            Ok(_) | Err(_) => break,
        }
    }
    Err(ParquetError::General(format!(
        "the page at byte {} is invalid",
        range.start
    )))
}

/// A table of which pages are read at the positions that its page index states. Refuses a page that states more bytes than the
/// footer states for its column.
#[derive(Debug, Clone)]
pub(super) struct IndexedPages<R> {
    table: R,
    /// By position of a page: the bytes that the footer states for its column.
    max_bytes: Arc<HashMap<u64, u64>>,
}

impl<R: ChunkReader> IndexedPages<R> {
    /// Checks the positions in the page index. Columns without a page index have all their pages checked.
    pub fn new(table: R, metadata: &ParquetMetaData, groups: &[usize]) -> Result<Self> {
        let mut max_bytes = HashMap::new();
        for group in groups {
            let rows = metadata.row_group(*group).num_rows();
            let index = metadata.page_index_for_row_group(*group);
            for (number, column) in metadata.row_group(*group).columns().iter().enumerate() {
                let Some(locations) = index.page_locations(number) else {
                    check_column(&table, column)?;
                    continue;
                };
                check_locations(column, rows, locations)?;
                let (start, _) = column.byte_range();
                let positions = locations.iter().map(|page| page.offset.unsigned_abs());
                for position in positions.chain([start]) {
                    let bytes = column.uncompressed_size().unsigned_abs();
                    max_bytes.insert(position, bytes);
                }
            }
        }
        Ok(Self {
            table,
            max_bytes: Arc::new(max_bytes),
        })
    }
}

/// Refuses locations of pages outside of their column, and rows that do not ascend.
fn check_locations(
    column: &ColumnChunkMetaData,
    rows: i64,
    locations: &[PageLocation],
) -> Result<()> {
    let (start, length) = column.byte_range();
    let within_column = locations.iter().all(|page| {
        page.offset >= 0
            && page.compressed_page_size >= 0
            && page.offset.unsigned_abs() >= start
            && page
                .offset
                .unsigned_abs()
                .saturating_add(u64::from(page.compressed_page_size.unsigned_abs()))
                <= start + length
    });
    let ascending = locations
        .first()
        .is_none_or(|page| page.first_row_index == 0)
        && locations
            .windows(2)
            .all(|pages| pages[0].first_row_index <= pages[1].first_row_index)
        && locations
            .last()
            .is_none_or(|page| page.first_row_index <= rows);
    if within_column && ascending {
        return Ok(());
    }
    Err(ParquetError::General(format!(
        "the page index of the column {} contradicts the footer",
        column.column_path().string()
    )))
}

impl<R: Length> Length for IndexedPages<R> {
    fn len(&self) -> u64 {
        self.table.len()
    }
}

impl<R: ChunkReader> ChunkReader for IndexedPages<R> {
    type T = R::T;

    fn get_read(&self, start: u64) -> Result<Self::T> {
        self.table.get_read(start)
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes> {
        let bytes = self.table.get_bytes(start, length)?;
        if let Some(max_bytes) = self.max_bytes.get(&start)
            && !parse_header(&bytes).is_ok_and(|page| page.uncompressed <= *max_bytes)
        {
            return Err(ParquetError::General(format!(
                "the page at byte {start} is invalid, or states more bytes than the footer states for its column, {max_bytes}"
            )));
        }
        Ok(bytes)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum HeaderError {
    /// The bytes end before the header.
    Incomplete,
    Invalid,
}

/// Parses a page's header: a structure in Thrift's compact protocol, of which the fields 2 and 3 are the sizes of the data.
fn parse_header(bytes: &[u8]) -> std::result::Result<PageSizes, HeaderError> {
    let mut header = CompactReader { bytes };
    let (mut uncompressed, mut compressed) = (None, None);
    let mut field = 0;
    while let Some(kind) = header.field(&mut field)? {
        match (field, kind) {
            (2, CompactReader::I32) => uncompressed = Some(header.integer()?),
            (3, CompactReader::I32) => compressed = Some(header.integer()?),
            // The other fields of the format; the library reads fields of other types differently.
            (1 | 4, CompactReader::I32) | (5..=8, CompactReader::STRUCT) => {
                header.skip(kind, MAX_DEPTH)?;
            }
            _ => return Err(HeaderError::Invalid),
        }
    }
    let size = |size: Option<i64>| {
        size.and_then(|size| u64::try_from(size).ok())
            .ok_or(HeaderError::Invalid)
    };
    Ok(PageSizes {
        header: (bytes.len() - header.bytes.len()) as u64,
        uncompressed: size(uncompressed)?,
        compressed: size(compressed)?,
    })
}

/// Reads values of Thrift's compact protocol (thrift/doc/specs/thrift-compact-protocol.md).
struct CompactReader<'a> {
    /// Bytes that were not read yet.
    bytes: &'a [u8],
}

impl CompactReader<'_> {
    const TRUE: u8 = 1;
    const FALSE: u8 = 2;
    const I8: u8 = 3;
    const I16: u8 = 4;
    const I32: u8 = 5;
    const I64: u8 = 6;
    const DOUBLE: u8 = 7;
    const BINARY: u8 = 8;
    const LIST: u8 = 9;
    const SET: u8 = 10;
    const STRUCT: u8 = 12;

    fn byte(&mut self) -> std::result::Result<u8, HeaderError> {
        let (byte, rest) = self.bytes.split_first().ok_or(HeaderError::Incomplete)?;
        self.bytes = rest;
        Ok(*byte)
    }

    /// A number in groups of seven bits, the lowest first.
    fn varint(&mut self) -> std::result::Result<u64, HeaderError> {
        let mut number = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            number |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Ok(number);
            }
        }
        Err(HeaderError::Invalid)
    }

    /// A number whose lowest bit is its sign.
    fn integer(&mut self) -> std::result::Result<i64, HeaderError> {
        let number = self.varint()?;
        Ok((number >> 1).cast_signed() ^ -(number & 1).cast_signed())
    }

    fn skip_bytes(&mut self, count: u64) -> std::result::Result<(), HeaderError> {
        let count = usize::try_from(count).map_err(|_| HeaderError::Incomplete)?;
        self.bytes = self.bytes.get(count..).ok_or(HeaderError::Incomplete)?;
        Ok(())
    }

    /// The next field of a structure: its type, and in `field` its number; `None` at the structure's end.
    fn field(&mut self, field: &mut i64) -> std::result::Result<Option<u8>, HeaderError> {
        let byte = self.byte()?;
        if byte == 0 {
            return Ok(None);
        }
        let number = match i64::from(byte >> 4) {
            0 => self.integer()?,
            difference => *field + difference,
        };
        if number <= *field || number > i64::from(i16::MAX) {
            return Err(HeaderError::Invalid);
        }
        *field = number;
        Ok(Some(byte & 0x0f))
    }

    fn skip(&mut self, kind: u8, depth: usize) -> std::result::Result<(), HeaderError> {
        let depth = depth.checked_sub(1).ok_or(HeaderError::Invalid)?;
        match kind {
            // As a field, a boolean is in its type.
            Self::TRUE | Self::FALSE => Ok(()),
            Self::I8 => self.skip_bytes(1),
            Self::I16 | Self::I32 | Self::I64 => self.varint().map(|_| ()),
            Self::DOUBLE => self.skip_bytes(8),
            Self::BINARY => {
                let length = self.varint()?;
                self.skip_bytes(length)
            }
            Self::LIST | Self::SET => {
                let byte = self.byte()?;
                let count = match u64::from(byte >> 4) {
                    15 => self.varint()?,
                    count => count,
                };
                for _ in 0..count {
                    match byte & 0x0f {
                        // As an element, a boolean is a byte.
                        Self::TRUE | Self::FALSE => self.skip_bytes(1)?,
                        kind => self.skip(kind, depth)?,
                    }
                }
                Ok(())
            }
            Self::STRUCT => {
                let mut field = 0;
                while let Some(kind) = self.field(&mut field)? {
                    self.skip(kind, depth)?;
                }
                Ok(())
            }
            // Maps: the format has none in a page's header.
            _ => Err(HeaderError::Invalid),
        }
    }
}

#[cfg(test)]
mod tests;
