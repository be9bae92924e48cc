//! URLs for logs and messages.

use std::borrow::Cow;

/// The URL without the user and password that it may contain.
#[must_use]
pub fn without_password(url: &str) -> Cow<'_, str> {
    let Some((scheme, rest)) = url.split_once("://") else {
        return url.into();
    };
    let end = rest.find(['/', '?', '#']).unwrap_or(rest.len());
    // A password may contain @.
    match rest[..end].rfind('@') {
        Some(at) => format!("{scheme}://…{}", &rest[at..]).into(),
        None => url.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn user_and_password_are_left_out() {
        for (url, expected) in [
            ("nats://127.0.0.1:4222", "nats://127.0.0.1:4222"),
            ("nats://user:p@ss@host:4222", "nats://…@host:4222"),
            ("https://token@host/a@b?c@d", "https://…@host/a@b?c@d"),
            ("https://host/a@b", "https://host/a@b"),
            ("no URL @", "no URL @"),
        ] {
            assert_eq!(without_password(url), expected);
        }
    }
}
