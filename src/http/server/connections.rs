//! The open connections of a port: limits of their number and of their idle time.

use std::collections::HashMap;
use std::net::{IpAddr, Ipv6Addr};
use std::pin::Pin;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll, ready};
use std::time::{Duration, Instant};

use axum::body::{Body, Bytes, HttpBody};
use hyper::body::{Frame, SizeHint};
use tokio_util::sync::CancellationToken;

use crate::options::HttpOptions;
use railhead_jobs::sync::lock;

/// Number of connections accepted beyond the maximum, on which only the probes are answered.
const RESERVE: usize = 32;
/// Largest piece of a response that is passed to the connection at once, in bytes. The memory limits do not count such pieces.
pub(super) const PIECE_BYTES: usize = 16 << 10;

/// The address of the sender of a request, or of its client if a trusted proxy sent it, in the extensions of the request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Peer(pub IpAddr);

/// Marks a request on a connection of the reserve, on which only the probes are answered.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ProbesOnly;

/// Identifier of the next connection.
static NEXT_ID: AtomicU64 = AtomicU64::new(0);

/// All open connections.
///
/// A connection is overdue, and closed, if
/// - its first request head is not complete within [`HttpOptions::first_head_timeout`],
/// - the next head is not complete within [`HttpOptions::head_timeout`] after the last response,
/// - its client reads no piece of a response for [`HttpOptions::write_timeout`].
///
/// When [`HttpOptions::connections_max`] or [`HttpOptions::address_connections_max`] is reached, a new connection replaces
/// the one that has waited longest for a head: first those without any request so far, then idle ones. If all connections have
/// active requests, a few more are accepted for the probes only.
#[derive(Debug)]
pub(crate) struct Connections {
    max: usize,
    address_max: usize,
    first_head_timeout: Duration,
    head_timeout: Duration,
    write_timeout: Duration,
    open: Mutex<HashMap<u64, Arc<Slot>>>,
}

/// An open connection. It is removed from the table on drop.
#[derive(Debug)]
pub(crate) struct Connection {
    slot: Arc<Slot>,
    table: Arc<Connections>,
}

#[derive(Debug)]
struct Slot {
    id: u64,
    network: IpAddr,
    probes_only: bool,
    close: CancellationToken,
    activity: Mutex<Activity>,
}

#[derive(Debug)]
struct Activity {
    /// Whether a request head has arrived.
    used: bool,
    /// Number of active requests; HTTP/2 allows several.
    requests: usize,
    /// Number of responses with a piece that the client has not read yet.
    unread: usize,
    /// Time of the last change.
    since: Instant,
}

/// An active request, until its response has been sent or dropped.
#[derive(Debug)]
pub(crate) struct ActiveRequest {
    slot: Arc<Slot>,
    unread: bool,
}

impl Connections {
    pub(crate) fn new(options: &HttpOptions) -> Connections {
        Connections {
            max: options.connections_max.max(1),
            address_max: options.address_connections_max.max(1),
            first_head_timeout: options.first_head_timeout,
            head_timeout: options.head_timeout,
            write_timeout: options.write_timeout,
            open: Mutex::default(),
        }
    }

    /// Adds a connection from this address. `limited` applies the limit per address. Returns `None` if the reserve is used up too.
    pub(crate) fn open(self: &Arc<Self>, address: IpAddr, limited: bool) -> Option<Connection> {
        let network = network(address);
        let mut open = lock(&self.open);
        let own = |slot: &Slot| slot.network == network;
        let mut probes_only = false;
        if limited && open.values().filter(|slot| own(slot)).count() >= self.address_max {
            probes_only = !close_longest_waiting(&mut open, own);
        }
        if open.len() >= self.max {
            probes_only |= !close_longest_waiting(&mut open, |_| true);
        }
        if open.len() >= self.max + RESERVE {
            return None;
        }
        let slot = Arc::new(Slot {
            id: NEXT_ID.fetch_add(1, Ordering::Relaxed),
            network,
            probes_only,
            close: CancellationToken::new(),
            activity: Mutex::new(Activity {
                used: false,
                requests: 0,
                unread: 0,
                since: Instant::now(),
            }),
        });
        open.insert(slot.id, slot.clone());
        let table = self.clone();
        Some(Connection { slot, table })
    }

    /// Closes overdue connections.
    pub(crate) fn close_overdue(&self) {
        for slot in lock(&self.open).values() {
            let activity = lock(&slot.activity);
            let limit = match *activity {
                Activity { unread: 1.., .. } => self.write_timeout,
                Activity { requests: 1.., .. } => continue,
                Activity { used: true, .. } => self.head_timeout,
                Activity { used: false, .. } => self.first_head_timeout,
            };
            if activity.since.elapsed() > limit {
                slot.close.cancel();
            }
        }
    }
}

/// Closes the connection that has waited longest for a head, among those selected by `counts`. Returns whether there is one.
fn close_longest_waiting(
    open: &mut HashMap<u64, Arc<Slot>>,
    counts: impl Fn(&Slot) -> bool,
) -> bool {
    let waiting = open.values().filter(|slot| counts(slot));
    let waiting = waiting.filter_map(|slot| {
        let activity = lock(&slot.activity);
        (activity.requests == 0).then_some((activity.used, activity.since, slot.id))
    });
    let closed = waiting.min().and_then(|(.., id)| open.remove(&id));
    if let Some(slot) = &closed {
        slot.close.cancel();
    }
    closed.is_some()
}

impl Connection {
    /// Counts a request whose head has arrived.
    pub(crate) fn begin_request(&self) -> ActiveRequest {
        self.slot.change(|activity| {
            activity.used = true;
            activity.requests += 1;
        });
        ActiveRequest {
            slot: self.slot.clone(),
            unread: false,
        }
    }

    pub(crate) fn probes_only(&self) -> bool {
        self.slot.probes_only
    }

    /// Resolves when the connection must be closed.
    pub(crate) async fn closed(&self) {
        self.slot.close.cancelled().await;
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        lock(&self.table.open).remove(&self.slot.id);
    }
}

impl Slot {
    fn change(&self, change: impl FnOnce(&mut Activity)) {
        let mut activity = lock(&self.activity);
        change(&mut activity);
        activity.since = Instant::now();
    }
}

impl ActiveRequest {
    /// Returns the body of the response in small pieces. The request ends when the last one is read.
    pub(crate) fn send(mut self, body: Body) -> Body {
        self.set_unread(true);
        Body::new(SentBody {
            body,
            rest: Bytes::new(),
            request: self,
        })
    }

    fn set_unread(&mut self, unread: bool) {
        if self.unread != unread {
            self.unread = unread;
            self.slot.change(|activity| match unread {
                true => activity.unread += 1,
                false => activity.unread -= 1,
            });
        }
    }
}

impl Drop for ActiveRequest {
    fn drop(&mut self) {
        self.set_unread(false);
        self.slot.change(|activity| activity.requests -= 1);
    }
}

/// The body of a response. A piece counts as unread until the connection polls the next one.
struct SentBody {
    body: Body,
    /// Rest of a frame larger than a piece.
    rest: Bytes,
    request: ActiveRequest,
}

impl HttpBody for SentBody {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        self.request.set_unread(false);
        if self.rest.is_empty() {
            match ready!(Pin::new(&mut self.body).poll_frame(context)) {
                Some(Ok(frame)) => match frame.into_data() {
                    Ok(data) => self.rest = data,
                    Err(trailers) => return Poll::Ready(Some(Ok(trailers))),
                },
                end => return Poll::Ready(end),
            }
        }
        let length = self.rest.len().min(PIECE_BYTES);
        let piece = self.rest.split_to(length);
        self.request.set_unread(true);
        Poll::Ready(Some(Ok(Frame::data(piece))))
    }

    fn is_end_stream(&self) -> bool {
        self.rest.is_empty() && self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        let rest = self.rest.len() as u64;
        let body = self.body.size_hint();
        let mut hint = SizeHint::new();
        hint.set_lower(body.lower() + rest);
        if let Some(upper) = body.upper() {
            hint.set_upper(upper + rest);
        }
        hint
    }
}

/// Returns the network that counts as one address: for IPv6 the /64, which one customer has.
#[must_use]
pub(crate) fn network(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(address) if !address.is_loopback() => {
            Ipv6Addr::from_bits(address.to_bits() >> 64 << 64).into()
        }
        address => address,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use http_body_util::BodyExt;

    fn table(max: usize, address_max: usize) -> Arc<Connections> {
        let options = HttpOptions {
            connections_max: max,
            address_connections_max: address_max,
            first_head_timeout: Duration::ZERO,
            write_timeout: Duration::ZERO,
            ..HttpOptions::default()
        };
        Arc::new(Connections::new(&options))
    }

    fn open(table: &Arc<Connections>, last: u8) -> Connection {
        table.open([192, 0, 2, last].into(), true).expect("a place")
    }

    fn is_closed(connection: &Connection) -> bool {
        connection.slot.close.is_cancelled()
    }

    #[test]
    fn the_longest_waiting_connection_is_replaced_and_busy_ones_are_not() {
        let table = table(3, 3);
        let silent = open(&table, 1);
        let kept = open(&table, 1);
        drop(kept.begin_request());
        let busy = open(&table, 1);
        let (first, second) = (busy.begin_request(), busy.begin_request());
        let late = [open(&table, 1), open(&table, 1)];
        // A connection without any request is replaced before one that is kept alive.
        assert!(is_closed(&silent) && is_closed(&late[0]) && !is_closed(&kept));
        let last = late[1].begin_request();
        let next = open(&table, 1);
        let next = (next.begin_request(), next);
        assert!(is_closed(&kept) && !is_closed(&busy));
        drop(first);
        let probe = |_| {
            let connection = open(&table, 1);
            (connection.begin_request(), connection)
        };
        let reserve: Vec<_> = (0..RESERVE).map(probe).collect();
        assert!(reserve[0].1.probes_only() && !is_closed(&busy));
        assert!(table.open([192, 0, 2, 2].into(), true).is_none());
        drop((reserve, second, last, next));
        assert!(!open(&table, 1).probes_only());
    }

    #[test]
    fn one_address_does_not_replace_connections_of_another() {
        let table = table(10, 2);
        let other = open(&table, 2);
        let many: Vec<_> = (0..50).map(|_| open(&table, 1)).collect();
        assert!(!is_closed(&other));
        let left = many.iter().filter(|connection| !is_closed(connection));
        assert_eq!(left.count(), 2);
        let proxied = (0..7).map(|_| table.open([192, 0, 2, 3].into(), false));
        let proxied: Vec<_> = proxied.flatten().collect();
        assert!(!proxied.iter().any(is_closed), "a proxy connects for many");
    }

    #[tokio::test]
    async fn an_answer_is_unread_from_a_piece_to_the_next_one_asked_for() {
        let table = table(3, 3);
        let connection = open(&table, 1);
        let unread = || lock(&connection.slot.activity).unread;
        let data = vec![7; 3 * PIECE_BYTES + 1];
        let body = Body::from(data.clone());
        let mut body = connection.begin_request().send(body);
        assert_eq!(body.size_hint().exact(), Some(data.len() as u64));
        let mut read = Vec::new();
        assert_eq!(unread(), 1);
        while let Some(frame) = body.frame().await {
            let piece = frame.unwrap().into_data().unwrap();
            assert!(piece.len() <= PIECE_BYTES);
            read.extend(piece);
            assert_eq!(unread(), 1);
        }
        assert_eq!((read, unread()), (data.clone(), 0));
        // A response that has not produced data does not count as unread, and its connection is not overdue.
        let silent =
            Body::from_stream(futures_util::stream::pending::<Result<Bytes, axum::Error>>());
        let mut silent = connection.begin_request().send(silent);
        assert!(futures_util::poll!(Box::pin(silent.frame())).is_pending());
        table.close_overdue();
        assert!(!is_closed(&connection));
        let mut body = connection.begin_request().send(Body::from(data));
        let _ = body.frame().await;
        table.close_overdue();
        assert!(is_closed(&connection));
        drop(body);
        assert_eq!(unread(), 0);
    }

    #[test]
    fn addresses_are_counted_by_network() {
        let of = |text: &str| network(text.parse().unwrap());
        assert_eq!(of("192.0.2.1"), of("::ffff:192.0.2.1"));
        assert_ne!(of("192.0.2.1"), of("192.0.2.2"));
        assert_eq!(of("2001:db8:1:2::3"), of("2001:db8:1:2:ffff::4"));
        assert_ne!(of("2001:db8:1:2::3"), of("2001:db8:1:3::3"));
        assert_eq!(of("::1"), IpAddr::from(Ipv6Addr::LOCALHOST));
    }
}
