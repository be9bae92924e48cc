//! Texts of the repository that are compiled in: packed by `build.rs`, unpacked when first asked for.

use flate2::read::GzDecoder;
use std::{io::Read as _, sync::OnceLock};

/// A text, and what it is packed in.
#[derive(Debug)]
pub(crate) struct Packed {
    gzip: &'static [u8],
    text: OnceLock<String>,
}

impl Packed {
    pub(crate) const fn new(gzip: &'static [u8]) -> Self {
        Self {
            gzip,
            text: OnceLock::new(),
        }
    }

    /// The same text each time.
    ///
    /// # Panics
    /// If `build.rs` packed something else than a text, which the tests of all documents and assets would show.
    pub(crate) fn text(&self) -> &str {
        self.text.get_or_init(|| {
            let mut text = String::new();
            let read = GzDecoder::new(self.gzip).read_to_string(&mut text);
            read.expect("build.rs packs texts");
            text
        })
    }
}

/// The [`Packed`] text of a file that `build.rs` packs, by its path in the repository.
macro_rules! packed {
    ($($path:expr),+) => {
        $crate::packed::Packed::new(include_bytes!(concat!(
            env!("OUT_DIR"),
            "/packed/",
            $($path,)+
            ".gz"
        )))
    };
}
pub(crate) use packed;
