//! Recognition of errors that mean a full disk.

use std::{
    error::Error,
    io::{self, ErrorKind},
};

/// Is this error, or one of its causes, a full disk or an exhausted disk quota? Such a condition belongs to the
/// host and is temporary, so it is never an agent fault.
#[must_use]
pub fn is_full_disk(error: &(dyn Error + 'static)) -> bool {
    let mut next = Some(error);
    while let Some(error) = next {
        if let Some(error) = error.downcast_ref::<io::Error>() {
            if matches!(
                error.kind(),
                ErrorKind::StorageFull | ErrorKind::QuotaExceeded
            ) {
                return true;
            }
            // `source()` of a wrapping `io::Error` skips the wrapped error itself.
            if let Some(wrapped) = error.get_ref() {
                next = Some(wrapped);
                continue;
            }
        }
        next = error.source();
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    // Linux error numbers.
    const EIO: i32 = 5;
    const ENOSPC: i32 = 28;
    const EDQUOT: i32 = 122;

    #[derive(Debug, thiserror::Error)]
    #[error("copying: {source}")]
    struct CopyError {
        source: io::Error,
    }

    #[test]
    fn full_disk_is_recognised_through_wrappers() {
        let no_space = || io::Error::from_raw_os_error(ENOSPC);
        assert!(is_full_disk(&no_space()));
        assert!(is_full_disk(&CopyError { source: no_space() }));
        let wrapped = CopyError {
            source: io::Error::other(CopyError { source: no_space() }),
        };
        assert!(is_full_disk(&wrapped));
        let over_quota = io::Error::from_raw_os_error(EDQUOT);
        assert!(is_full_disk(&over_quota));
    }

    #[test]
    fn other_io_errors_are_not_full_disk() {
        assert!(!is_full_disk(&io::Error::from_raw_os_error(EIO)));
        assert!(!is_full_disk(&io::Error::other("no space left on device")));
    }
}
