//! The line between the platform and air hockey: the table of `ARCHITECTURE.md` that puts crates on a side, and words of air
//! hockey in crates of the platform.

use super::imports::is_test_item;
use faceoff_tests::repository;
use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
};
use syn::{
    Attribute, Item, LitStr, Macro, Meta,
    visit::{self, Visit},
};

/// Names of tasks, bodies and events of air hockey, which the platform must not know. The plural is meant, too.
const WORDS: [&str; 8] = [
    "hit", "defend", "prepare", "puck", "mallet", "joint", "goal", "foul",
];

/// The crates of a row of the table "The line".
pub fn side(row: &str) -> BTreeSet<String> {
    let text = fs::read_to_string(repository().join("ARCHITECTURE.md"))
        .expect("ARCHITECTURE.md can be read");
    let line = text
        .lines()
        .skip_while(|line| !line.starts_with("| side | crates |"))
        .take_while(|line| line.starts_with('|'))
        .find(|line| line.starts_with(&format!("| {row} |")))
        .unwrap_or_else(|| panic!("ARCHITECTURE.md has the row {row:?}"));
    let crates = line
        .trim_matches('|')
        .split('|')
        .nth(1)
        .expect("a row of two cells");
    crates
        .split(',')
        .map(|name| name.trim().trim_matches('`').to_owned())
        .collect()
}

/// Words of air hockey in the crate whose root is in `folder`, outside of comments and tests, each with its file.
pub fn words_in(folder: &Path) -> Vec<String> {
    let mut files = Vec::new();
    collect_files(folder, &mut files);
    let mut found = Vec::new();
    for file in files {
        let text = fs::read_to_string(&file).expect("a source file can be read");
        let syntax =
            syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        let mut finder = WordFinder::default();
        finder.visit_file(&syntax);
        let name = file.strip_prefix(folder).unwrap_or(&file).display();
        found.extend(
            finder
                .words
                .iter()
                .map(|word| format!("{word:?} in {name}")),
        );
    }
    found
}

fn collect_files(folder: &Path, files: &mut Vec<PathBuf>) {
    let mut entries: Vec<_> = fs::read_dir(folder)
        .expect("a source folder can be read")
        .map(|entry| entry.expect("an entry can be read").path())
        .collect();
    entries.sort();
    for path in entries {
        let stem = path.file_stem().and_then(|stem| stem.to_str());
        if stem == Some("tests") {
            continue;
        }
        if path.is_dir() {
            collect_files(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
}

/// Collects words from identifiers, strings and the contents of macros.
#[derive(Default)]
struct WordFinder {
    words: BTreeSet<String>,
}

impl WordFinder {
    fn read(&mut self, text: &str) {
        for word in words(text) {
            let singular = word.strip_suffix('s').unwrap_or(&word);
            if WORDS.contains(&singular) {
                self.words.insert(word);
            }
        }
    }
}

impl Visit<'_> for WordFinder {
    fn visit_item(&mut self, item: &Item) {
        if !is_test_item(item) {
            visit::visit_item(self, item);
        }
    }

    fn visit_attribute(&mut self, attribute: &Attribute) {
        // Comments are attributes named `doc`.
        if attribute.path().is_ident("doc") {
            return;
        }
        if let Meta::List(list) = &attribute.meta {
            self.read(&list.tokens.to_string());
        }
        visit::visit_attribute(self, attribute);
    }

    fn visit_ident(&mut self, ident: &syn::Ident) {
        self.read(&ident.to_string());
    }

    fn visit_lit_str(&mut self, literal: &LitStr) {
        self.read(&literal.value());
    }

    fn visit_macro(&mut self, body: &Macro) {
        self.read(&body.tokens.to_string());
        visit::visit_macro(self, body);
    }
}

/// The words of a text in lower case; `JointPos` and `joint_pos` are two words each.
fn words(text: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut after_lower_case = false;
    for letter in text.chars() {
        let starts_word = letter.is_uppercase() && after_lower_case;
        if !letter.is_alphabetic() || starts_word {
            words.push(String::new());
        }
        if letter.is_alphabetic()
            && let Some(word) = words.last_mut()
        {
            word.extend(letter.to_lowercase());
        }
        after_lower_case = letter.is_lowercase();
    }
    words.retain(|word| !word.is_empty());
    words
}
