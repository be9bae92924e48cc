//! Installation with the files in `docker/`: under systemd, and behind a TLS proxy.

mod proxies;
mod systemd_units;
