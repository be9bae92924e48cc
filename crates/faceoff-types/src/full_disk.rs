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

    #[derive(Debug, thiserror::Error)]
    #[error("copying: {source}")]
    struct Copying {
        source: io::Error,
    }

    #[test]
    fn full_disk_is_recognised_through_wrappers() {
        let no_space = || io::Error::from_raw_os_error(28);
        assert!(is_full_disk(&no_space()));
        assert!(is_full_disk(&Copying { source: no_space() }));
        let wrapped = Copying {
            source: io::Error::other(Copying { source: no_space() }),
        };
        assert!(is_full_disk(&wrapped));
        let over_quota = io::Error::from_raw_os_error(122);
        assert!(is_full_disk(&over_quota));
    }

    #[test]
    fn other_io_errors_are_not_full_disk() {
        assert!(!is_full_disk(&io::Error::from_raw_os_error(5)));
        assert!(!is_full_disk(&io::Error::other("no space left on device")));
    }
}
