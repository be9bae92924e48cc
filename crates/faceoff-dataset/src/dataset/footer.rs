//! Checks the footer of a Parquet table, which states where each column lies. The Parquet library trusts these positions,
//! so they are checked before it reads columns.

use super::{file_range::FileRange, pages};
use parquet::{
    errors::{ParquetError, Result},
    file::metadata::{ColumnChunkMetaData, ParquetMetaData},
};

/// Maximum number of rows of a row group; this program writes about 33,000.
const MAX_GROUP_ROWS: i64 = 1 << 24;
/// Maximum mean size of a column's values (numbers, short texts or lists of up to a few hundred numbers), in bytes before
/// compression.
const MAX_VALUE_BYTES: u64 = 4096;
/// Size of a column of a row group that is always read: a few values may be longer.
const SMALL_COLUMN_BYTES: u64 = 1 << 20;

/// Checks what a table states about its own sizes, in its footer and in its pages, before its columns are read.
pub(crate) fn check_table(table: &FileRange, footer: &ParquetMetaData) -> Result<()> {
    check(footer, table.bytes)?;
    pages::check(table, footer)
}

/// Refuses negative numbers, columns outside of the table (of `table_bytes` bytes), and columns whose stated size is far too large
/// for their number of rows.
pub(super) fn check(footer: &ParquetMetaData, table_bytes: u64) -> Result<()> {
    // Columns that share bytes would make a small table as costly as a large one.
    let columns = footer.row_groups().iter().flat_map(|group| group.columns());
    let sizes = columns.map(|column| column.compressed_size().unsigned_abs());
    if sizes.fold(0, u64::saturating_add) > table_bytes {
        return Err(ParquetError::General(
            "the columns together are larger than the table".to_owned(),
        ));
    }
    for (number, group) in footer.row_groups().iter().enumerate() {
        let columns = group.columns().iter();
        if group.num_rows() > MAX_GROUP_ROWS {
            return Err(ParquetError::General(format!(
                "row group {number} has {} rows, more than any table needs",
                group.num_rows()
            )));
        }
        if group.num_rows() < 0
            || !columns
                .into_iter()
                .all(|column| lies_within(column, table_bytes))
        {
            return Err(ParquetError::General(format!(
                "the columns of row group {number} do not lie within the table"
            )));
        }
        let max_bytes = SMALL_COLUMN_BYTES.saturating_add(
            group
                .num_rows()
                .unsigned_abs()
                .saturating_mul(MAX_VALUE_BYTES),
        );
        let large = group
            .columns()
            .iter()
            .find(|column| column.uncompressed_size().unsigned_abs() > max_bytes);
        if let Some(column) = large {
            return Err(ParquetError::General(format!(
                "the column {} of row group {number} has {} bytes for {} rows",
                column.column_path().string(),
                column.uncompressed_size(),
                group.num_rows()
            )));
        }
    }
    Ok(())
}

fn lies_within(column: &ColumnChunkMetaData, table_bytes: u64) -> bool {
    // A column begins with its dictionary, if it has one.
    let dictionary = column.dictionary_page_offset();
    let start = dictionary.unwrap_or(column.data_page_offset());
    let end = start.checked_add(column.compressed_size());
    let numbers = [
        start,
        column.data_page_offset(),
        column.compressed_size(),
        column.uncompressed_size(),
        column.num_values(),
    ];
    numbers.iter().all(|number| *number >= 0)
        && end.is_some_and(|end| end.unsigned_abs() <= table_bytes)
        && column.data_page_offset().unsigned_abs() <= table_bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::{
        basic::Type as PhysicalType,
        file::metadata::{FileMetaData, RowGroupMetaData},
        schema::types::{SchemaDescriptor, Type},
    };
    use std::sync::Arc;

    /// Size of the table that the tests assume.
    const TABLE_BYTES: u64 = 100;

    /// A footer of one column. Its data begin at offset `start`, its dictionary at offset `dictionary`; both together have
    /// `length` bytes.
    fn footer(rows: i64, start: i64, length: i64, dictionary: Option<i64>) -> ParquetMetaData {
        let field = Type::primitive_type_builder("puck_x", PhysicalType::DOUBLE)
            .build()
            .unwrap();
        let schema = Type::group_type_builder("steps")
            .with_fields(vec![Arc::new(field)])
            .build()
            .unwrap();
        let schema = Arc::new(SchemaDescriptor::new(Arc::new(schema)));
        let column = ColumnChunkMetaData::builder(schema.column(0))
            .set_data_page_offset(start)
            .set_dictionary_page_offset(dictionary)
            .set_total_compressed_size(length)
            .build()
            .unwrap();
        let group = RowGroupMetaData::builder(Arc::clone(&schema))
            .set_num_rows(rows)
            .add_column_metadata(column)
            .build()
            .unwrap();
        let file = FileMetaData::new(2, rows, None, None, schema, None);
        ParquetMetaData::new(file, vec![group])
    }

    #[test]
    fn columns_of_gigabytes_are_refused() {
        let column_of = |rows: i64, bytes: i64| {
            let footer = footer(rows, 4, 96, None);
            let [group] = footer.row_groups() else {
                panic!("{footer:?}")
            };
            let column = group.column(0).clone().into_builder();
            let column = column.set_total_uncompressed_size(bytes).build().unwrap();
            let group = group.clone().into_builder();
            let group = group.set_column_metadata(vec![column]).build().unwrap();
            ParquetMetaData::new(footer.file_metadata().clone(), vec![group])
        };
        assert!(check(&column_of(1000, 4 << 20), TABLE_BYTES).is_ok());
        let refused = check(&column_of(1 << 62, 8 << 20), TABLE_BYTES).unwrap_err();
        assert!(refused.to_string().contains("row group 0 has"), "{refused}");
        let refused = check(&column_of(1000, 8 << 20), TABLE_BYTES).unwrap_err();
        assert!(
            refused.to_string().contains("the column puck_x"),
            "{refused}"
        );
    }

    #[test]
    fn columns_outside_of_the_table_are_refused() {
        assert!(check(&footer(3, 4, 96, None), TABLE_BYTES).is_ok());
        assert!(check(&footer(3, 50, 96, Some(4)), TABLE_BYTES).is_ok());
        for (rows, start, length, dictionary) in [
            (3, -1, 50, None),
            (3, 4, -1, None),
            (3, 4, 97, None),
            (3, i64::MAX, 1, None),
            (3, 4, i64::MAX, None),
            (3, 50, 10, Some(-4)),
            (3, 101, 10, Some(4)),
            (-3, 4, 96, None),
        ] {
            let checked = check(&footer(rows, start, length, dictionary), TABLE_BYTES);
            assert!(checked.is_err(), "{rows} {start} {length} {dictionary:?}");
        }
    }
}
