//! Installation with the files in the folder `docker`: as systemd services, and behind a proxy that speaks TLS.

mod proxies;
mod systemd_units;
