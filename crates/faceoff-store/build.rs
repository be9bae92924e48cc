//! Migrations and offline query data are embedded by macros, which notice a changed file but not a
//! new one.

fn main() {
    println!("cargo:rerun-if-changed=../../migrations");
    println!("cargo:rerun-if-changed=../../.sqlx");
}
