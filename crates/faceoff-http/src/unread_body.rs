//! The part of a request's body that no handler has read, mostly that of a refused upload.
//!
//! Many clients read the response only when they have sent the whole body. If the server closed the connection before, they
//! would report a broken pipe instead of the refusal. So the response is sent at once, and then the server reads the rest
//! and discards it, within bounds. Meanwhile the connection counts in the limits of open connections, but the request no
//! longer counts as in flight.

use axum::{
    body::{Body, Bytes, HttpBody},
    extract::{Request, State},
    http::{HeaderValue, header},
    middleware::Next,
    response::Response,
};
use faceoff_service::{
    app::AppState, services::bundle_stream::discard, transfer_rate::MinTransferRate,
};
use hyper::body::{Frame, SizeHint};
use std::{
    pin::Pin,
    sync::{Arc, Mutex, PoisonError},
    task::{Context, Poll},
    time::Duration,
};
use tokio::runtime::Handle;

/// A connection stays open for further requests if at most this part of a body is unread.
const MAX_REUSED_BYTES: u64 = 256 << 10;
/// The connection is closed after this number of discarded bytes: twice the default limit of a bundle.
const MAX_DISCARDED_BYTES: u64 = 1 << 30;
/// The connection is closed when discarding takes longer.
const MAX_DURATION: Duration = Duration::from_secs(300);
/// How long a client may lag behind the minimum rate of uploads, at most. A client that sends nothing more is closed then.
const MAX_GRACE: Duration = Duration::from_secs(5);

/// Reads and discards what the handler has not read of the request's body. The response has `Connection: close` if the
/// rest is larger than [`MAX_REUSED_BYTES`], or of unknown length.
pub(crate) async fn discard_unread(
    State(app): State<Arc<AppState>>,
    request: Request,
    next: Next,
) -> Response {
    if request.body().is_end_stream() {
        return next.run(request).await;
    }
    // A client that sent `Expect: 100-continue` may not send the body at all, so the next bytes may be the body or another request.
    let is_optional = request.headers().contains_key(header::EXPECT);
    let return_slot = BodyReturnSlot::default();
    let request = request.map(|body| {
        Body::new(RequestBody {
            body,
            return_slot: return_slot.clone(),
        })
    });
    let mut response = next.run(request).await;
    let Some(body) = return_slot.take() else {
        return response;
    };
    let is_small = (body.size_hint().upper()).is_some_and(|bytes| bytes <= MAX_REUSED_BYTES);
    if is_optional || !is_small {
        let close = HeaderValue::from_static("close");
        response.headers_mut().insert(header::CONNECTION, close);
    }
    let rate = app.config.limits.min_upload_rate;
    let unread = UnreadBody {
        body,
        rate: MinTransferRate {
            grace: rate.grace.min(MAX_GRACE),
            ..rate
        },
    };
    response.map(|body| {
        Body::new(ResponseBody {
            body,
            unread: Some(unread),
        })
    })
}

/// Where a request's body is put when its handler drops it before the end.
#[derive(Debug, Clone, Default)]
struct BodyReturnSlot(Arc<Mutex<Option<Body>>>);

impl BodyReturnSlot {
    fn put(&self, body: Body) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(body);
    }

    fn take(&self) -> Option<Body> {
        (self.0.lock().unwrap_or_else(PoisonError::into_inner)).take()
    }
}

/// A request's body that returns itself when it is dropped before its end.
#[derive(Debug)]
struct RequestBody {
    body: Body,
    return_slot: BodyReturnSlot,
}

impl HttpBody for RequestBody {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        let polled = Pin::new(&mut self.body).poll_frame(context);
        if let Poll::Ready(None | Some(Err(_))) = polled {
            self.body = Body::empty();
        }
        polled
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

impl Drop for RequestBody {
    fn drop(&mut self) {
        if !self.body.is_end_stream() {
            self.return_slot.put(std::mem::take(&mut self.body));
        }
    }
}

/// The rest of a request's body.
#[derive(Debug)]
struct UnreadBody {
    body: Body,
    /// The minimum rate at which it must arrive.
    rate: MinTransferRate,
}

impl UnreadBody {
    /// Reads the rest up to the limits. If it is longer, dropping it closes the connection.
    async fn discard(self) {
        let discarded = discard(self.body, self.rate, MAX_DISCARDED_BYTES);
        // After either outcome the body is dropped.
        let _ = tokio::time::timeout(MAX_DURATION, discarded).await;
    }
}

/// The response to a request whose body is not read completely. Reading begins when the head of the response has been written:
/// earlier, hyper would ask a client with `Expect: 100-continue` for the body.
#[derive(Debug)]
struct ResponseBody {
    body: Body,
    unread: Option<UnreadBody>,
}

impl ResponseBody {
    fn start_discarding(&mut self) {
        // There is no runtime if the server has ended meanwhile.
        if let (Some(unread), Ok(runtime)) = (self.unread.take(), Handle::try_current()) {
            runtime.spawn(unread.discard());
        }
    }
}

impl HttpBody for ResponseBody {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        self.start_discarding();
        Pin::new(&mut self.body).poll_frame(context)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

impl Drop for ResponseBody {
    fn drop(&mut self) {
        self.start_discarding();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use futures::{StreamExt as _, stream};
    use std::{
        convert::Infallible,
        sync::atomic::{AtomicU64, Ordering},
    };
    use tokio::time::Instant;

    const RATE: MinTransferRate = MinTransferRate {
        bytes_per_s: 1000,
        grace: MAX_GRACE,
    };

    /// Discards a body that never ends and has `chunk_bytes` after each `pause`. Returns the read bytes and the seconds.
    async fn discard_endless(chunk_bytes: usize, pause: Duration) -> (u64, u64) {
        let chunk = Bytes::from(vec![0; chunk_bytes]);
        let read_bytes = Arc::new(AtomicU64::new(0));
        let counter = Arc::clone(&read_bytes);
        let chunks = stream::repeat(chunk).then(move |chunk| {
            counter.fetch_add(chunk.len() as u64, Ordering::Relaxed);
            async move {
                tokio::time::sleep(pause).await;
                Ok::<_, Infallible>(chunk)
            }
        });
        let unread = UnreadBody {
            body: Body::from_stream(chunks),
            rate: RATE,
        };
        let started = Instant::now();
        unread.discard().await;
        (
            read_bytes.load(Ordering::Relaxed),
            started.elapsed().as_secs(),
        )
    }

    #[tokio::test(start_paused = true)]
    async fn endless_body_is_discarded_within_limits() {
        let (read_bytes, _) = discard_endless(1 << 20, Duration::ZERO).await;
        assert_eq!(read_bytes, MAX_DISCARDED_BYTES);
        let (_, seconds) = discard_endless(2000, Duration::from_secs(1)).await;
        assert_eq!(seconds, MAX_DURATION.as_secs());
        let (_, seconds) = discard_endless(1, Duration::from_secs(1)).await;
        assert_eq!(seconds, MAX_GRACE.as_secs());
    }
}
