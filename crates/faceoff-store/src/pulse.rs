use jiff::Timestamp;
use std::sync::atomic::AtomicI64;
use tokio::sync::Mutex;

/// What was last seen of work and database.
#[derive(Debug)]
pub(crate) struct Pulse {
    /// When a worker last looked for work, and could; milliseconds since 1970.
    pub(crate) looked_at: AtomicI64,
    /// When it was last tried to write the database, and whether that went well.
    pub(crate) probed: Mutex<Option<(Timestamp, bool)>>,
}

impl Pulse {
    pub(crate) const fn new() -> Self {
        Self {
            looked_at: AtomicI64::new(i64::MIN),
            probed: Mutex::const_new(None),
        }
    }
}
