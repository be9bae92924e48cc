//! Packs the texts that the program carries: documents, styles and scripts, drawings. A release program has 0.9 MB of 40 less for it.

use flate2::{Compression, write::GzEncoder};
use std::{
    env,
    error::Error,
    fs,
    io::Write as _,
    path::{Path, PathBuf},
};

/// Folders of the repository, and what ends the names of the texts in them.
const TEXTS: [(&str, &[&str]); 3] = [
    ("docs", &["md", "svg"]),
    ("web/static", &["css", "js", "svg"]),
    ("web/client/dist", &["js"]),
];

fn main() -> Result<(), Box<dyn Error>> {
    // Build scripts run in their package's folder.
    let repository = Path::new("../..");
    let out = PathBuf::from(env::var("OUT_DIR")?).join("packed");
    for (folder, endings) in TEXTS {
        println!("cargo:rerun-if-changed=../../{folder}");
        pack(&repository.join(folder), &out.join(folder), endings)?;
    }
    Ok(())
}

/// Packs each text in `from`, and in the folders within, to the same name and `.gz` in `to`.
fn pack(from: &Path, to: &Path, endings: &[&str]) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let path = entry?.path();
        let name = path.file_name().ok_or("an entry has a name")?;
        if path.is_dir() {
            pack(&path, &to.join(name), endings)?;
        } else if endings
            .iter()
            .any(|ending| path.extension().is_some_and(|found| found == *ending))
        {
            let mut packed = GzEncoder::new(Vec::new(), Compression::best());
            packed.write_all(&fs::read(&path)?)?;
            let mut name = name.to_owned();
            name.push(".gz");
            fs::write(to.join(name), packed.finish()?)?;
        }
    }
    Ok(())
}
