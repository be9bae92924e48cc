//! CSV tables (RFC 4180) for downloads.

use axum::{
    http::header,
    response::{IntoResponse, Response},
};

/// Media type; the parameter `header` of RFC 7111 states that the first line is a header.
pub const MEDIA_TYPE: &str = "text/csv; charset=utf-8; header=present";

/// A table as CSV text; fields are quoted where necessary.
pub struct Table(String);

impl Table {
    /// A table with a header line.
    pub fn new(columns: &[impl ToString]) -> Self {
        let mut table = Self(String::new());
        table.row(columns.iter().map(ToString::to_string));
        table
    }

    /// Appends a row.
    pub fn row(&mut self, fields: impl IntoIterator<Item = String>) {
        for (column, field) in fields.into_iter().enumerate() {
            if column > 0 {
                self.0.push(',');
            }
            if field.contains([',', '"', '\n', '\r']) {
                self.0.push('"');
                self.0.push_str(&field.replace('"', "\"\""));
                self.0.push('"');
            } else {
                self.0.push_str(&field);
            }
        }
        self.0.push_str("\r\n");
    }

    /// A response that downloads the table as a file.
    pub fn into_download(self, name: &'static str) -> Response {
        let headers = [
            (header::CONTENT_TYPE, MEDIA_TYPE.to_owned()),
            (
                header::CONTENT_DISPOSITION,
                format!("attachment; filename=\"{name}\""),
            ),
        ];
        (headers, self.into_bytes()).into_response()
    }

    pub fn into_bytes(self) -> Vec<u8> {
        self.0.into_bytes()
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
        let text = String::from_utf8(table.into_bytes()).unwrap();
        assert_eq!(text, "a,b\r\n'=1+1,\"x, \"\"y\"\"\nz\"\r\n");
        assert_eq!(escape_formula("plain"), "plain");
    }
}
