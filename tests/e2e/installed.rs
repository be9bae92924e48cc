//! As an organiser installs it: under systemd, and behind a proxy that speaks TLS, by the files in `docker/`.

mod proxies;
mod unit;
