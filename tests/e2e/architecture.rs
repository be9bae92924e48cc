//! The rules of `ARCHITECTURE.md`: each crate uses only the crates that the table there lists for it, no module uses one of a
//! higher level of its crate, only listed modules of the platform know air hockey, and there are no import cycles (files that
//! import from each other, directly or through further files).

mod crate_table;
mod import_cycles;
mod imports;
mod levels;
mod platform_line;

use import_cycles::find_cycles;
use std::{collections::BTreeSet, fs, path::Path};

/// Dependencies that only some crates may use, each with these crates and the reason.
const RESERVED_DEPENDENCIES: [(&str, &[&str]); 4] = [
    ("rapier3d-f64", &["faceoff-sim"]), // its collision detection defines the simulated contacts
    ("sqlx", &["faceoff-store", "faceoff-types"]), // SQL lives in one crate; ids and names are columns
    ("seccompiler", &["faceoff-sandbox"]),         // the confinement of agents lives in one crate
    ("libc", &["faceoff-sandbox", "workspace-hack"]), // the latter has no code
];

#[test]
fn crates_use_only_dependencies_of_the_table() {
    let members = crate_table::members();
    let allowed = crate_table::allowed_dependencies();
    let crates: BTreeSet<&str> = members.iter().map(|member| member.name.as_str()).collect();
    let table_rows: BTreeSet<&str> = allowed.keys().map(String::as_str).collect();
    assert_eq!(
        table_rows, crates,
        "the table of ARCHITECTURE.md names each crate once"
    );
    let mut violations = Vec::new();
    for member in &members {
        for dependency in &member.dependencies {
            let is_own_crate = crates.contains(dependency.as_str());
            if is_own_crate && !allowed[&member.name].permits(dependency) {
                violations.push(format!("{} uses {dependency}", member.name));
            }
            if let Some((_, users)) = RESERVED_DEPENDENCIES
                .iter()
                .find(|(name, _)| name == dependency)
                && !users.contains(&member.name.as_str())
            {
                violations.push(format!(
                    "{} uses {dependency}, which only {} may use",
                    member.name,
                    users.join(" and ")
                ));
            }
        }
    }
    assert!(
        violations.is_empty(),
        "not allowed by the table of ARCHITECTURE.md: {violations:#?}"
    );
}

#[test]
fn source_files_have_no_import_cycles() {
    let mut cycles = Vec::new();
    for member in crate_table::members() {
        cycles.extend(find_cycles(&member.folder.join("src")));
    }
    assert!(
        cycles.is_empty(),
        "import cycles: move the shared items to a separate file\n{}",
        cycles.join("\n")
    );
}

#[test]
fn modules_use_only_their_own_and_lower_levels() {
    let table = levels::table();
    let mut violations = Vec::new();
    for member in crate_table::members() {
        if let Some(levels) = table.get(&member.name) {
            let found = levels::violations(&member.folder.join("src"), levels);
            let name = &member.name;
            violations.extend(found.iter().map(|violation| format!("{name}: {violation}")));
        }
    }
    assert!(table.len() >= 6, "the table of levels is found: {table:?}");
    assert!(
        violations.is_empty(),
        "not allowed by the levels of ARCHITECTURE.md: {violations:#?}"
    );
}

#[test]
fn only_listed_modules_of_the_platform_know_air_hockey() {
    let platform = platform_line::crates_on_side("platform");
    let air_hockey = platform_line::crates_on_side("air hockey");
    let test_crates = platform_line::crates_on_side("tests");
    let modules = platform_line::modules();
    let mut problems = Vec::new();
    for member in crate_table::members() {
        let name = &member.name;
        let sides = [&platform, &air_hockey, &test_crates];
        let side_count = sides.iter().filter(|side| side.contains(name)).count();
        assert_eq!(side_count, 1, "{name} is on one side of the line");
        let listed_modules: &[String] = modules.get(name).map_or(&[], Vec::as_slice);
        if !platform.contains(name) {
            assert!(listed_modules.is_empty(), "{name} is not of the platform");
            continue;
        }
        let findings = platform_line::findings(&member.folder.join("src"), &air_hockey);
        let is_listed = |finding: &&platform_line::Finding| {
            listed_modules.iter().any(|module| finding.is_in(module))
        };
        let unlisted = findings.iter().filter(|finding| !is_listed(finding));
        problems.extend(unlisted.map(|finding| format!("{name}: {finding}")));
        let has_no_finding =
            |module: &&String| !findings.iter().any(|finding| finding.is_in(module));
        let needlessly_listed = listed_modules.iter().filter(has_no_finding);
        problems.extend(
            needlessly_listed.map(|module| format!("{name}: {module} has no word of air hockey")),
        );
        // A dependency on a crate of air hockey must be used in a module, where the findings above show it.
        let is_used = |dependency: &str| {
            let name = dependency.replace('-', "_");
            findings.iter().any(|finding| finding.word == name)
        };
        let unused = member
            .dependencies
            .iter()
            .filter(|dependency| air_hockey.contains(*dependency) && !is_used(dependency));
        problems.extend(unused.map(|dependency| format!("{name} depends on {dependency}")));
    }
    let unknown = modules.keys().filter(|name| !platform.contains(*name));
    problems.extend(unknown.map(|name| format!("{name} is no crate of the platform")));
    assert!(
        problems.is_empty(),
        "not as the tables of ARCHITECTURE.md have it: {problems:#?}"
    );
}

#[test]
fn word_and_crate_of_air_hockey_are_found() {
    let crates = ["faceoff-sim".to_owned()].into();
    let findings =
        |name, text: &str| platform_line::findings(write_crate(&[(name, text)]).path(), &crates);
    let words = |text: &str| -> Vec<String> {
        let found = findings("lib.rs", text);
        found.iter().map(ToString::to_string).collect()
    };
    assert_eq!(words("pub enum Task { Hit }"), ["\"hit\" in lib.rs"]);
    assert_eq!(words("pub fn joint_pos() {}"), ["\"joint\" in lib.rs"]);
    assert_eq!(
        words("pub const TITLE: &str = \"Goals\";"),
        ["\"goals\" in lib.rs"]
    );
    assert_eq!(
        words("pub fn log() { println!(\"a puck\"); }"),
        ["\"puck\" in lib.rs"]
    );
    assert_eq!(
        words("#[cfg(feature = \"prepare\")] pub fn f() {}"),
        ["\"prepare\" in lib.rs"]
    );
    assert_eq!(
        words("use faceoff_sim::World; pub fn f(_: faceoff_types::Task) {}"),
        ["\"faceoff_sim\" in lib.rs"]
    );
    assert_eq!(
        words("pub fn f() { println!(\"{}\", faceoff_sim::fingerprint()); }"),
        ["\"faceoff_sim\" in lib.rs"]
    );
    let allowed = "/// A comment on the puck.
        pub fn whitelist() {}
        #[cfg(test)] mod tests { fn hit() {} }";
    assert_eq!(words(allowed), [""; 0]);
    let with_test_module = write_crate(&[
        ("lib.rs", "mod a; #[cfg(test)] mod b;"),
        ("a.rs", "#[cfg(test)] mod c; mod d;"),
        ("a/c.rs", "fn hit() {}"),
        ("a/d.rs", "fn puck() {}"),
        ("b.rs", "fn goal() {}"),
    ]);
    let found = platform_line::findings(with_test_module.path(), &crates);
    let found: Vec<String> = found.iter().map(ToString::to_string).collect();
    assert_eq!(found, ["\"puck\" in a/d.rs"]);
    let [finding] = &findings("game/live.rs", "pub fn foul() {}")[..] else {
        panic!("one word");
    };
    assert!(finding.is_in("game") && finding.is_in("game/live"));
    assert!(!finding.is_in("game/li") && !finding.is_in("live"));
}

#[test]
fn import_of_a_higher_level_is_found() {
    let files = [
        ("lib.rs", "mod rows; mod pages; mod views;"),
        ("rows.rs", "use crate::views::View; pub struct Row(View);"),
        ("views/mod.rs", "mod clips; pub struct View;"),
        (
            "views/clips.rs",
            "use crate::rows::Row; pub struct Clip(Row);",
        ),
        (
            "pages.rs",
            "use crate::views::View; pub fn page(_: View) {}",
        ),
    ];
    let scratch = write_crate(&files);
    let violations = |levels| levels::violations(scratch.path(), &levels::parse(levels));
    let upward = ["rows.rs of rows uses crate::views::View of views"];
    assert_eq!(violations("`rows` → `views` → `pages`"), upward);
    assert_eq!(violations("`rows`, `views` → `pages`"), [""; 0]);
    let unlisted = violations("`rows`, `views`, `boards`");
    assert_eq!(unlisted.len(), 2, "{unlisted:?}");
    // `*` stands for all modules that are in no other level: here `pages` and `views`.
    assert_eq!(violations("`rows` → *"), upward);
}

/// Writes the files (name and content) of a crate.
fn write_crate(files: &[(&str, &str)]) -> tempfile::TempDir {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    for (name, text) in files {
        let path = scratch.path().join(name);
        fs::create_dir_all(path.parent().unwrap_or(Path::new(""))).expect("a scratch folder");
        fs::write(path, text).expect("a scratch file");
    }
    scratch
}

/// Descriptions of the import cycles of a crate with these files.
fn cycles_of(files: &[(&str, &str)]) -> Vec<String> {
    find_cycles(write_crate(files).path())
}

#[test]
fn import_cycle_is_found() {
    let root = ("lib.rs", "mod a; mod b; mod c; pub use a::A; pub use b::B;");
    let direct = cycles_of(&[
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

    let through_root = cycles_of(&[
        root,
        ("a.rs", "pub struct A(crate::B);"),
        (
            "b.rs",
            "use crate::a; pub struct B; pub fn b() -> a::A { a::A(B) }",
        ),
        ("c.rs", ""),
    ]);
    assert_eq!(through_root.len(), 1, "{through_root:?}");

    let parent_and_child = cycles_of(&[
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
fn re_exports_and_tests_are_no_import_cycle() {
    let cycles = cycles_of(&[
        ("main.rs", "mod parent; fn main() { parent::run(); }"),
        // A parent that only re-exports items of its children is in no cycle with them.
        ("parent/mod.rs", "mod one; mod two; pub use one::run; pub(crate) use two::Two;"),
        ("parent/one.rs", "use super::Two; pub fn run() { let _ = Two::new(); }"),
        (
            "parent/two.rs",
            "pub struct Two; impl Two { pub fn new() -> Self { Self } }
             #[cfg(test)] mod tests { use super::*; use crate::parent::run; #[test] fn t() { run() } }",
        ),
    ]);
    assert!(cycles.is_empty(), "{cycles:?}");
}
