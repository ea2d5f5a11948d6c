//! Closes connections whose client does not read its answer: a write that makes no progress for some time fails, and the
//! connection with it. Slow clients are not affected, since every byte that they read restarts the time.

use std::io::{Error, ErrorKind, IoSlice, Result};
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncWrite, Interest, ReadBuf};
use tokio::net::TcpStream;
use tokio::net::tcp::{OwnedReadHalf, OwnedWriteHalf};
use tokio::time::{Instant, Sleep, sleep};

/// How often an unread connection is looked at, and how long it stays open after its client has left.
const LEFT_AFTER: Duration = Duration::from_secs(1);

/// A connection with a limit on how long a write may stand still.
#[derive(Debug)]
pub(crate) struct WriteTimeout {
    reading: Arc<OwnedReadHalf>,
    writing: OwnedWriteHalf,
    limit: Duration,
    /// Runs while `waiting`.
    timer: Pin<Box<Sleep>>,
    waiting: bool,
}

impl WriteTimeout {
    /// The connection with this limit.
    #[must_use]
    pub(crate) fn new(stream: TcpStream, limit: Duration) -> WriteTimeout {
        let (reading, writing) = stream.into_split();
        WriteTimeout {
            reading: Arc::new(reading),
            writing,
            limit,
            timer: Box::pin(sleep(limit)),
            waiting: false,
        }
    }

    /// Ends some time after the client has closed its side of the connection, even if bytes of a request are still unread.
    ///
    /// The protocol notices an end that it reads. It does not read on while a request is computed whose body is not taken yet.
    pub(crate) fn client_left(&self) -> impl Future<Output = ()> + use<> {
        let reading = self.reading.clone();
        async move {
            // Closing a connection is also how a client without further requests ends them; those under way are answered.
            while reading
                .ready(Interest::READABLE)
                .await
                .is_ok_and(|ready| !ready.is_read_closed())
            {
                sleep(LEFT_AFTER).await;
            }
            sleep(LEFT_AFTER).await;
        }
    }

    /// What became of a write, and whether it has stood still for too long.
    fn judge<T>(&mut self, context: &mut Context<'_>, written: Poll<T>) -> Poll<Result<T>> {
        if let Poll::Ready(written) = written {
            self.waiting = false;
            return Poll::Ready(Ok(written));
        }
        if !self.waiting {
            self.waiting = true;
            self.timer.as_mut().reset(Instant::now() + self.limit);
        }
        ready!(self.timer.as_mut().poll(context));
        let detail = "the client takes nothing of its answer";
        Poll::Ready(Err(Error::new(ErrorKind::TimedOut, detail)))
    }
}

impl AsyncWrite for WriteTimeout {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<Result<usize>> {
        let written = Pin::new(&mut self.writing).poll_write(context, bytes);
        self.judge(context, written).map(Result::flatten)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        parts: &[IoSlice<'_>],
    ) -> Poll<Result<usize>> {
        let written = Pin::new(&mut self.writing).poll_write_vectored(context, parts);
        self.judge(context, written).map(Result::flatten)
    }

    fn is_write_vectored(&self) -> bool {
        self.writing.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Result<()>> {
        Pin::new(&mut self.writing).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Result<()>> {
        Pin::new(&mut self.writing).poll_shutdown(context)
    }
}

impl AsyncRead for WriteTimeout {
    fn poll_read(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
        into: &mut ReadBuf<'_>,
    ) -> Poll<Result<()>> {
        let stream: &TcpStream = (*self.reading).as_ref();
        loop {
            ready!(stream.poll_read_ready(context))?;
            match stream.try_read(into.initialize_unfilled()) {
                Ok(bytes) => {
                    into.advance(bytes);
                    return Poll::Ready(Ok(()));
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                Err(error) => return Poll::Ready(Err(error)),
            }
        }
    }
}
