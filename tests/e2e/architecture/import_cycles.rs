//! Import cycles among the files of a crate: files that import from each other, directly or through further files.

use super::imports::Crate;
use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

/// Each file with the files from which it imports, and one imported name for each of these.
type Imports = BTreeMap<PathBuf, BTreeMap<PathBuf, String>>;

/// A description of each import cycle among the files of the crate whose root is in `folder`.
pub fn find_cycles(folder: &Path) -> Vec<String> {
    let imports = Crate::read(folder).imports();
    let reachable_from: BTreeMap<&PathBuf, BTreeSet<&PathBuf>> = imports
        .keys()
        .map(|file| (file, reachable(&imports, file)))
        .collect();
    // Files of cycles that have a description already.
    let mut described = BTreeSet::new();
    let mut descriptions = Vec::new();
    for file in imports.keys() {
        if described.contains(file) || !reachable_from[file].contains(file) {
            continue;
        }
        let cycle: BTreeSet<&PathBuf> = reachable_from[file]
            .iter()
            .copied()
            .filter(|other| reachable_from[*other].contains(file))
            .collect();
        described.extend(cycle.iter().copied());
        descriptions.push(describe(&cycle, &imports, folder));
    }
    descriptions
}

/// The files that can be reached from `start` by at least one import.
fn reachable<'a>(imports: &'a Imports, start: &PathBuf) -> BTreeSet<&'a PathBuf> {
    let mut reached = BTreeSet::new();
    let mut pending: Vec<&PathBuf> = imports[start].keys().collect();
    while let Some(file) = pending.pop() {
        if reached.insert(file) {
            pending.extend(imports[file].keys());
        }
    }
    reached
}

fn describe(cycle: &BTreeSet<&PathBuf>, imports: &Imports, folder: &Path) -> String {
    let short_path = |path: &PathBuf| {
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
            text.push_str(&format!(
                "\n  {} → {}: {name}",
                short_path(file),
                short_path(target)
            ));
        }
    }
    text
}
