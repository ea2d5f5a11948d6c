//! Influence matrices kept for later: patches of the same shape come back in batches, whatever their size and load.

use std::cell::RefCell;
use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};
use std::rc::Rc;

use crate::contact::influence::strips::{Differences, Precision};
use crate::contact::mesh::{Mesh, Segment};
use crate::contact::monitor::{Monitor, Stop};
use crate::contact::tangential::boundary_element::strip_blocks::SharedBlocks;

/// A matrix larger than this part of the bound is not kept: it would push out all others.
const LARGEST_PART: usize = 4;

/// What the fast solver prepares for a mesh, whatever the motion, friction and load.
#[derive(Debug)]
pub struct Prepared {
    /// The influence of the mesh.
    pub influence: Differences,
    /// Own blocks of its strips.
    pub own_blocks: SharedBlocks,
}

/// What a matrix depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kind {
    /// Poisson's ratio.
    pub poisson_ratio: f64,
    /// Only one half of a mirror-symmetric mesh is stored.
    pub folded: bool,
    /// Width of its numbers.
    pub precision: Precision,
}

/// Matrices of one thread, bounded in bytes; the one that was not used for longest goes first.
#[derive(Debug, Default)]
pub struct Cache {
    bytes_max: usize,
    kept: RefCell<Vec<Kept>>,
}

#[derive(Debug)]
struct Kept {
    digest: u64,
    kind: Kind,
    mesh: Mesh,
    bytes: usize,
    prepared: Rc<Prepared>,
}

impl Cache {
    /// A cache of so many bytes of matrices; 0 keeps nothing.
    #[must_use]
    pub fn new(bytes_max: usize) -> Cache {
        Cache {
            bytes_max,
            kept: RefCell::default(),
        }
    }

    /// The matrix of a mesh: kept from an equal mesh, else computed.
    ///
    /// # Errors
    /// The monitor may stop the work.
    pub fn get(
        &self,
        mesh: &Mesh,
        kind: Kind,
        monitor: &dyn Monitor,
    ) -> Result<Rc<Prepared>, Stop> {
        let digest = digest(mesh, kind);
        if let Some(found) = self.find(mesh, kind, digest) {
            return Ok(found);
        }
        let Kind {
            poisson_ratio,
            folded,
            precision,
        } = kind;
        let influence = Differences::new(mesh, poisson_ratio, folded, precision, monitor)?;
        let bytes = influence.bytes();
        let prepared = Rc::new(Prepared {
            influence,
            own_blocks: SharedBlocks::default(),
        });
        if bytes <= self.bytes_max / LARGEST_PART {
            self.keep(Kept {
                digest,
                kind,
                mesh: mesh.clone(),
                bytes,
                prepared: Rc::clone(&prepared),
            });
        }
        Ok(prepared)
    }

    /// Bytes of the matrices that are kept.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.kept.borrow().iter().map(|kept| kept.bytes).sum()
    }

    fn find(&self, mesh: &Mesh, kind: Kind, digest: u64) -> Option<Rc<Prepared>> {
        let mut kept = self.kept.borrow_mut();
        let place = kept.iter().rposition(|kept| {
            kept.digest == digest && kept.kind == kind && alike(&kept.mesh, mesh)
        })?;
        // The newest stand last.
        let found = kept.remove(place);
        let prepared = Rc::clone(&found.prepared);
        kept.push(found);
        Some(prepared)
    }

    fn keep(&self, new: Kept) {
        let mut kept = self.kept.borrow_mut();
        let mut bytes = kept.iter().map(|kept| kept.bytes).sum::<usize>() + new.bytes;
        let mut leaving = 0;
        while bytes > self.bytes_max {
            bytes -= kept[leaving].bytes;
            leaving += 1;
        }
        kept.drain(..leaving);
        kept.push(new);
    }
}

/// The numbers of a segment that the influence depends on, beside its cells.
fn across(segment: &Segment) -> [f64; 2] {
    [segment.chord.y, segment.chord.dy]
}

fn digest(mesh: &Mesh, kind: Kind) -> u64 {
    let mut hasher = DefaultHasher::new();
    (kind.poisson_ratio.to_bits(), kind.folded).hash(&mut hasher);
    (kind.precision == Precision::Single).hash(&mut hasher);
    for segment in &mesh.segments {
        across(segment).map(f64::to_bits).hash(&mut hasher);
        segment.cells.hash(&mut hasher);
    }
    let edges = mesh.left.iter().chain(&mesh.right);
    for place in edges {
        place.to_bits().hash(&mut hasher);
    }
    hasher.finish()
}

/// Have two meshes the same influence, to the last digit?
fn alike(a: &Mesh, b: &Mesh) -> bool {
    let segments = a.segments.iter().zip(&b.segments);
    (a.segments.len(), a.cells()) == (b.segments.len(), b.cells())
        && (&a.left, &a.right, &a.node) == (&b.left, &b.right, &b.node)
        && segments
            .into_iter()
            .all(|(a, b)| across(a) == across(b) && a.cells == b.cells)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::mesh::{Chord, Grading, equal_strips};
    use crate::contact::monitor::Unwatched;

    fn mesh(half_width: f64) -> Mesh {
        let chords: Vec<Chord> = equal_strips(-half_width, half_width, 4)
            .into_iter()
            .enumerate()
            .map(|(strip, (y, dy))| Chord {
                patch: 0,
                strip,
                y,
                dy,
                left: -1.0,
                right: 1.0,
            })
            .collect();
        Mesh::new(&chords, &Grading::cosine(6))
    }

    const KIND: Kind = Kind {
        poisson_ratio: 0.3,
        folded: false,
        precision: Precision::Single,
    };

    fn get(cache: &Cache, half_width: f64, kind: Kind) -> Rc<Prepared> {
        cache.get(&mesh(half_width), kind, &Unwatched).unwrap()
    }

    #[test]
    fn an_equal_mesh_is_not_computed_again() {
        let cache = Cache::new(1 << 20);
        let first = get(&cache, 1.0, KIND);
        assert!(Rc::ptr_eq(&first, &get(&cache, 1.0, KIND)));
        for other in [
            get(&cache, 1.1, KIND),
            get(
                &cache,
                1.0,
                Kind {
                    poisson_ratio: 0.2,
                    ..KIND
                },
            ),
            get(
                &cache,
                1.0,
                Kind {
                    precision: Precision::Double,
                    ..KIND
                },
            ),
            get(
                &cache,
                1.0,
                Kind {
                    folded: true,
                    ..KIND
                },
            ),
        ] {
            assert!(!Rc::ptr_eq(&first, &other));
        }
    }

    #[test]
    fn the_bound_holds_and_the_last_used_stay() {
        let bytes = get(&Cache::default(), 1.0, KIND).influence.bytes();
        let cache = Cache::new(5 * bytes);
        let first = get(&cache, 1.0, KIND);
        for k in 1..20 {
            get(&cache, 1.0 + 0.1 * f64::from(k), KIND);
            assert!(Rc::ptr_eq(&first, &get(&cache, 1.0, KIND)));
            assert!(cache.bytes() <= 5 * bytes);
        }
        let last = get(&cache, 2.9, KIND);
        assert!(Rc::ptr_eq(&last, &get(&cache, 2.9, KIND)));
        let gone = get(&cache, 1.1, KIND);
        assert_eq!(Rc::strong_count(&gone), 2);
    }

    #[test]
    fn without_room_nothing_is_kept() {
        let cache = Cache::default();
        get(&cache, 1.0, KIND);
        assert_eq!(cache.bytes(), 0);
    }
}
