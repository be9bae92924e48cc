use std::{
    error::Error,
    io::{self, ErrorKind},
};

/// Does this error, or one that caused it, say that a disk has no room left, or its owner no more of
/// it? That is the host's doing and passes by itself; nobody's verdict follows from it.
#[must_use]
pub fn tells_of_full_disk(error: &(dyn Error + 'static)) -> bool {
    let mut next = Some(error);
    while let Some(error) = next {
        if let Some(error) = error.downcast_ref::<io::Error>() {
            if matches!(
                error.kind(),
                ErrorKind::StorageFull | ErrorKind::QuotaExceeded
            ) {
                return true;
            }
            // The source of an error that wraps another is that one's source, not that one.
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
    fn a_full_disk_is_seen_through_what_wraps_it() {
        let no_space = || io::Error::from_raw_os_error(28);
        assert!(tells_of_full_disk(&no_space()));
        assert!(tells_of_full_disk(&Copying { source: no_space() }));
        let wrapped = Copying {
            source: io::Error::other(Copying { source: no_space() }),
        };
        assert!(tells_of_full_disk(&wrapped));
        let over_quota = io::Error::from_raw_os_error(122);
        assert!(tells_of_full_disk(&over_quota));
    }

    #[test]
    fn other_failures_are_none() {
        assert!(!tells_of_full_disk(&io::Error::from_raw_os_error(5)));
        assert!(!tells_of_full_disk(&io::Error::other(
            "no space left on device"
        )));
    }
}
