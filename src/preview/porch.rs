//! Connections before they are a viewer's: few, and not for long.
//!
//! Anybody who reaches the port can open connections, token or not, and each takes one of the files that the process
//! may have open. What a render keeps must never lack one for that.

use crate::poison::Unpoisoned as _;
use axum::extract::connect_info::Connected;
use axum::serve::{IncomingStream, Listener};
use std::future::Future;
use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::Sleep;

/// Connections that are nobody's yet; more wait in the system's queue, where they cost no file.
const MAX_STRANGERS: usize = 16;
/// Time that a connection may take to ask for something and become a viewer's.
const PATIENCE: Duration = Duration::from_secs(10);

/// Accepts connections as long as there are places.
pub(super) struct Porch {
    listener: TcpListener,
    places: Arc<Semaphore>,
    patience: Duration,
}

impl Porch {
    pub(super) fn before(listener: TcpListener) -> Self {
        Self { listener, places: Arc::new(Semaphore::new(MAX_STRANGERS)), patience: PATIENCE }
    }
}

impl Listener for Porch {
    type Io = Guarded;
    type Addr = SocketAddr;

    async fn accept(&mut self) -> (Guarded, SocketAddr) {
        // Nobody closes the semaphore.
        let place = Arc::clone(&self.places).acquire_owned().await.ok();
        let (stream, address) = Listener::accept(&mut self.listener).await;
        let waiting = Waiting { _place: place, until: Box::pin(tokio::time::sleep(self.patience)) };
        (Guarded { stream, stranger: Stranger(Arc::new(Mutex::new(Some(waiting)))) }, address)
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }
}

/// A place on the porch, and until when.
struct Waiting {
    _place: Option<OwnedSemaphorePermit>,
    until: Pin<Box<Sleep>>,
}

/// Who is behind a connection, as its requests know it.
#[derive(Clone)]
pub(super) struct Stranger(Arc<Mutex<Option<Waiting>>>);

impl Stranger {
    /// Makes the connection a viewer's from here on: it may stay, and its place is free.
    pub(super) fn let_in(&self) {
        *self.0.lock().unpoisoned() = None;
    }

    fn is_too_late(&self, context: &mut Context<'_>) -> bool {
        let mut waiting = self.0.lock().unpoisoned();
        waiting.as_mut().is_some_and(|waiting| waiting.until.as_mut().poll(context).is_ready())
    }
}

impl Connected<IncomingStream<'_, Porch>> for Stranger {
    fn connect_info(stream: IncomingStream<'_, Porch>) -> Self {
        stream.io().stranger.clone()
    }
}

/// A connection that fails once its stranger has waited for too long.
pub(super) struct Guarded {
    stream: TcpStream,
    stranger: Stranger,
}

impl Guarded {
    /// What the stream makes of it, while there is time.
    fn in_time<T>(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        act: impl FnOnce(Pin<&mut TcpStream>, &mut Context<'_>) -> Poll<io::Result<T>>,
    ) -> Poll<io::Result<T>> {
        if self.stranger.is_too_late(context) {
            return Poll::Ready(Err(io::ErrorKind::TimedOut.into()));
        }
        act(Pin::new(&mut self.stream), context)
    }
}

impl AsyncRead for Guarded {
    fn poll_read(self: Pin<&mut Self>, context: &mut Context<'_>, bytes: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        self.in_time(context, |stream, context| stream.poll_read(context, bytes))
    }
}

impl AsyncWrite for Guarded {
    fn poll_write(self: Pin<&mut Self>, context: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        self.in_time(context, |stream, context| stream.poll_write(context, bytes))
    }

    fn poll_flush(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.in_time(context, |stream, context| stream.poll_flush(context))
    }

    fn poll_shutdown(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.in_time(context, |stream, context| stream.poll_shutdown(context))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    /// Whoever says nothing has to go, and leaves the place to the next.
    #[test]
    fn silent_connections_are_few_and_end() {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
        let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("an address");
        let mut silent: Vec<std::net::TcpStream> =
            (0..=MAX_STRANGERS).map(|_| std::net::TcpStream::connect(address).expect("connected")).collect();
        runtime.block_on(async {
            listener.set_nonblocking(true).expect("set");
            let mut porch = Porch::before(TcpListener::from_std(listener).expect("a listener"));
            porch.patience = Duration::from_millis(1);
            let mut there = Vec::new();
            for _ in 0..MAX_STRANGERS {
                there.push(porch.accept().await.0);
            }
            let one_more = porch.accept();
            assert!(tokio::time::timeout(Duration::from_millis(50), one_more).await.is_err(), "no place is free");
            let mut first = there.remove(0);
            let mut byte = [0; 1];
            let read =
                std::future::poll_fn(|context| Pin::new(&mut first).poll_read(context, &mut ReadBuf::new(&mut byte)));
            assert_eq!(read.await.expect_err("it waited for too long").kind(), io::ErrorKind::TimedOut);
            drop(first);
            there.push(porch.accept().await.0);
            there.iter().for_each(|guarded| guarded.stranger.let_in());
            assert_eq!(porch.places.available_permits(), MAX_STRANGERS, "viewers take no place");
        });
        let ended = silent.remove(0).read(&mut [0]);
        assert!(ended.map_or(true, |bytes| bytes == 0), "the connection ended");
    }
}
