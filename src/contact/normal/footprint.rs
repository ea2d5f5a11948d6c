//! The solved normal problem of one frame: its patches and their pressures.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::contact::lazy_field::LazyField;
use crate::contact::mesh::strips::Chord;
use crate::contact::normal::hertz::Ellipse;
use crate::contact::normal::load_across::LoadAcross;
use crate::contact::normal::patch::Patch;
use crate::contact::normal::pressure_field::field::PressureField;
use crate::contact::normal::surface_slip::SurfaceSlip;

/// The patches of one frame with their pressures; never empty. It answers where the patches are, how long their chords are,
/// and what pressure acts on them, and nothing else.
#[derive(Debug, Clone, PartialEq)]
pub struct Footprint {
    shape: FootprintShape,
    patches: Vec<Patch>,
    uncertainty: Option<NormalUncertainty>,
    slip: Option<Arc<SurfaceSlip>>,
    slip_by_motion: Option<Arc<[SurfaceSlip; 2]>>,
    /// Of each patch of a curved surface, the origin `[x, y]` in mm of the coordinates that its places are given in.
    origins: Vec<[f64; 2]>,
    loads: LazyField<Vec<LoadAcross>>,
}

/// Where the pressure comes from.
#[derive(Debug, Clone, PartialEq)]
enum FootprintShape {
    /// Hertz's ellipse, in closed form.
    Hertz(Ellipse),
    /// A pressure on one grid of samples or several.
    Sampled(PressureField),
}

/// What computing region and pressure leaves uncertain.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalUncertainty {
    /// Cells of the normal problem across each patch.
    pub cells_across: Vec<f64>,
    /// By how much, relatively, the load may differ from the one asked for.
    pub load: f64,
}

/// Cosines and sines of the mid-points of N equal parts of 0 … π.
#[derive(Debug, Clone, Copy)]
pub struct LineAngles<const N: usize> {
    pub(crate) cosines: [f64; N],
    pub(crate) sines: [f64; N],
}

impl<const N: usize> LineAngles<N> {
    /// Those angles.
    #[must_use]
    pub fn new() -> LineAngles<N> {
        let angles: [f64; N] = std::array::from_fn(|k| (k as f64 + 0.5) * PI / N as f64);
        LineAngles {
            cosines: angles.map(f64::cos),
            sines: angles.map(f64::sin),
        }
    }
}

impl<const N: usize> Default for LineAngles<N> {
    fn default() -> LineAngles<N> {
        LineAngles::new()
    }
}

impl Footprint {
    /// Hertz's ellipse.
    #[must_use]
    pub fn hertz(ellipse: Ellipse) -> Footprint {
        Footprint {
            patches: vec![ellipse.patch()],
            shape: FootprintShape::Hertz(ellipse),
            uncertainty: None,
            slip: None,
            slip_by_motion: None,
            origins: Vec::new(),
            loads: LazyField::default(),
        }
    }

    /// A pressure that was given, and is exact as it stands.
    #[must_use]
    pub fn given(field: PressureField) -> Footprint {
        Footprint {
            patches: field.patches(),
            shape: FootprintShape::Sampled(field),
            uncertainty: None,
            slip: None,
            slip_by_motion: None,
            origins: Vec::new(),
            loads: LazyField::default(),
        }
    }

    /// A pressure that was computed, and whose load may differ from the one asked for by the relative `load_error`.
    #[must_use]
    pub fn computed(field: PressureField, load_error: f64) -> Footprint {
        let uncertainty = NormalUncertainty {
            cells_across: field.cells_across(),
            load: load_error,
        };
        Footprint {
            uncertainty: Some(uncertainty),
            ..Footprint::given(field)
        }
    }

    /// Returns this footprint on the surface of a rail: on a curve with a rigid slip of its own in every cell, added to that of the motion; with the part of it that
    /// follows from a motion, for a unit of creepage across and of spin in 1/mm, where motions share the footprint; and for every patch the origin
    /// `[x, y]` in mm of the coordinates that its places are given in.
    #[must_use]
    pub(crate) fn on_surface(
        self,
        slip: Option<SurfaceSlip>,
        by_motion: Option<[SurfaceSlip; 2]>,
        origins: impl Iterator<Item = [f64; 2]>,
    ) -> Footprint {
        Footprint {
            slip: slip.map(Arc::new),
            slip_by_motion: by_motion.map(Arc::new),
            origins: origins.collect(),
            ..self
        }
    }

    /// The origin `[x, y]` in mm of the coordinates that places below a patch are given in.
    #[must_use]
    pub fn origin(&self, patch: usize) -> [f64; 2] {
        self.origins.get(patch).copied().unwrap_or_default()
    }

    /// The slip of the surface beyond the motion of a plane, where it has one.
    #[must_use]
    pub fn slip(&self) -> Option<&SurfaceSlip> {
        self.slip.as_deref()
    }

    /// Additional slip per unit of lateral creepage, and per unit of spin in 1/mm, where motions share the footprint.
    #[must_use]
    pub fn slip_by_motion(&self) -> Option<&[SurfaceSlip; 2]> {
        self.slip_by_motion.as_deref()
    }

    /// The patches, in order of their smallest y.
    #[must_use]
    pub fn patches(&self) -> &[Patch] {
        &self.patches
    }

    /// How the load of a patch is spread across; computed when it is first asked for.
    #[must_use]
    pub fn load_across(&self, patch: usize) -> &LoadAcross {
        let loads = self.loads.get_or_make(|| match &self.shape {
            FootprintShape::Hertz(ellipse) => vec![LoadAcross::of_ellipse([-ellipse.b, ellipse.b])],
            FootprintShape::Sampled(field) => (0..self.patches.len())
                .map(|k| LoadAcross::of_samples(field, k))
                .collect(),
        });
        &loads[patch]
    }

    /// The uncertainty of region and pressure, where they were computed.
    #[must_use]
    pub fn uncertainty(&self) -> Option<&NormalUncertainty> {
        self.uncertainty.as_ref()
    }

    /// Is it Hertz's ellipse, in closed form?
    #[must_use]
    pub fn is_closed_form(&self) -> bool {
        matches!(self.shape, FootprintShape::Hertz(_))
    }

    /// Hertz's ellipse, if it is one.
    #[must_use]
    pub fn ellipse(&self) -> Option<&Ellipse> {
        match &self.shape {
            FootprintShape::Hertz(ellipse) => Some(ellipse),
            FootprintShape::Sampled(_) => None,
        }
    }

    /// Does the pressure jump from one sample to the next?
    #[must_use]
    pub fn jumps(&self) -> bool {
        matches!(&self.shape, FootprintShape::Sampled(field) if field.jump().is_some())
    }

    /// By how much samples of a given pressure differ from what their neighbours let expect, see [`PressureField::discontinuity`]; nothing for
    /// pressures that were computed or are known in closed form.
    #[must_use]
    pub fn discontinuity(&self) -> Option<f64> {
        match &self.shape {
            FootprintShape::Sampled(field) if self.uncertainty.is_none() => {
                Some(field.discontinuity())
            }
            _ => None,
        }
    }

    /// Segments that a strip has on average, for each patch: more than 1 where patches are hollow or bent.
    #[must_use]
    pub fn segments_per_strip(&self) -> Vec<f64> {
        match &self.shape {
            FootprintShape::Hertz(_) => vec![1.0],
            FootprintShape::Sampled(field) => field.segments_per_strip(),
        }
    }

    /// Chords of one patch along the lines `y`, each standing for a strip of width `dy`; strips that miss the
    /// patch have no chord, strips that cross it several times have several, from smaller to larger x.
    ///
    /// `strips` lists `(y, dy)` of the strips from smaller to larger y; all lengths in mm.
    #[must_use]
    pub fn chords(&self, patch: usize, strips: &[(f64, f64)]) -> Vec<Chord> {
        let mut chords = Vec::new();
        self.chords_into(patch, strips, &mut chords);
        chords
    }

    /// The same in a buffer, instead of what was in it.
    pub fn chords_into(&self, patch: usize, strips: &[(f64, f64)], chords: &mut Vec<Chord>) {
        chords.clear();
        match &self.shape {
            FootprintShape::Hertz(ellipse) => ellipse.add_chords(strips, chords),
            FootprintShape::Sampled(field) => field.add_chords(patch, strips, chords),
        }
    }

    /// The chord of one patch along a line `y` that stands for a strip of width `dy`, if there is exactly one.
    #[must_use]
    #[inline]
    pub fn single_chord(&self, patch: usize, line: (f64, f64)) -> Option<Chord> {
        match &self.shape {
            FootprintShape::Hertz(ellipse) => ellipse.chord(0, line),
            FootprintShape::Sampled(field) => match field.chords(patch, &[line])[..] {
                [chord] => Some(chord),
                _ => None,
            },
        }
    }

    /// Mean pressure in MPa over `x0 < x < x1` on the line of a chord (not yet scaled to the patch's force).
    #[must_use]
    pub fn mean_pressure(&self, chord: &Chord, x0: f64, x1: f64) -> f64 {
        match &self.shape {
            FootprintShape::Hertz(ellipse) => ellipse.mean_pressure(chord, x0, x1),
            FootprintShape::Sampled(field) => field.mean_pressure(chord, x0, x1),
        }
    }

    /// Mean pressure in MPa over the line of a chord (not yet scaled to the patch's force).
    ///
    /// Of a pressure that was computed by the mid-points of N equal angles u, at which `x = −half · cos u` from the middle: exact for Hertz's
    /// semi-ellipse, and otherwise as exact as N points resolve the pressure.
    #[must_use]
    pub fn mean_of_line<const N: usize>(&self, chord: &Chord, angles: &LineAngles<N>) -> f64 {
        match &self.shape {
            FootprintShape::Sampled(field) if self.uncertainty.is_some() => {
                let pressures = self.pressures(chord, (&angles.cosines, &angles.sines));
                let sum: f64 = pressures
                    .iter()
                    .zip(&angles.sines)
                    .map(|(p, sin)| p * sin)
                    .sum();
                0.5 * PI / N as f64 * sum
            }
            _ => self.mean_pressure(chord, chord.left, chord.right),
        }
    }

    /// Pressures in MPa at points of a chord (not yet scaled to the patch's force), given by the cosines and sines of rising angles u: they lie
    /// `−half · cos u` from the middle of the chord.
    #[must_use]
    #[inline]
    pub fn pressures<const N: usize>(
        &self,
        chord: &Chord,
        (cosines, sines): (&[f64; N], &[f64; N]),
    ) -> [f64; N] {
        match &self.shape {
            FootprintShape::Hertz(ellipse) => {
                let steepness = ellipse.pressure(chord, 1.0);
                sines.map(|sine| steepness * sine)
            }
            FootprintShape::Sampled(field) => {
                field.pressures(chord, cosines.map(|cosine| chord.along(cosine)))
            }
        }
    }
}
