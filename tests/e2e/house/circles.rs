//! Files that import each other in a circle.

use super::imports::Crate;
use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

type Arrows = BTreeMap<PathBuf, BTreeMap<PathBuf, String>>;

/// A description of each circle among the files of the crate whose root lies in `folder`.
pub fn circles(folder: &Path) -> Vec<String> {
    let arrows = Crate::read(folder).arrows();
    let reach: BTreeMap<&PathBuf, BTreeSet<&PathBuf>> = arrows
        .keys()
        .map(|file| (file, reachable(&arrows, file)))
        .collect();
    let mut seen = BTreeSet::new();
    let mut found = Vec::new();
    for file in arrows.keys() {
        if seen.contains(file) || !reach[file].contains(file) {
            continue;
        }
        let circle: BTreeSet<&PathBuf> = reach[file]
            .iter()
            .copied()
            .filter(|other| reach[*other].contains(file))
            .collect();
        seen.extend(circle.iter().copied());
        found.push(describe(&circle, &arrows, folder));
    }
    found
}

/// Every file that can be reached by at least one arrow.
fn reachable<'a>(arrows: &'a Arrows, from: &PathBuf) -> BTreeSet<&'a PathBuf> {
    let mut reached = BTreeSet::new();
    let mut open: Vec<&PathBuf> = arrows[from].keys().collect();
    while let Some(file) = open.pop() {
        if reached.insert(file) {
            open.extend(arrows[file].keys());
        }
    }
    reached
}

fn describe(circle: &BTreeSet<&PathBuf>, arrows: &Arrows, folder: &Path) -> String {
    let short = |path: &PathBuf| {
        let crate_folder = folder.parent().unwrap_or(folder);
        let name = path.strip_prefix(crate_folder.parent().unwrap_or(crate_folder));
        name.unwrap_or(path).display().to_string()
    };
    let mut text = format!("a circle of {} files:", circle.len());
    for file in circle {
        for (target, name) in arrows[*file]
            .iter()
            .filter(|(target, _)| circle.contains(target))
        {
            text.push_str(&format!("\n  {} → {}: {name}", short(file), short(target)));
        }
    }
    text
}
