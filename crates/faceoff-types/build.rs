//! Writes the table of characters that look alike, of Unicode's technical standard 39, in the format that `src/look_alikes.rs` reads.
//!
//! The crate with the standard's tables has an address for each character and each text that it resembles, and for each address the program
//! has an entry by which it is loaded. A text is smaller (docs/contributing/building.md has figures), so the crate is used here only.

use std::{env, error::Error, fs, path::PathBuf};
use unicode_normalization::UnicodeNormalization;
use unicode_security::confusable_detection::skeleton;

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    let mut table = String::new();
    for c in '\u{1}'..=char::MAX {
        let text = c.to_string();
        // Others are decomposed before they are looked up.
        if !text.nfd().eq([c]) {
            continue;
        }
        let prototype: String = skeleton(&text).collect();
        if prototype != text {
            table.extend([text.as_str(), &prototype, "\0"]);
        }
    }
    let folder = PathBuf::from(env::var("OUT_DIR")?);
    fs::write(folder.join("look_alikes.txt"), table)?;
    Ok(())
}
