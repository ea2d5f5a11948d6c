//! The places of a port: which connections are open, from where, and which of them wait for the head of a request.
//!
//! When all places are taken a new connection is not refused: the one that has waited longest without a complete head
//! makes way, first those that never sent one, then those kept alive between two requests. So whoever opens connections
//! and says nothing only pushes out others who say nothing. Where every place is held by a request under way, a few more
//! connections are let in that may ask for the probes only.

use std::collections::{BTreeMap, HashMap};
use std::net::{IpAddr, Ipv6Addr};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::Notify;
use tokio_util::sync::CancellationToken;

/// Places beyond the others, for connections that may ask for the probes only.
const RESERVE: usize = 32;

/// Order in which connections make way: never used before kept alive, then by the time since which they wait.
type Rank = (bool, u64);

/// All places of a port; clones share them.
#[derive(Debug, Clone)]
pub(crate) struct Places {
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    max: usize,
    of_address_max: usize,
    register: Mutex<Register>,
    freed: Notify,
}

#[derive(Debug, Default)]
struct Register {
    next: u64,
    open: HashMap<u64, Open>,
    waiting: BTreeMap<Rank, u64>,
    networks: HashMap<IpAddr, Network>,
}

#[derive(Debug)]
struct Open {
    network: IpAddr,
    /// The rank among those without a complete head.
    waits: Option<Rank>,
    /// Requests under way; on HTTP/2 there may be several.
    busy: usize,
    close: CancellationToken,
}

/// The connections of one address.
#[derive(Debug, Default)]
struct Network {
    open: usize,
    waiting: BTreeMap<Rank, u64>,
}

/// The place of one connection, free again when dropped.
#[derive(Debug)]
pub(crate) struct Place {
    shared: Arc<Shared>,
    id: u64,
    close: CancellationToken,
    used: AtomicBool,
    /// Only the probes are answered here.
    pub probes_only: bool,
}

/// A request under way on a connection; when dropped the connection waits for the next head.
#[derive(Debug)]
pub(crate) struct Busy(Arc<Place>);

impl Places {
    /// So many places, of which one address may have so many.
    #[must_use]
    pub(crate) fn new(max: usize, of_address_max: usize) -> Places {
        Places {
            shared: Arc::new(Shared {
                max: max.max(1),
                of_address_max: of_address_max.max(1),
                register: Mutex::default(),
                freed: Notify::new(),
            }),
        }
    }

    /// Waits while even the reserve is used up by requests under way.
    pub(crate) async fn room(&self) {
        loop {
            let freed = self.shared.freed.notified();
            {
                let register = self.shared.register();
                let most = self.shared.max + RESERVE;
                if register.open.len() < most || !register.waiting.is_empty() {
                    return;
                }
            }
            freed.await;
        }
    }

    /// Takes a place for a connection from this address; another one makes way if there is none. `limited`: the address may have
    /// only so many.
    #[must_use]
    pub(crate) fn enter(&self, address: IpAddr, limited: bool) -> Arc<Place> {
        let network = network(address);
        let mut register = self.shared.register();
        let own = register.networks.get(&network);
        let own_full = limited && own.is_some_and(|own| own.open >= self.shared.of_address_max);
        let mut probes_only = false;
        if own_full {
            let oldest = own.and_then(|own| own.waiting.first_key_value());
            let oldest = oldest.map(|(_, id)| *id);
            probes_only = !register.close(oldest);
        }
        if register.open.len() >= self.shared.max {
            let oldest = register.waiting.first_key_value().map(|(_, id)| *id);
            probes_only |= !register.close(oldest);
        }
        let id = register.next();
        let close = CancellationToken::new();
        register.open.insert(
            id,
            Open {
                network,
                waits: None,
                busy: 0,
                close: close.clone(),
            },
        );
        register.networks.entry(network).or_default().open += 1;
        register.wait(id, false);
        Arc::new(Place {
            shared: self.shared.clone(),
            id,
            close,
            used: AtomicBool::new(false),
            probes_only,
        })
    }

    /// How many connections are open.
    #[cfg(test)]
    fn open(&self) -> usize {
        self.shared.register().open.len()
    }
}

impl Shared {
    fn register(&self) -> MutexGuard<'_, Register> {
        self.register.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Register {
    fn next(&mut self) -> u64 {
        self.next += 1;
        self.next
    }

    /// From now on a connection waits for a head.
    fn wait(&mut self, id: u64, used: bool) {
        let rank = (used, self.next());
        if let Some(open) = self.open.get_mut(&id) {
            open.waits = Some(rank);
            self.waiting.insert(rank, id);
            let network = self.networks.entry(open.network).or_default();
            network.waiting.insert(rank, id);
        }
    }

    /// A connection does not wait any more.
    fn stop_waiting(&mut self, id: u64) {
        let Some(open) = self.open.get_mut(&id) else {
            return;
        };
        if let Some(rank) = open.waits.take() {
            self.waiting.remove(&rank);
            if let Some(network) = self.networks.get_mut(&open.network) {
                network.waiting.remove(&rank);
            }
        }
    }

    /// A request begins.
    fn begin(&mut self, id: u64) {
        self.stop_waiting(id);
        if let Some(open) = self.open.get_mut(&id) {
            open.busy += 1;
        }
    }

    /// A request ends; after the last one the connection waits for a head.
    fn end(&mut self, id: u64) {
        if let Some(open) = self.open.get_mut(&id) {
            open.busy -= 1;
            if open.busy == 0 {
                self.wait(id, true);
            }
        }
    }

    fn remove(&mut self, id: u64) -> Option<Open> {
        self.stop_waiting(id);
        let open = self.open.remove(&id)?;
        if let Some(network) = self.networks.get_mut(&open.network) {
            network.open -= 1;
            if network.open == 0 {
                self.networks.remove(&open.network);
            }
        }
        Some(open)
    }

    /// Closes a connection and frees its place; `false` if there is none to close.
    fn close(&mut self, id: Option<u64>) -> bool {
        let closed = id.and_then(|id| self.remove(id));
        if let Some(open) = &closed {
            open.close.cancel();
        }
        closed.is_some()
    }
}

impl Place {
    /// The head of a request is there.
    #[must_use]
    pub(crate) fn begin(self: &Arc<Place>) -> Busy {
        self.used.store(true, Ordering::Relaxed);
        self.shared.register().begin(self.id);
        Busy(self.clone())
    }

    /// Was there ever a complete head?
    #[must_use]
    pub(crate) fn is_used(&self) -> bool {
        self.used.load(Ordering::Relaxed)
    }

    /// Ends when the connection has to make way.
    pub(crate) async fn closed(&self) {
        self.close.cancelled().await;
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.shared.register().remove(self.id);
        self.shared.freed.notify_one();
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        self.0.shared.register().end(self.0.id);
        self.0.shared.freed.notify_one();
    }
}

/// What counts as one address: one customer has a whole IPv6 network of 64 bits.
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

    fn address(last: u8) -> IpAddr {
        [192, 0, 2, last].into()
    }

    #[test]
    fn the_oldest_without_a_head_makes_way_and_the_new_one_comes_in() {
        let places = Places::new(3, 3);
        let silent = places.enter(address(1), true);
        let kept = places.enter(address(1), true);
        drop(kept.begin());
        let asking = places.enter(address(1), true);
        let busy = asking.begin();
        let late = [
            places.enter(address(1), true),
            places.enter(address(1), true),
        ];
        assert!(silent.close.is_cancelled());
        // What was said nothing on makes way before what was used.
        assert!(late[0].close.is_cancelled() && !kept.close.is_cancelled());
        let last = late[1].begin();
        let next = places.enter(address(1), true).begin();
        assert!(kept.close.is_cancelled() && !asking.close.is_cancelled());
        assert_eq!(places.open(), 3);
        // All three are busy: the next may ask for the probes only.
        assert!(places.enter(address(1), true).probes_only);
        drop((busy, last, next));
        assert!(!places.enter(address(1), true).probes_only);
    }

    #[test]
    fn one_address_does_not_push_out_another() {
        let places = Places::new(10, 2);
        let other = places.enter(address(2), true);
        let many: Vec<_> = (0..50).map(|_| places.enter(address(1), true)).collect();
        assert!(!other.close.is_cancelled());
        let left = many.iter().filter(|place| !place.close.is_cancelled());
        assert_eq!((left.count(), places.open()), (2, 3));
        let proxied: Vec<_> = (0..7).map(|_| places.enter(address(3), false)).collect();
        let left = proxied.iter().filter(|place| !place.close.is_cancelled());
        assert_eq!(left.count(), 7, "a proxy connects for many");
        drop(proxied);
        drop(many);
        assert_eq!(places.open(), 1);
    }

    #[test]
    fn a_connection_with_several_requests_waits_when_the_last_one_ends() {
        let places = Places::new(1, 1);
        let several = places.enter(address(1), true);
        let (first, second) = (several.begin(), several.begin());
        drop(first);
        assert!(places.enter(address(1), true).probes_only);
        assert!(!several.close.is_cancelled());
        drop(second);
        assert!(!places.enter(address(1), true).probes_only);
        assert!(several.close.is_cancelled());
    }

    #[tokio::test]
    async fn beyond_the_reserve_a_connection_waits_until_one_ends() {
        let places = Places::new(1, 100);
        let busy: Vec<_> = (0..=RESERVE)
            .map(|_| places.enter(address(1), true).begin())
            .collect();
        let room = places.room();
        tokio::pin!(room);
        let early = futures_util::poll!(&mut room);
        assert!(early.is_pending());
        drop(busy);
        room.await;
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
