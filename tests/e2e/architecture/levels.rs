//! Levels of the modules of a crate: the table of `ARCHITECTURE.md`, and the imports that go from a lower to a higher level.

use super::imports::Crate;
use faceoff_tests::repository;
use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

/// The levels of a crate, the lowest first, each with the names of its modules. `*` stands for all that are in no other level.
pub type Levels = Vec<BTreeSet<String>>;

/// The modules that are in no other level.
const OTHERS: &str = "*";

/// The table by crate. Its first column names the crate, its second the modules, with `→` between the levels.
pub fn table() -> BTreeMap<String, Levels> {
    let text = fs::read_to_string(repository().join("ARCHITECTURE.md"))
        .expect("ARCHITECTURE.md can be read");
    let rows = text
        .lines()
        .skip_while(|line| !line.starts_with("| crate | levels"))
        .take_while(|line| line.starts_with('|'))
        // the headings and the line below them
        .skip(2);
    rows.map(|row| {
        let mut cells = row.trim_matches('|').split('|').map(str::trim);
        let (Some(name), Some(levels)) = (cells.next(), cells.next()) else {
            panic!("a row of two cells, got {row}");
        };
        (name.trim_matches('`').to_owned(), parse(levels))
    })
    .collect()
}

/// Levels in the notation of the table.
pub fn parse(levels: &str) -> Levels {
    let modules = |level: &str| -> BTreeSet<String> {
        let names = level.split(',').map(|name| name.trim().trim_matches('`'));
        names.map(str::to_owned).collect()
    };
    levels.split('→').map(modules).collect()
}

/// Modules of the crate in `folder` that are in no level or in none of its files, and imports that go up.
pub fn violations(folder: &Path, levels: &Levels) -> Vec<String> {
    let module_of = |file: &Path| -> Option<String> {
        let first = file.strip_prefix(folder).ok()?.components().next()?;
        let name = Path::new(first.as_os_str()).file_stem()?.to_str()?;
        (!["lib", "main"].contains(&name)).then(|| name.to_owned())
    };
    let level_of = |module: &str| {
        let named = levels.iter().position(|level| level.contains(module));
        named.or_else(|| levels.iter().position(|level| level.contains(OTHERS)))
    };
    let imports = Crate::read(folder).imports();
    let modules: BTreeSet<String> = imports.keys().filter_map(|file| module_of(file)).collect();
    let mut listed: BTreeSet<String> = levels.iter().flatten().cloned().collect();
    if listed.remove(OTHERS) {
        listed.extend(modules.iter().cloned());
    }
    let mut violations: Vec<String> = modules
        .symmetric_difference(&listed)
        .map(|module| format!("{module} is a module or in the table, but not both"))
        .collect();
    for (file, targets) in &imports {
        for (target, name) in targets {
            // The root of the crate (`lib.rs`, `main.rs`) has no level.
            let (Some(from), Some(to)) = (module_of(file), module_of(target)) else {
                continue;
            };
            // A module without a level is reported above.
            let is_upward = level_of(&from)
                .zip(level_of(&to))
                .is_some_and(|(from, to)| from < to);
            if is_upward {
                let file = file.strip_prefix(folder).unwrap_or(file).display();
                violations.push(format!("{file} of {from} uses {name} of {to}"));
            }
        }
    }
    violations
}
