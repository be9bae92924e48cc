//! Text files of the repository, compiled in: compressed by `build.rs`, decompressed on first use.

use flate2::read::GzDecoder;
use std::{io::Read as _, sync::OnceLock};

/// A gzip-compressed text and, once it was needed, its decompressed form.
#[derive(Debug)]
pub(crate) struct CompressedText {
    gzip: &'static [u8],
    text: OnceLock<String>,
}

impl CompressedText {
    pub(crate) const fn new(gzip: &'static [u8]) -> Self {
        Self {
            gzip,
            text: OnceLock::new(),
        }
    }

    /// The text; decompressed once.
    ///
    /// # Panics
    /// If `build.rs` compressed something other than UTF-8 text; the tests of all documents and assets exclude that.
    pub(crate) fn text(&self) -> &str {
        self.text.get_or_init(|| {
            let mut text = String::new();
            let read = GzDecoder::new(self.gzip).read_to_string(&mut text);
            read.expect("build.rs compresses UTF-8 text");
            text
        })
    }
}

/// The [`CompressedText`] of a file, by its path in the repository.
macro_rules! compressed_text {
    ($($path:expr),+) => {
        $crate::compressed_text::CompressedText::new(include_bytes!(concat!(
            env!("OUT_DIR"),
            "/compressed/",
            $($path,)+
            ".gz"
        )))
    };
}
pub(crate) use compressed_text;
