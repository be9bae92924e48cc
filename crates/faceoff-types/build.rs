//! Writes the table of characters that look alike, of Unicode's technical standard 39, for `src/look_alikes.rs`.
//!
//! The tables of the crate `unicode-security` contain pointers, each of which needs a relocation in the executable. Arrays of numbers and
//! one string are smaller (docs/contributing/building.md has figures), so the crate is a build dependency only.

use std::{env, error::Error, fs, path::PathBuf};
use unicode_normalization::UnicodeNormalization;
use unicode_security::confusable_detection::skeleton;

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    let mut characters = Vec::new();
    // For each character, where its prototype (the text that it looks like) ends in `prototypes`.
    let mut ends = Vec::new();
    let mut prototypes = String::new();
    for c in '\u{1}'..=char::MAX {
        let text = c.to_string();
        // Characters with a decomposition never occur: texts are decomposed (NFD) before their characters are looked up.
        if !text.nfd().eq([c]) {
            continue;
        }
        let prototype: String = skeleton(&text).collect();
        if prototype != text {
            prototypes.push_str(&prototype);
            characters.push(c);
            ends.push(u16::try_from(prototypes.len())?);
        }
    }
    let number = characters.len();
    let source = format!(
        "static CHARACTERS: [char; {number}] = {characters:?};\nstatic ENDS: [u16; {number}] = {ends:?};\n\
         static PROTOTYPES: &str = {prototypes:?};\n"
    );
    let folder = PathBuf::from(env::var("OUT_DIR")?);
    fs::write(folder.join("look_alikes.rs"), source)?;
    Ok(())
}
