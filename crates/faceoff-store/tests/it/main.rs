//! The store on real SQLite files and real artifact folders.

mod competition;
mod fixture;
