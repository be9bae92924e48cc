//! Import cycles among the files of a crate.

use super::imports::Crate;
use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

/// Each file with the files that it imports, and one imported name for each.
type Imports = BTreeMap<PathBuf, BTreeMap<PathBuf, String>>;

/// A description of each import cycle among the files of the crate whose root is in `folder`.
pub fn find_cycles(folder: &Path) -> Vec<String> {
    let imports = Crate::read(folder).imports();
    let reach: BTreeMap<&PathBuf, BTreeSet<&PathBuf>> = imports
        .keys()
        .map(|file| (file, reachable(&imports, file)))
        .collect();
    let mut seen = BTreeSet::new();
    let mut found = Vec::new();
    for file in imports.keys() {
        if seen.contains(file) || !reach[file].contains(file) {
            continue;
        }
        let cycle: BTreeSet<&PathBuf> = reach[file]
            .iter()
            .copied()
            .filter(|other| reach[*other].contains(file))
            .collect();
        seen.extend(cycle.iter().copied());
        found.push(describe(&cycle, &imports, folder));
    }
    found
}

/// Every file that can be reached by at least one import.
fn reachable<'a>(imports: &'a Imports, from: &PathBuf) -> BTreeSet<&'a PathBuf> {
    let mut reached = BTreeSet::new();
    let mut open: Vec<&PathBuf> = imports[from].keys().collect();
    while let Some(file) = open.pop() {
        if reached.insert(file) {
            open.extend(imports[file].keys());
        }
    }
    reached
}

fn describe(cycle: &BTreeSet<&PathBuf>, imports: &Imports, folder: &Path) -> String {
    let short = |path: &PathBuf| {
        let crate_folder = folder.parent().unwrap_or(folder);
        let name = path.strip_prefix(crate_folder.parent().unwrap_or(crate_folder));
        name.unwrap_or(path).display().to_string()
    };
    let mut text = format!("a cycle of {} files:", cycle.len());
    for file in cycle {
        for (target, name) in imports[*file]
            .iter()
            .filter(|(target, _)| cycle.contains(target))
        {
            text.push_str(&format!("\n  {} → {}: {name}", short(file), short(target)));
        }
    }
    text
}
