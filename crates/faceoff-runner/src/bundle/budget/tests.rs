//! Tests of the budget's own failures: timeout, cancellation, and limits that are too large for an archive in a test.

use super::*;

const LIMITS: BundleLimits = BundleLimits {
    packed_bytes: 1000,
    unpacked_bytes: 1000,
    files: 10,
    unpack_s: 60,
};

#[test]
fn timeout_is_a_platform_fault_and_cancellation_is_none() {
    let start = Instant::now();
    let elapsed = Cell::new(Duration::ZERO);
    let cancelled = Cell::new(false);
    let (now, is_cancelled) = (|| start + elapsed.get(), || cancelled.get());
    let budget = Budget::new(&LIMITS, &now, &is_cancelled);
    let mut reader = MeteredReader::new(io::repeat(0).take(100), &budget);
    elapsed.set(Duration::from_secs(60));
    assert_eq!(reader.read(&mut [0; 10]).unwrap(), 10);
    elapsed.set(Duration::from_secs(61));
    let read_error = reader.read(&mut [0; 10]).unwrap_err();
    // The budget's failure is reported, even if a library replaces the error.
    let result: Result<(), _> =
        budget.prefer_own_failure(Err(BundleError::from_read_error("x")(read_error)));
    assert!(
        matches!(&result, Err(BundleError::Io(error)) if error.kind() == io::ErrorKind::TimedOut),
        "{result:?}"
    );

    elapsed.set(Duration::ZERO);
    let budget = Budget::new(&LIMITS, &now, &is_cancelled);
    budget.count_entry().unwrap();
    cancelled.set(true);
    let result = budget.prefer_own_failure(budget.count_entry());
    assert!(matches!(result, Err(BundleError::Cancelled)), "{result:?}");
}

#[test]
fn links_with_short_names_are_counted() {
    let (now, never) = (Instant::now, || false);
    let budget = Budget::new(&LIMITS, &now, &never);
    // Each name counts as EXTRA_BYTES_PER_NAME more bytes, so after this name exactly one empty name fits.
    let bytes_before_limit = usize::try_from(MAX_LINK_BYTES - 2 * EXTRA_BYTES_PER_NAME).unwrap();
    budget.count_link_bytes(bytes_before_limit).unwrap();
    budget.count_link_bytes(0).unwrap();
    let message = budget
        .prefer_own_failure(budget.count_link_bytes(0))
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("lead through too many others"),
        "{message}"
    );
}

#[test]
fn bytes_that_no_file_explains_are_limited() {
    let (now, never) = (Instant::now, || false);
    let budget = Budget::new(&LIMITS, &now, &never);
    // No file explains these bytes, so all of them are overhead, such as headers and padding.
    let mut reader = MeteredReader::new(io::repeat(0), &budget);
    let read_error = io::copy(&mut reader, &mut io::sink()).unwrap_err();
    let result = budget.prefer_own_failure(Err::<(), _>(BundleError::from_archive_read_error(
        read_error,
    )));
    let BundleError::Invalid(message) = result.unwrap_err() else {
        panic!("expected a refusal of the archive");
    };
    assert!(message.contains("than its files explain"), "{message}");
    assert!(budget.read_bytes.get() < OVERHEAD_BYTES + (1 << 20));
}
