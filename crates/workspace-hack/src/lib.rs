//! No code: only the features of dependencies, in `Cargo.toml`, so that a build of the whole workspace compiles each crate once.
