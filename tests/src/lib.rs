//! End-to-end tests of Faceoff.
