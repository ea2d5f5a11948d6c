//! The operators of a process, bounded in bytes and shared by all cases and threads.
//!
//! Meshes are dimensionless, so patches of one shape share their operator whatever their size and load. The store affects only the time of a solve: an operator
//! that is computed again is identical.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::half_space::strip_operator::kind::Precision;
use crate::half_space::strip_operator::operator;
use crate::half_space::strip_operator::operator::StripOperator;
use crate::mesh::Mesh;
use crate::monitor::{Monitor, Stop};

/// Default size of a store in bytes: room for two of the largest operators of targets from 0.0005 on (52 MB each without mirror symmetry), or for some
/// hundred usual ones. A creep map of 900 motions at fixed spin takes the same time with 0, 64, 128 and 256 MiB (`cargo bench --bench stress -- --only
/// creep-map`); batches of one shape benefit (`cargo bench --bench report`).
pub const BYTES_DEFAULT: u64 = 128 << 20;

/// Bytes of an operator that a store of `bytes_max` keeps: all or 0.
pub(crate) fn kept_bytes(bytes: u64, bytes_max: u64) -> u64 {
    // One larger than half of the bound would displace all others.
    if bytes <= bytes_max / 2 { bytes } else { 0 }
}

/// The properties of an operator besides its mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OperatorKind {
    /// Poisson's ratio.
    pub poisson_ratio: f64,
    /// Whether only one half of a mirror-symmetric mesh is stored.
    pub folded: bool,
    /// Precision of its numbers.
    pub precision: Precision,
}

impl OperatorKind {
    /// Bytes of the operator of a mesh.
    pub fn bytes(self, segments: usize, cells: usize) -> u64 {
        operator::bytes(cells, segments, self.folded, self.precision)
    }
}

/// Operators within a bound of bytes; the least recently used are dropped first.
#[derive(Debug)]
pub struct OperatorStore {
    bytes_max: u64,
    /// In the order of their last use.
    kept: Mutex<Vec<Kept>>,
}

/// An operator with its mesh and properties.
#[derive(Debug, Clone)]
struct Kept {
    mesh: Arc<Mesh>,
    kind: OperatorKind,
    operator: Arc<StripOperator>,
}

impl Kept {
    fn is_of(&self, mesh: &Arc<Mesh>, kind: OperatorKind) -> bool {
        self.kind == kind && (Arc::ptr_eq(&self.mesh, mesh) || self.mesh == *mesh)
    }

    fn bytes(&self) -> u64 {
        self.operator.bytes() as u64
    }
}

impl Default for OperatorStore {
    fn default() -> Self {
        OperatorStore::new(BYTES_DEFAULT)
    }
}

impl OperatorStore {
    /// A store of at most `bytes_max` bytes; 0 keeps nothing.
    pub fn new(bytes_max: u64) -> OperatorStore {
        OperatorStore {
            bytes_max,
            kept: Mutex::default(),
        }
    }

    /// The operator of a mesh: a stored one of an equal mesh, or else computed outside the lock. Two threads that need the same missing operator both compute
    /// it, and one result is dropped, so that a stopped solve cannot block another.
    ///
    /// # Errors
    /// The monitor may stop the work.
    pub fn get(
        &self,
        mesh: &Arc<Mesh>,
        kind: OperatorKind,
        monitor: &dyn Monitor,
    ) -> Result<Arc<StripOperator>, Stop> {
        if let Some(found) = self.find(mesh, kind) {
            return Ok(found);
        }
        let OperatorKind {
            poisson_ratio,
            folded,
            precision,
        } = kind;
        let operator = StripOperator::new(mesh, poisson_ratio, folded, precision, monitor)?;
        let operator = Arc::new(operator);
        if kept_bytes(operator.bytes() as u64, self.bytes_max) > 0 {
            self.keep(Kept {
                mesh: Arc::clone(mesh),
                kind,
                operator: Arc::clone(&operator),
            });
        }
        Ok(operator)
    }

    /// Bytes of the stored operators.
    pub fn bytes(&self) -> u64 {
        self.kept().iter().map(Kept::bytes).sum()
    }

    fn kept(&self) -> MutexGuard<'_, Vec<Kept>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn find(&self, mesh: &Arc<Mesh>, kind: OperatorKind) -> Option<Arc<StripOperator>> {
        let mut kept = self.kept();
        let place = kept.iter().rposition(|kept| kept.is_of(mesh, kind))?;
        kept[place..].rotate_left(1);
        kept.last().map(|kept| Arc::clone(&kept.operator))
    }

    fn keep(&self, new: Kept) {
        let mut kept = self.kept();
        kept.retain(|known| !known.is_of(&new.mesh, new.kind));
        kept.push(new);
        let mut bytes: u64 = kept.iter().map(Kept::bytes).sum();
        kept.retain(|oldest| {
            let stays = bytes <= self.bytes_max;
            bytes -= if stays { 0 } else { oldest.bytes() };
            stays
        });
    }
}

/// The operators of one case: those of the store, and the last one used. An operator too large for the store is thus not computed again for every motion.
#[derive(Debug)]
pub struct CaseOperators {
    store: Arc<OperatorStore>,
    last: Mutex<Option<Kept>>,
}

impl CaseOperators {
    /// The operators of a case with a store.
    pub fn new(store: &Arc<OperatorStore>) -> Arc<CaseOperators> {
        Arc::new(CaseOperators {
            store: Arc::clone(store),
            last: Mutex::default(),
        })
    }

    /// See [`OperatorStore::get`].
    ///
    /// # Errors
    /// The monitor may stop the work.
    pub fn get(
        &self,
        mesh: &Arc<Mesh>,
        kind: OperatorKind,
        monitor: &dyn Monitor,
    ) -> Result<Arc<StripOperator>, Stop> {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(kept) = last.as_ref().filter(|kept| kept.is_of(mesh, kind)) {
            return Ok(Arc::clone(&kept.operator));
        }
        // A case needs one operator at a time, so the last one is dropped before the next is computed.
        *last = None;
        let operator = self.store.get(mesh, kind, monitor)?;
        *last = Some(Kept {
            mesh: Arc::clone(mesh),
            kind,
            operator: Arc::clone(&operator),
        });
        Ok(operator)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::mesh_between;
    use crate::monitor::Unmonitored;

    fn mesh(half_width: f64) -> Arc<Mesh> {
        Arc::new(mesh_between(half_width, [4, 6], |_| [-1.0, 1.0]))
    }

    const KIND: OperatorKind = OperatorKind {
        poisson_ratio: 0.3,
        folded: false,
        precision: Precision::Single,
    };

    fn get(store: &OperatorStore, half_width: f64, kind: OperatorKind) -> Arc<StripOperator> {
        store.get(&mesh(half_width), kind, &Unmonitored).unwrap()
    }

    #[test]
    fn an_equal_mesh_is_not_computed_again() {
        let store = OperatorStore::default();
        let first = get(&store, 1.0, KIND);
        assert!(Arc::ptr_eq(&first, &get(&store, 1.0, KIND)));
        let others = [
            OperatorKind {
                poisson_ratio: 0.2,
                ..KIND
            },
            OperatorKind {
                precision: Precision::Double,
                ..KIND
            },
            OperatorKind {
                folded: true,
                ..KIND
            },
        ];
        for other in others {
            assert!(!Arc::ptr_eq(&first, &get(&store, 1.0, other)));
        }
        assert!(!Arc::ptr_eq(&first, &get(&store, 1.1, KIND)));
    }

    #[test]
    fn the_bound_holds_and_the_last_used_stay() {
        let bytes = KIND.bytes(4, 24);
        let store = OperatorStore::new(5 * bytes);
        let first = get(&store, 1.0, KIND);
        for k in 1..20 {
            get(&store, 1.0 + 0.1 * f64::from(k), KIND);
            assert!(Arc::ptr_eq(&first, &get(&store, 1.0, KIND)));
            assert!(store.bytes() <= 5 * bytes);
        }
        assert_eq!(store.bytes(), 5 * bytes);
        let last = get(&store, 2.9, KIND);
        assert!(Arc::ptr_eq(&last, &get(&store, 2.9, KIND)));
    }

    #[test]
    fn the_bytes_counted_are_those_of_the_matrix() {
        for folded in [false, true] {
            let kind = OperatorKind { folded, ..KIND };
            let store = OperatorStore::default();
            let operator = get(&store, 1.0, kind);
            assert_eq!(store.bytes(), operator.bytes() as u64);
            assert_eq!(store.bytes(), kind.bytes(4, 24));
        }
    }

    #[test]
    fn threads_share_one_store_within_its_bound() {
        let bytes = KIND.bytes(4, 24);
        let store = OperatorStore::new(4 * bytes);
        std::thread::scope(|scope| {
            for thread in 0..8_u32 {
                let store = &store;
                scope.spawn(move || {
                    for k in 0..40_u32 {
                        let shape = f64::from((thread + k) % 9);
                        get(store, 1.0 + 0.1 * shape, KIND);
                        assert!(store.bytes() <= 4 * bytes);
                    }
                });
            }
        });
        assert_eq!(store.bytes(), 4 * bytes);
    }

    #[test]
    fn without_room_nothing_is_kept() {
        let store = OperatorStore::new(0);
        get(&store, 1.0, KIND);
        assert_eq!(store.bytes(), 0);
    }

    #[test]
    fn what_a_case_used_last_is_at_hand_though_the_store_has_no_room() {
        let operators = CaseOperators::new(&Arc::new(OperatorStore::new(0)));
        let first = operators.get(&mesh(1.0), KIND, &Unmonitored).unwrap();
        let again = operators.get(&mesh(1.0), KIND, &Unmonitored).unwrap();
        assert!(Arc::ptr_eq(&first, &again));
        drop((first, again));
        let last = Arc::downgrade(&operators.get(&mesh(1.0), KIND, &Unmonitored).unwrap());
        operators.get(&mesh(1.1), KIND, &Unmonitored).unwrap();
        assert!(last.upgrade().is_none());
    }
}
