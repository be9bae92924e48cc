//! The house as `ARCHITECTURE.md` draws it: which crate may use which, and no files that import each
//! other in a circle.

mod circles;
mod imports;
mod table;

use circles::circles;
use faceoff_tests::repository;
use std::{collections::BTreeSet, fs, path::Path};

/// Crates that one member alone may use, and why it is that one.
const FOR_ONE: [(&str, &str); 4] = [
    ("rapier3d-f64", "faceoff-sim"), // the contact finder is part of the ruleset
    ("sqlx", "faceoff-store"),       // SQL lives in one crate
    ("seccompiler", "faceoff-sandbox"), // so does what confines an agent
    ("libc", "faceoff-sandbox"),
];

#[test]
fn every_crate_uses_only_what_the_table_allows() {
    let members = table::members();
    let allowed = table::allowed();
    let known: BTreeSet<&str> = members.iter().map(|member| member.name.as_str()).collect();
    let drawn: BTreeSet<&str> = allowed.keys().map(String::as_str).collect();
    assert_eq!(
        drawn, known,
        "the table of ARCHITECTURE.md names each crate once"
    );
    let mut wrong = Vec::new();
    for member in &members {
        for dependency in &member.dependencies {
            let is_ours = known.contains(dependency.as_str());
            if is_ours && !allowed[&member.name].permits(dependency) {
                wrong.push(format!("{} uses {dependency}", member.name));
            }
            if let Some((_, owner)) = FOR_ONE.iter().find(|(name, _)| name == dependency)
                && *owner != member.name
            {
                wrong.push(format!(
                    "{} uses {dependency}, which is {owner}'s",
                    member.name
                ));
            }
        }
    }
    assert!(
        wrong.is_empty(),
        "not in the table of ARCHITECTURE.md: {wrong:#?}"
    );
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    let mut found = Vec::new();
    for member in table::members() {
        found.extend(circles(&member.folder.join("src")));
    }
    assert!(
        found.is_empty(),
        "files that import each other in a circle: give what they share a file of its own\n{}",
        found.join("\n")
    );
}

/// Writes a crate and finds its circles.
fn planted(files: &[(&str, &str)]) -> Vec<String> {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    for (name, text) in files {
        let path = scratch.path().join(name);
        fs::create_dir_all(path.parent().unwrap_or(Path::new(""))).expect("a scratch folder");
        fs::write(path, text).expect("a scratch file");
    }
    circles(scratch.path())
}

#[test]
fn a_planted_circle_is_found() {
    let root = ("lib.rs", "mod a; mod b; mod c; pub use a::A; pub use b::B;");
    let direct = planted(&[
        root,
        ("a.rs", "use crate::b::B; pub struct A(B);"),
        ("b.rs", "use super::a::A; pub struct B(Option<Box<A>>);"),
        ("c.rs", "use crate::A; pub fn c(_: A) {}"),
    ]);
    assert_eq!(direct.len(), 1, "{direct:?}");
    assert!(
        direct[0].contains("a.rs") && direct[0].contains("b.rs"),
        "{direct:?}"
    );
    assert!(!direct[0].contains("c.rs"), "{direct:?}");

    let through_the_root = planted(&[
        root,
        ("a.rs", "pub struct A(crate::B);"),
        (
            "b.rs",
            "use crate::a; pub struct B; pub fn b() -> a::A { a::A(B) }",
        ),
        ("c.rs", ""),
    ]);
    assert_eq!(through_the_root.len(), 1, "{through_the_root:?}");

    let parent_and_child = planted(&[
        ("lib.rs", "mod parent;"),
        (
            "parent.rs",
            "mod child; pub struct Shared; pub fn run() { child::work(Shared) }",
        ),
        (
            "parent/child.rs",
            "use super::Shared; pub fn work(_: Shared) {}",
        ),
    ]);
    assert_eq!(parent_and_child.len(), 1, "{parent_and_child:?}");
}

#[test]
fn what_is_no_circle_is_left_alone() {
    let none = planted(&[
        ("main.rs", "mod parent; fn main() { parent::run(); }"),
        // a parent that only hands on what its children define
        ("parent/mod.rs", "mod one; mod two; pub use one::run; pub(crate) use two::Two;"),
        ("parent/one.rs", "use super::Two; pub fn run() { let _ = Two::new(); }"),
        (
            "parent/two.rs",
            "pub struct Two; impl Two { pub fn new() -> Self { Self } }
             #[cfg(test)] mod tests { use super::*; use crate::parent::run; #[test] fn t() { run() } }",
        ),
    ]);
    assert!(none.is_empty(), "{none:?}");
    assert!(repository().join("crates").is_dir());
}
