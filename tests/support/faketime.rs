//! Programs with a wrong system clock, by the library libfaketime.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// The library that gives a program a wrong clock when it is preloaded.
///
/// # Panics
/// If it is not installed.
#[must_use]
pub fn library() -> PathBuf {
    let folders = fs::read_dir("/usr/lib").expect("/usr/lib can be read");
    folders
        .flatten()
        .map(|folder| folder.path().join("faketime/libfaketime.so.1"))
        .find(|library| library.exists())
        .expect("libfaketime is installed; `make setup-test` installs it")
}

/// A system clock that a test sets while a program runs. The program's monotonic clocks stay right.
#[derive(Debug)]
pub struct SystemClock {
    file: PathBuf,
}

impl SystemClock {
    /// A clock that is right, with a file in this folder.
    ///
    /// # Panics
    /// If the file cannot be written.
    #[must_use]
    pub fn new(folder: &Path) -> Self {
        let clock = Self {
            file: folder.join("faketime"),
        };
        clock.set(0);
        clock
    }

    /// Sets the clock to be this far ahead of the right time.
    ///
    /// # Panics
    /// If the file cannot be written.
    pub fn set(&self, ahead_s: i64) {
        // A program must not read half of the file.
        let new = self.file.with_extension("new");
        fs::write(&new, format!("{ahead_s:+}")).expect("a scratch file can be written");
        fs::rename(new, &self.file).expect("a scratch file can be renamed");
    }

    /// Environment variables of a program with this clock.
    #[must_use]
    pub fn environment(&self) -> Vec<(&'static str, String)> {
        vec![
            ("LD_PRELOAD", library().display().to_string()),
            ("FAKETIME_TIMESTAMP_FILE", self.file.display().to_string()),
            ("FAKETIME_NO_CACHE", "1".to_owned()),
            ("FAKETIME_DONT_FAKE_MONOTONIC", "1".to_owned()),
            ("DONT_FAKE_MONOTONIC", "1".to_owned()),
            ("FAKETIME_DISABLE_SHM", "1".to_owned()),
        ]
    }
}
