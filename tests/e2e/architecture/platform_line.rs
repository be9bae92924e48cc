//! The line between the platform and air hockey: the tables of `ARCHITECTURE.md` that put crates, and modules inside of them, on a
//! side, and words of air hockey in crates of the platform.

use super::imports::is_test_item;
use faceoff_tests::repository;
use std::{
    collections::{BTreeMap, BTreeSet},
    fmt, fs,
    path::{Path, PathBuf},
};
use syn::{
    Attribute, Item, LitStr, Macro, Meta,
    visit::{self, Visit},
};

/// Names of tasks, bodies and events of air hockey, which the platform must not know, neither in the singular nor in the plural.
const WORDS: [&str; 8] = [
    "hit", "defend", "prepare", "puck", "mallet", "joint", "goal", "foul",
];

/// The crates on one side of the line: a row of the first table in the section "The line".
pub fn crates_on_side(row: &str) -> BTreeSet<String> {
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

/// The modules of air hockey inside of crates of the platform, by crate: paths below `src/` without an extension.
pub fn modules() -> BTreeMap<String, Vec<String>> {
    let text = fs::read_to_string(repository().join("ARCHITECTURE.md"))
        .expect("ARCHITECTURE.md can be read");
    let rows = text
        .lines()
        .skip_while(|line| !line.starts_with("| crate | modules of air hockey |"))
        .skip(2)
        .take_while(|line| line.starts_with('|'));
    let cells = |row: &str| -> Vec<String> {
        let cells = row.trim_matches('|').split('|');
        cells.map(|cell| cell.trim().to_owned()).collect()
    };
    rows.map(|row| {
        let [name, modules] = &cells(row)[..] else {
            panic!("a row of two cells: {row}");
        };
        let modules = modules
            .split(',')
            .map(|module| module.trim().trim_matches('`').to_owned());
        (name.trim_matches('`').to_owned(), modules.collect())
    })
    .collect()
}

/// A word of air hockey, or the name of one of its crates.
#[derive(Debug, PartialEq, Eq)]
pub struct Finding {
    pub word: String,
    /// Path below the root of the crate.
    pub file: String,
}

impl Finding {
    /// Is the finding in the module with this path, or in a module of it?
    pub fn is_in(&self, module: &str) -> bool {
        let path = self.file.trim_end_matches(".rs");
        path.strip_prefix(module)
            .is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?} in {}", self.word, self.file)
    }
}

/// Words of air hockey and names of its crates in the crate whose root is in `folder`, outside of comments and tests.
pub fn findings(folder: &Path, air_hockey: &BTreeSet<String>) -> Vec<Finding> {
    let mut paths = Vec::new();
    collect_files(folder, &mut paths);
    let read = |path: PathBuf| {
        let text = fs::read_to_string(&path).expect("a source file can be read");
        let syntax =
            syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        (path, syntax)
    };
    let files: Vec<(PathBuf, syn::File)> = paths.into_iter().map(read).collect();
    let test_only_files: BTreeSet<PathBuf> = files.iter().flat_map(test_modules).collect();
    let mut found = Vec::new();
    for (file, syntax) in files
        .iter()
        .filter(|(file, _)| !test_only_files.contains(file))
    {
        let mut finder = WordFinder {
            // The agents are programs, no crates that others import.
            crates: air_hockey
                .iter()
                .filter(|name| name.starts_with("faceoff-"))
                .map(|name| name.replace('-', "_"))
                .collect(),
            words: BTreeSet::new(),
        };
        finder.visit_file(syntax);
        let name = file.strip_prefix(folder).unwrap_or(file);
        let name = name.to_string_lossy().into_owned();
        found.extend(finder.words.into_iter().map(|word| Finding {
            word,
            file: name.clone(),
        }));
    }
    found
}

/// The files of the modules that this file declares for tests only.
fn test_modules((path, syntax): &(PathBuf, syn::File)) -> Vec<PathBuf> {
    let stem = path.file_stem().unwrap_or_default();
    let is_root = ["lib", "main", "mod"].iter().any(|root| stem == *root);
    let folder = if is_root {
        path.with_file_name("")
    } else {
        path.with_extension("")
    };
    let files = syntax.items.iter().filter_map(|item| match item {
        Item::Mod(module) if module.content.is_none() && is_test_item(item) => {
            Some(folder.join(format!("{}.rs", module.ident)))
        }
        _ => None,
    });
    files.collect()
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
struct WordFinder {
    /// Names of the crates of air hockey, as in paths.
    crates: BTreeSet<String>,
    words: BTreeSet<String>,
}

impl WordFinder {
    fn read(&mut self, text: &str) {
        let names = text.split(|letter: char| !letter.is_alphanumeric() && letter != '_');
        let crates = names.filter(|name| self.crates.contains(*name));
        self.words.extend(crates.map(str::to_owned));
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
