use super::*;
use crate::remote::order_files::OrderFiles;
use faceoff_types::BundleRef;
use std::{
    path::{Path, PathBuf},
    sync::atomic::{AtomicBool, AtomicU32, Ordering},
};
use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _},
    net::{TcpListener, TcpSocket, TcpStream},
};

fn carrier(patience: Patience) -> Carrier {
    let nobody = rustls::ClientConfig::builder()
        .with_root_certificates(rustls::RootCertStore::empty())
        .with_no_client_auth();
    let http = Client::builder()
        .no_proxy()
        .tls_backend_preconfigured(nobody);
    Carrier {
        http: http.build().unwrap(),
        patience,
    }
}

/// Whoever is tried again is at once.
fn restless() -> Patience {
    Patience {
        rest: Duration::ZERO,
        longest_rest: Duration::ZERO,
        // However slow the machine.
        still: Duration::from_secs(3600),
        away: Duration::from_secs(3600),
        ..Patience::default()
    }
}

fn wanted() -> bool {
    false
}

#[tokio::test(start_paused = true)]
async fn what_is_slow_but_moves_takes_as_long_as_it_takes() {
    let tries = AtomicU32::new(0);
    let by = carrier(Patience::default());
    let carried = by.carry(
        async |_, moved| {
            tries.fetch_add(1, Ordering::Relaxed);
            for _ in 0..20 {
                sleep(Duration::from_secs(50)).await;
                moved.add(1);
            }
            Ok(())
        },
        wanted,
    );
    carried.await.unwrap();
    assert_eq!(tries.into_inner(), 1);
}

#[tokio::test(start_paused = true)]
async fn what_was_handed_over_may_be_on_its_way_for_a_while() {
    let by = carrier(Patience::default());
    let carried = by.carry(
        async |_, moved| {
            let bytes = 4 << 20;
            moved.of(bytes);
            moved.add(bytes as usize);
            // Over a link of 128 kbit/s.
            sleep(Duration::from_secs(bytes / SLOWEST_BYTES_PER_S)).await;
            Ok(())
        },
        wanted,
    );
    carried.await.unwrap();
}

#[tokio::test(start_paused = true)]
async fn what_stands_still_is_tried_once_more() {
    let tries = AtomicU32::new(0);
    let by = carrier(Patience::default());
    let carried = by.carry(
        async |_, _| {
            tries.fetch_add(1, Ordering::Relaxed);
            std::future::pending().await
        },
        wanted,
    );
    let error = carried.await.unwrap_err();
    assert_eq!(error.to_string(), "nothing has moved for 60 s");
    assert_eq!(tries.into_inner(), 2);
}

#[tokio::test(start_paused = true)]
async fn nothing_is_waited_for_once_the_order_has_ended() {
    let has_ended = AtomicBool::new(false);
    let by = carrier(Patience::default());
    let carried = by.carry(
        async |_, moved| {
            moved.add(1);
            sleep(Duration::from_secs(1)).await;
            has_ended.store(true, Ordering::Relaxed);
            std::future::pending().await
        },
        || has_ended.load(Ordering::Relaxed),
    );
    assert!(carried.await.unwrap_err().is::<Ended>());
}

#[tokio::test(start_paused = true)]
async fn what_has_no_time_is_asked_for_a_minute_and_as_seldom_as_it_asks() {
    for (retry_after, rests_s) in [(None, 2), (Some(10), 10), (Some(3600), 30)] {
        let (began, tries) = (Instant::now(), AtomicU32::new(0));
        let by = carrier(Patience::default());
        let carried = by.carry(
            async |_, _| {
                tries.fetch_add(1, Ordering::Relaxed);
                Err(Unfinished::Busy {
                    status: StatusCode::SERVICE_UNAVAILABLE,
                    retry_after: retry_after.map(Duration::from_secs),
                }
                .into())
            },
            wanted,
        );
        let error = carried.await.unwrap_err();
        assert_eq!(
            error.to_string(),
            "the server answered 503 Service Unavailable"
        );
        assert_eq!(tries.into_inner(), 60 / rests_s + 1);
        // Of the clock that only this test turns.
        assert_eq!(began.elapsed().as_secs(), 60);
    }
}

/// Where `listener` is reached, and what opens it.
fn files(listener: &TcpListener) -> OrderFiles {
    OrderFiles {
        grant: "grant".into(),
        server: format!("http://{}", listener.local_addr().unwrap()),
        objects: None,
    }
}

async fn listener() -> TcpListener {
    TcpListener::bind(("127.0.0.1", 0)).await.unwrap()
}

fn file(folder: &tempfile::TempDir, bytes: u64) -> PathBuf {
    let path = folder.path().join("steps.parquet");
    let file = std::fs::File::create(&path).unwrap();
    file.set_len(bytes).unwrap();
    path
}

/// Reads what comes before the body.
async fn head(connection: &mut TcpStream) -> String {
    let mut head = Vec::new();
    while !head.ends_with(b"\r\n\r\n") {
        head.push(connection.read_u8().await.unwrap());
    }
    String::from_utf8(head).unwrap()
}

async fn body(connection: &mut TcpStream, bytes: u64) {
    let read = tokio::io::copy(&mut connection.take(bytes), &mut tokio::io::sink()).await;
    assert_eq!(read.unwrap(), bytes);
}

async fn answer(mut connection: TcpStream, words: &str) {
    let answer = format!("HTTP/1.1 {words}\r\nconnection: close\r\n\r\n");
    connection.write_all(answer.as_bytes()).await.unwrap();
    connection.shutdown().await.unwrap();
}

#[tokio::test]
async fn a_file_is_sent_again_to_whoever_has_no_time_and_after_a_break() {
    const BYTES: u64 = 100_000;
    let folder = tempfile::tempdir().unwrap();
    let (path, listener) = (file(&folder, BYTES), listener().await);
    let (files, by) = (files(&listener), carrier(restless()));
    let serves = async {
        for words in [
            "408 Request Timeout",
            "500 Internal Server Error",
            "429 Too Many Requests\r\nretry-after: 3600",
            "502 Bad Gateway",
        ] {
            let (mut connection, _) = listener.accept().await.unwrap();
            let head = head(&mut connection).await;
            assert!(
                head.starts_with("PUT /work/files/steps.parquet HTTP/1.1"),
                "{head}"
            );
            assert!(head.contains("authorization: Grant grant"), "{head}");
            body(&mut connection, BYTES).await;
            answer(connection, words).await;
        }
        // In the middle.
        let (mut connection, _) = listener.accept().await.unwrap();
        head(&mut connection).await;
        body(&mut connection, BYTES / 2).await;
        drop(connection);
        let (mut connection, _) = listener.accept().await.unwrap();
        head(&mut connection).await;
        body(&mut connection, BYTES).await;
        answer(connection, "204 No Content").await;
    };
    let stored = files.store(&by, "steps.parquet", &path, wanted);
    let (stored, ()) = tokio::join!(stored, serves);
    stored.unwrap();
}

#[tokio::test]
async fn what_breaks_again_and_again_in_the_middle_is_given_up() {
    let folder = tempfile::tempdir().unwrap();
    let (path, listener) = (file(&folder, 64 << 20), listener().await);
    let (files, by) = (files(&listener), carrier(restless()));
    let serves = async {
        for _ in 0..by.patience.most_broken {
            let (mut connection, _) = listener.accept().await.unwrap();
            head(&mut connection).await;
            body(&mut connection, 1000).await;
        }
    };
    let stored = files.store(&by, "steps.parquet", &path, wanted);
    let (stored, ()) = tokio::join!(stored, serves);
    assert!(is_lost(&stored.unwrap_err()));
}

#[tokio::test]
async fn what_is_refused_is_asked_for_once() {
    let folder = tempfile::tempdir().unwrap();
    let listener = listener().await;
    let (files, by) = (files(&listener), carrier(restless()));
    let bundle = BundleRef {
        key: "bundles/x".into(),
        bytes: 1,
        blake3: "00".into(),
        file_name: "agent.tar.gz".into(),
    };
    let serves = async {
        for (words, told) in [
            ("403 Forbidden", "the server answered 403 Forbidden"),
            ("507 Insufficient Storage", "no storage space"),
        ] {
            let archive: &Path = &folder.path().join("agent.tar.gz");
            let (fetched, ()) =
                tokio::join!(files.fetch_bundle(&by, &bundle, archive, wanted), async {
                    let (mut connection, _) = listener.accept().await.unwrap();
                    head(&mut connection).await;
                    answer(connection, words).await;
                });
            let error = format!("{:#}", fetched.unwrap_err());
            assert!(error.contains(told), "{error}");
        }
    };
    serves.await;
}

/// A link so slow that all of a file takes far longer than anything of it may stand still. Time passes only when this test says so: after
/// so much was received that some of it was handed over since.
#[tokio::test(start_paused = true)]
async fn a_file_over_a_slow_link_is_stored_by_one_try() {
    /// More than all buffers on the way hold.
    const PIECE: u64 = 48 << 20;
    const PIECES: u64 = 4;
    let (hold, held) = std::sync::mpsc::channel::<()>();
    // While a thread is waited for, the clock does not run by itself.
    let holds = tokio::task::spawn_blocking(move || held.recv());
    let folder = tempfile::tempdir().unwrap();
    let socket = TcpSocket::new_v4().unwrap();
    socket.set_recv_buffer_size(1 << 16).unwrap();
    socket.bind(([127, 0, 0, 1], 0).into()).unwrap();
    let listener = socket.listen(1).unwrap();
    let (path, files) = (file(&folder, PIECES * PIECE), files(&listener));
    let by = carrier(Patience::default());
    let began = Instant::now();
    let serves = async {
        let (mut connection, _) = listener.accept().await.unwrap();
        head(&mut connection).await;
        for _ in 0..PIECES {
            body(&mut connection, PIECE).await;
            tokio::time::advance(by.patience.still * 2 / 3).await;
        }
        answer(connection, "204 No Content").await;
    };
    let stored = files.store(&by, "steps.parquet", &path, wanted);
    let (stored, ()) = tokio::join!(stored, serves);
    stored.unwrap();
    assert!(began.elapsed() > by.patience.still * 2);
    drop(hold);
    assert!(holds.await.unwrap().is_err());
}
