//! Rebuilds the crate when a migration or offline query data is added, or when the types of columns change: the macros that read them
//! only notice changed files.

fn main() {
    println!("cargo:rerun-if-changed=../../migrations");
    println!("cargo:rerun-if-changed=../../.sqlx");
    println!("cargo:rerun-if-changed=sqlx.toml");
}
