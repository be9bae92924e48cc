//! CSV tables (RFC 4180) for downloads.

use axum::{
    http::header,
    response::{IntoResponse, Response},
};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Media type; the parameter `header` of RFC 7111 states that the first line is a header.
pub const MEDIA_TYPE: &str = "text/csv; charset=utf-8; header=present";

/// How a table is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CsvFormat {
    /// As RFC 4180 says, for programs.
    #[default]
    Csv,
    /// For spreadsheets in countries that write 1.5: with a byte order mark, without which Excel misreads other than English text.
    Spreadsheet,
    /// For spreadsheets in countries that write 1,5: these expect semicolons between the fields.
    SpreadsheetComma,
}

impl CsvFormat {
    const fn separator(self) -> char {
        match self {
            Self::Csv | Self::Spreadsheet => ',',
            Self::SpreadsheetComma => ';',
        }
    }

    /// The field with the decimal mark of the format.
    fn field(self, field: &str) -> Cow<'_, str> {
        let is_decimal = || field.contains('.') && field.parse::<f64>().is_ok();
        if self == Self::SpreadsheetComma && is_decimal() {
            Cow::Owned(field.replace('.', ","))
        } else {
            Cow::Borrowed(field)
        }
    }
}

/// Query of a download in CSV.
#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CsvQuery {
    #[serde(default)]
    pub format: CsvFormat,
}

/// A table, the first row of which is the header.
pub struct Table(Vec<Vec<String>>);

impl Table {
    /// A table with a header.
    pub fn new(columns: &[impl ToString]) -> Self {
        Self(vec![columns.iter().map(ToString::to_string).collect()])
    }

    /// Appends a row.
    pub fn row(&mut self, fields: impl IntoIterator<Item = String>) {
        self.0.push(fields.into_iter().collect());
    }

    /// A response that downloads the table as a file.
    pub fn into_download(self, name: &'static str, format: CsvFormat) -> Response {
        let headers = [
            (header::CONTENT_TYPE, MEDIA_TYPE.to_owned()),
            (
                header::CONTENT_DISPOSITION,
                format!("attachment; filename=\"{name}\""),
            ),
        ];
        (headers, self.into_bytes(format)).into_response()
    }

    /// The table as text; fields are quoted where necessary.
    pub fn into_bytes(self, format: CsvFormat) -> Vec<u8> {
        let separator = format.separator();
        let mut text = String::new();
        if format != CsvFormat::Csv {
            text.push('\u{feff}');
        }
        for row in self.0 {
            for (column, field) in row.iter().enumerate() {
                if column > 0 {
                    text.push(separator);
                }
                let field = format.field(field);
                if field.contains([separator, '"', '\n', '\r']) {
                    text.push('"');
                    text.push_str(&field.replace('"', "\"\""));
                    text.push('"');
                } else {
                    text.push_str(&field);
                }
            }
            text.push_str("\r\n");
        }
        text.into_bytes()
    }
}

/// A field with text from users. A leading apostrophe keeps a spreadsheet from evaluating it as a formula.
pub fn escape_formula(text: &str) -> String {
    match text.chars().next() {
        Some('=' | '+' | '-' | '@' | '\t' | '\r') => format!("'{text}"),
        _ => text.to_owned(),
    }
}

/// The value as a field; an empty field for `None`.
pub fn or_empty(value: Option<impl ToString>) -> String {
    value.map(|value| value.to_string()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_quoted_and_formulas_escaped() {
        let mut table = Table::new(&["a", "b"]);
        table.row([escape_formula("=1+1"), "x, \"y\"\nz".to_owned()]);
        let text = String::from_utf8(table.into_bytes(CsvFormat::Csv)).unwrap();
        assert_eq!(text, "a,b\r\n'=1+1,\"x, \"\"y\"\"\nz\"\r\n");
        assert_eq!(escape_formula("plain"), "plain");
    }

    #[test]
    fn spreadsheets_get_their_separator_and_decimal_mark() {
        let text = |format| {
            let mut table = Table::new(&["team", "rate"]);
            table.row(["Zoë; 1.5".to_owned(), "0.25".to_owned()]);
            table.row(["v1.2.3".to_owned(), "1e-3".to_owned()]);
            String::from_utf8(table.into_bytes(format)).unwrap()
        };
        assert_eq!(
            text(CsvFormat::Spreadsheet),
            "\u{feff}team,rate\r\nZoë; 1.5,0.25\r\nv1.2.3,1e-3\r\n"
        );
        assert_eq!(
            text(CsvFormat::SpreadsheetComma),
            "\u{feff}team;rate\r\n\"Zoë; 1.5\";0,25\r\nv1.2.3;1e-3\r\n"
        );
    }
}
