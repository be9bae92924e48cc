//! Text as HTML.

use askama::filters::{Escaper, Html};

pub(super) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    Html.write_escaped_str(&mut out, text)
        .expect("writing to a String cannot fail");
    out
}
