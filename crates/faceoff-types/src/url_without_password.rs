//! URLs for logs and messages.

use std::borrow::Cow;

/// The URL without user and password: all that is between the scheme and the last `@`. The text need not be a valid URL, since URLs in
/// error messages may not be one.
#[must_use]
pub fn url_without_password(url: &str) -> Cow<'_, str> {
    let Some(at) = url.rfind('@') else {
        return url.into();
    };
    let scheme = url.find("://").filter(|end| *end < at);
    let scheme = scheme.map_or("", |end| &url[..end + 3]);
    format!("{scheme}…{}", &url[at..]).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn user_and_password_are_left_out() {
        for (url, expected) in [
            ("nats://127.0.0.1:4222", "nats://127.0.0.1:4222"),
            ("nats://user:p@ss@host:4222", "nats://…@host:4222"),
            ("nats://user:p/a?s#s@host", "nats://…@host"),
            ("user:secret@host:4222", "…@host:4222"),
            ("https://host/a@b", "https://…@b"),
            ("a@b://c", "…@b://c"),
        ] {
            assert_eq!(url_without_password(url), expected);
        }
    }
}
