//! The agent protocol as an agent's author meets it: every kind of answer, good and bad.

mod answers;
mod robustness;
mod work;
