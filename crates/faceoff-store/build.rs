//! Rebuilds the crate when a migration or offline query data is added: the macros that embed them only
//! notice changed files.

fn main() {
    println!("cargo:rerun-if-changed=../../migrations");
    println!("cargo:rerun-if-changed=../../.sqlx");
}
