//! Tests with a table whose bytes are forged: its footer is right, and a page states something else.

use super::*;
use arrow_array::{Float64Array, RecordBatch, StringArray};
use parquet::{
    arrow::{ArrowWriter, arrow_reader::ParquetRecordBatchReaderBuilder},
    basic::{Compression, ZstdLevel},
    file::{
        metadata::{PageIndexPolicy, ParquetMetaDataReader},
        properties::WriterProperties,
    },
};

const ROWS: usize = 5000;

/// A table of two columns, numbers and repeated texts, in pages of 1,000 rows.
fn table() -> Vec<u8> {
    let numbers = Float64Array::from_iter_values((0..ROWS).map(|row| (row as f64).sin()));
    let texts = StringArray::from_iter_values((0..ROWS).map(|row| ["hit", "defend"][row % 2]));
    let batch = RecordBatch::try_from_iter([
        ("puck_x", Arc::new(numbers) as _),
        ("task", Arc::new(texts) as _),
    ])
    .unwrap();
    let properties = WriterProperties::builder()
        .set_compression(Compression::ZSTD(ZstdLevel::default()))
        .set_data_page_row_count_limit(1000)
        .set_write_batch_size(1000)
        .build();
    let mut table = Vec::new();
    let mut writer = ArrowWriter::try_new(&mut table, batch.schema(), Some(properties)).unwrap();
    writer.write(&batch).unwrap();
    writer.close().unwrap();
    table
}

fn footer(table: &Bytes) -> ParquetMetaData {
    ParquetMetaDataReader::new()
        .with_page_index_policy(PageIndexPolicy::Required)
        .parse_and_finish(table)
        .unwrap()
}

/// The first data page of the column, its sizes, and the offset of its header.
fn first_page(table: &Bytes, column: usize) -> (usize, PageSizes) {
    let footer = footer(table);
    let (start, length) = footer.row_group(0).column(column).byte_range();
    let page = read_header(table, start..start + length).unwrap();
    (usize::try_from(start).unwrap(), page)
}

/// A table whose first page of numbers states another size before compression, in as many bytes.
fn with_page_of(uncompressed: u64) -> Bytes {
    let mut table = table();
    let (start, page) = first_page(&table.clone().into(), 0);
    let header = start..start + usize::try_from(page.header).unwrap();
    let varint = |number: u64| {
        let mut bytes = Vec::new();
        let mut left = number << 1;
        while left >= 0x80 {
            bytes.push((left & 0x7f) as u8 | 0x80);
            left >>= 7;
        }
        bytes.push(left as u8);
        bytes
    };
    let (old, new) = (varint(page.uncompressed), varint(uncompressed));
    assert_eq!(old.len(), new.len());
    let position = table[header.clone()]
        .windows(old.len())
        .position(|bytes| bytes == old)
        .unwrap();
    table[header.start + position..][..new.len()].copy_from_slice(&new);
    table.into()
}

#[test]
fn headers_of_all_pages_are_read() {
    let table = Bytes::from(table());
    let footer = footer(&table);
    check(&table, &footer).unwrap();
    for column in footer.row_group(0).columns() {
        let (mut position, length) = column.byte_range();
        let end = position + length;
        let (mut pages, mut bytes) = (0, 0);
        while position < end {
            let page = read_header(&table, position..end).unwrap();
            position += page.header + page.compressed;
            bytes += page.header + page.uncompressed;
            pages += 1;
        }
        assert_eq!(pages, 1 + 5, "a dictionary and the rows");
        assert_eq!(bytes, column.uncompressed_size().unsigned_abs());
    }
}

#[test]
fn page_larger_than_its_column_is_refused() {
    let column_bytes = footer(&table().into())
        .row_group(0)
        .column(0)
        .uncompressed_size();
    let table = with_page_of(column_bytes.unsigned_abs() * 4);
    let refused = check(&table, &footer(&table)).unwrap_err().to_string();
    assert!(
        refused.contains("pages of the column puck_x state more bytes"),
        "{refused}"
    );
    // Without the check the library reads such a page, and finds too late that it has fewer bytes.
    let builder = ParquetRecordBatchReaderBuilder::try_new(table.clone()).unwrap();
    assert!(builder.build().unwrap().any(|batch| batch.is_err()));
    let metadata = footer(&table);
    let pages = IndexedPages::new(table, &metadata, &[0]).unwrap();
    let (start, length) = metadata.row_group(0).column(0).byte_range();
    let refused = pages.get_bytes(start, usize::try_from(length).unwrap());
    let refused = refused.unwrap_err().to_string();
    assert!(
        refused.contains("states more bytes than the footer states"),
        "{refused}"
    );
}

#[test]
fn cut_headers_are_incomplete_or_invalid() {
    let table = Bytes::from(table());
    for column in [0, 1] {
        let (start, page) = first_page(&table, column);
        let header = &table[start..][..usize::try_from(page.header).unwrap()];
        assert_eq!(parse_header(header), Ok(page));
        for length in 0..header.len() {
            assert_eq!(
                parse_header(&header[..length]),
                Err(HeaderError::Incomplete)
            );
        }
    }
    for (bytes, error) in [
        (&[0][..], HeaderError::Invalid),
        // The uncompressed size twice; the second time, its field number is written out.
        (
            &[0x25, 0x02, 0x15, 0x02, 0x05, 0x04, 0x7e, 0x00],
            HeaderError::Invalid,
        ),
        // One uncompressed size, but of type i64 instead of i32.
        (&[0x26, 0x02, 0x15, 0x02, 0x00], HeaderError::Invalid),
        // A list, which the format has not here.
        (
            &[0x19, 0xfc, 0xff, 0xff, 0xff, 0xff, 0x0f],
            HeaderError::Invalid,
        ),
        // A number without an end.
        (
            &[
                0x25, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff,
            ],
            HeaderError::Invalid,
        ),
        // A structure in a structure in a structure, and so on.
        (&[0x5c; 64], HeaderError::Invalid),
        // A negative size.
        (&[0x25, 0x01, 0x15, 0x02, 0x00], HeaderError::Invalid),
    ] {
        assert_eq!(parse_header(bytes), Err(error), "{bytes:?}");
    }
}

#[test]
fn page_index_outside_of_its_column_is_refused() {
    let table = Bytes::from(table());
    let metadata = footer(&table);
    let group = metadata.row_group(0);
    let index = metadata.page_index_for_row_group(0);
    let locations = index.page_locations(0).unwrap();
    let (column, rows) = (group.column(0), group.num_rows());
    check_locations(column, rows, locations).unwrap();
    type Change = fn(&mut PageLocation);
    for change in [
        (|page| page.offset = -1) as Change,
        |page| page.offset = 0,
        |page| page.offset = i64::MAX,
        |page| page.compressed_page_size = -1,
        |page| page.compressed_page_size = i32::MAX,
        |page| page.first_row_index = -1,
        |page| page.first_row_index = 1 << 40,
    ] {
        let mut locations = locations.clone();
        change(&mut locations[2]);
        let refused = check_locations(column, rows, &locations).unwrap_err();
        assert!(
            refused
                .to_string()
                .contains("the page index of the column puck_x")
        );
    }
}
