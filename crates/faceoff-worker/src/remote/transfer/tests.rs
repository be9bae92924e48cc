//! Tests of file transfers: timeouts by tokio's paused clock, and retries against an HTTP server of a few lines.

use super::*;
use crate::remote::job_files::JobFiles;
use faceoff_types::BundleRef;
use std::{
    path::{Path, PathBuf},
    sync::atomic::{AtomicBool, AtomicU32, Ordering},
};
use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _},
    net::{TcpListener, TcpSocket, TcpStream},
};

fn file_transfer(timeouts: TransferTimeouts) -> FileTransfer {
    let no_roots = rustls::ClientConfig::builder()
        .with_root_certificates(rustls::RootCertStore::empty())
        .with_no_client_auth();
    let http = Client::builder()
        .no_proxy()
        .tls_backend_preconfigured(no_roots);
    FileTransfer {
        http: http.build().unwrap(),
        timeouts,
    }
}

/// Timeouts with immediate retries.
fn immediate_retries() -> TransferTimeouts {
    TransferTimeouts {
        retry_delay: Duration::ZERO,
        max_retry_delay: Duration::ZERO,
        // Independent of the speed of the machine.
        stall_timeout: Duration::from_secs(3600),
        retry_timeout: Duration::from_secs(3600),
        ..TransferTimeouts::default()
    }
}

/// For `has_ended`: the job goes on for the whole test.
fn job_never_ends() -> bool {
    false
}

#[tokio::test(start_paused = true)]
async fn slow_transfer_with_progress_has_no_time_limit() {
    let attempts = AtomicU32::new(0);
    let transfer = file_transfer(TransferTimeouts::default());
    let result = transfer.run(
        async |_, progress| {
            attempts.fetch_add(1, Ordering::Relaxed);
            for _ in 0..20 {
                // Shorter than the stall timeout of 60 s.
                sleep(Duration::from_secs(50)).await;
                progress.add(1);
            }
            Ok(())
        },
        job_never_ends,
    );
    result.await.unwrap();
    assert_eq!(attempts.into_inner(), 1);
}

#[tokio::test(start_paused = true)]
async fn buffered_data_extends_the_stall_timeout() {
    let transfer = file_transfer(TransferTimeouts::default());
    let result = transfer.run(
        async |_, progress| {
            let bytes = 4 << 20;
            progress.set_total(bytes);
            progress.add(bytes as usize);
            // The time that the slowest supported link needs.
            sleep(Duration::from_secs(bytes / SLOWEST_BYTES_PER_S)).await;
            Ok(())
        },
        job_never_ends,
    );
    result.await.unwrap();
}

#[tokio::test(start_paused = true)]
async fn stalled_transfer_is_retried_once() {
    let attempts = AtomicU32::new(0);
    let transfer = file_transfer(TransferTimeouts::default());
    let result = transfer.run(
        async |_, _| {
            attempts.fetch_add(1, Ordering::Relaxed);
            std::future::pending().await
        },
        job_never_ends,
    );
    let error = result.await.unwrap_err();
    assert_eq!(error.to_string(), "no progress for 60 s");
    assert_eq!(attempts.into_inner(), 2);
}

#[tokio::test(start_paused = true)]
async fn transfer_stops_when_the_job_has_ended() {
    let has_ended = AtomicBool::new(false);
    let transfer = file_transfer(TransferTimeouts::default());
    let result = transfer.run(
        async |_, progress| {
            progress.add(1);
            sleep(Duration::from_secs(1)).await;
            has_ended.store(true, Ordering::Relaxed);
            std::future::pending().await
        },
        || has_ended.load(Ordering::Relaxed),
    );
    assert!(result.await.unwrap_err().is::<JobEnded>());
}

#[tokio::test(start_paused = true)]
async fn busy_server_is_retried_for_a_minute() {
    for (retry_after_s, expected_delay_s) in [(None, 2), (Some(10), 10), (Some(3600), 30)] {
        let (started_at, attempts) = (Instant::now(), AtomicU32::new(0));
        let transfer = file_transfer(TransferTimeouts::default());
        let result = transfer.run(
            async |_, _| {
                attempts.fetch_add(1, Ordering::Relaxed);
                Err(TransientError::Busy {
                    status: StatusCode::SERVICE_UNAVAILABLE,
                    retry_after: retry_after_s.map(Duration::from_secs),
                }
                .into())
            },
            job_never_ends,
        );
        let error = result.await.unwrap_err();
        assert_eq!(
            error.to_string(),
            "the server answered 503 Service Unavailable"
        );
        assert_eq!(attempts.into_inner(), 60 / expected_delay_s + 1);
        // By tokio's paused clock.
        assert_eq!(started_at.elapsed().as_secs(), 60);
    }
}

/// Access to the files of the server at `listener`.
fn job_files(listener: &TcpListener) -> JobFiles {
    JobFiles {
        grant: "grant".into(),
        files_url: format!("http://{}", listener.local_addr().unwrap()),
        objects: None,
    }
}

async fn listener() -> TcpListener {
    TcpListener::bind(("127.0.0.1", 0)).await.unwrap()
}

/// Creates a file of this size.
fn create_file(folder: &tempfile::TempDir, bytes: u64) -> PathBuf {
    let path = folder.path().join("steps.parquet");
    let file = std::fs::File::create(&path).unwrap();
    file.set_len(bytes).unwrap();
    path
}

/// Accepts a connection and reads the head of its HTTP request.
async fn accept(listener: &TcpListener) -> (TcpStream, String) {
    let (mut connection, _) = listener.accept().await.unwrap();
    let mut head = Vec::new();
    while !head.ends_with(b"\r\n\r\n") {
        head.push(connection.read_u8().await.unwrap());
    }
    (connection, String::from_utf8(head).unwrap())
}

/// Reads this part of the body of an HTTP request.
async fn read_body(connection: &mut TcpStream, bytes: u64) {
    let read = tokio::io::copy(&mut connection.take(bytes), &mut tokio::io::sink()).await;
    assert_eq!(read.unwrap(), bytes);
}

async fn respond(mut connection: TcpStream, status: &str) {
    let response = format!("HTTP/1.1 {status}\r\nconnection: close\r\n\r\n");
    connection.write_all(response.as_bytes()).await.unwrap();
    connection.shutdown().await.unwrap();
}

#[tokio::test]
async fn upload_is_retried_after_transient_errors() {
    const BYTES: u64 = 100_000;
    let folder = tempfile::tempdir().unwrap();
    let (path, listener) = (create_file(&folder, BYTES), listener().await);
    let (files, transfer) = (job_files(&listener), file_transfer(immediate_retries()));
    let server = async {
        for status in [
            "408 Request Timeout",
            "500 Internal Server Error",
            "429 Too Many Requests\r\nretry-after: 3600",
            "502 Bad Gateway",
        ] {
            let (mut connection, head) = accept(&listener).await;
            assert!(
                head.starts_with("PUT /work/files/steps.parquet HTTP/1.1"),
                "{head}"
            );
            assert!(head.contains("authorization: Grant grant"), "{head}");
            read_body(&mut connection, BYTES).await;
            respond(connection, status).await;
        }
        // An interruption in the middle of the body.
        let (mut connection, _) = accept(&listener).await;
        read_body(&mut connection, BYTES / 2).await;
        drop(connection);
        let (mut connection, _) = accept(&listener).await;
        read_body(&mut connection, BYTES).await;
        respond(connection, "204 No Content").await;
    };
    let stored = files.store(&transfer, "steps.parquet", &path, job_never_ends);
    let (stored, ()) = tokio::join!(stored, server);
    stored.unwrap();
}

#[tokio::test]
async fn upload_is_given_up_after_many_interruptions() {
    let folder = tempfile::tempdir().unwrap();
    let (path, listener) = (create_file(&folder, 64 << 20), listener().await);
    let (files, transfer) = (job_files(&listener), file_transfer(immediate_retries()));
    let server = async {
        for _ in 0..transfer.timeouts.max_interrupted {
            let (mut connection, _) = accept(&listener).await;
            read_body(&mut connection, 1000).await;
        }
    };
    let stored = files.store(&transfer, "steps.parquet", &path, job_never_ends);
    let (stored, ()) = tokio::join!(stored, server);
    assert!(is_connection_error(&stored.unwrap_err()));
}

#[tokio::test]
async fn refused_download_is_not_retried() {
    let folder = tempfile::tempdir().unwrap();
    let listener = listener().await;
    let (files, transfer) = (job_files(&listener), file_transfer(immediate_retries()));
    let bundle = BundleRef {
        key: "bundles/x".into(),
        bytes: 1,
        blake3: "00".into(),
        file_name: "agent.tar.gz".into(),
    };
    let server = async {
        for (status, message) in [
            ("403 Forbidden", "the server answered 403 Forbidden"),
            ("507 Insufficient Storage", "no storage space"),
        ] {
            let archive: &Path = &folder.path().join("agent.tar.gz");
            let (fetched, ()) = tokio::join!(
                files.fetch_bundle(&transfer, &bundle, archive, job_never_ends),
                async {
                    let (connection, _) = accept(&listener).await;
                    respond(connection, status).await;
                }
            );
            let error = format!("{:#}", fetched.unwrap_err());
            assert!(error.contains(message), "{error}");
        }
    };
    server.await;
}

/// Over this slow link the whole file takes far longer than the stall timeout. The test advances the clock only after it has
/// received so much data that the sender has made progress since.
#[tokio::test(start_paused = true)]
async fn upload_over_a_slow_link_needs_one_attempt() {
    /// More than all buffers on the way can hold.
    const PIECE: u64 = 48 << 20;
    const PIECES: u64 = 4;
    let (test_running, test_ended) = std::sync::mpsc::channel::<()>();
    // A blocking task keeps tokio's paused clock from advancing automatically.
    let blocking_task = tokio::task::spawn_blocking(move || test_ended.recv());
    let folder = tempfile::tempdir().unwrap();
    let socket = TcpSocket::new_v4().unwrap();
    socket.set_recv_buffer_size(1 << 16).unwrap();
    socket.bind(([127, 0, 0, 1], 0).into()).unwrap();
    let listener = socket.listen(1).unwrap();
    let (path, files) = (create_file(&folder, PIECES * PIECE), job_files(&listener));
    let transfer = file_transfer(TransferTimeouts::default());
    let started_at = Instant::now();
    let server = async {
        let (mut connection, _) = accept(&listener).await;
        for _ in 0..PIECES {
            read_body(&mut connection, PIECE).await;
            tokio::time::advance(transfer.timeouts.stall_timeout * 2 / 3).await;
        }
        respond(connection, "204 No Content").await;
    };
    let stored = files.store(&transfer, "steps.parquet", &path, job_never_ends);
    let (stored, ()) = tokio::join!(stored, server);
    stored.unwrap();
    assert!(started_at.elapsed() > transfer.timeouts.stall_timeout * 2);
    drop(test_running);
    assert!(blocking_task.await.unwrap().is_err());
}
