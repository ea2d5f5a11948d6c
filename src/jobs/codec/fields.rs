//! The stored form of fields: a JSON header and one compressed block per array, readable piece by piece.
//!
//! ```text
//! bytes 0..8        "RHFIELD2"
//! bytes 8..12       length H of the header, u32 little-endian
//! bytes 12..12+H    header: {"points": [motions of each patch], "meshes": [mesh of every motion, for each patch],
//!                   "blocks": [{patch, point, mesh, name, kind, count, offset, bytes}]}
//! then              the blocks; offsets count from the end of the header
//! ```
//!
//! A block is a zstd frame with checksum; inside are `count` little-endian values of its kind (`f64`, `u32` or `u8`),
//! in the cell order of [`PatchCells`]; `subsurface` has nine for every requested point: x, y, depth and the stress. Blocks stand patch by patch, in each patch first the cells of every mesh
//! (`point` is null), then motion by motion, so that one patch is one range of bytes. An array that was not computed
//! has no block. Zones are `u8`: 0 stick, 1 slip.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use railhead_contact::solution::words::answer::{PatchCells, PatchFields, PointFields, Zone};

pub(crate) const MAGIC: &[u8; 8] = b"RHFIELD2";

/// Length of the part before the header.
pub const PREFIX_BYTES: usize = 12;

/// What lies where in a stored file of fields.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    pub(crate) points: Vec<usize>,
    pub(crate) meshes: Vec<Vec<usize>>,
    pub(crate) blocks: Vec<Block>,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Block {
    pub(crate) patch: usize,
    pub(crate) point: Option<usize>,
    pub(crate) mesh: usize,
    pub(crate) name: String,
    pub(crate) kind: Kind,
    pub(crate) count: usize,
    pub(crate) offset: u64,
    pub(crate) bytes: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Kind {
    F64,
    U32,
    U8,
}

/// Length of the header in bytes, from the first [`PREFIX_BYTES`] of the file.
///
/// # Errors
/// This is no file of fields.
pub fn header_length(prefix: &[u8]) -> Result<usize, String> {
    match prefix.split_at_checked(8) {
        Some((magic, length)) if magic == MAGIC && length.len() == 4 => {
            let length = u32::from_le_bytes([length[0], length[1], length[2], length[3]]);
            usize::try_from(length).map_err(|error| error.to_string())
        }
        _ => Err("a file of fields does not begin with its mark".to_owned()),
    }
}

impl Header {
    /// Reads the header.
    ///
    /// # Errors
    /// It is not one.
    pub fn read(bytes: &[u8]) -> Result<Header, String> {
        serde_json::from_slice(bytes)
            .map_err(|error| format!("header of a file of fields: {error}"))
    }

    /// Number of patches.
    #[must_use]
    pub fn patches(&self) -> usize {
        self.points.len()
    }

    /// Number of motions of a patch; 0 if there is no such patch.
    #[must_use]
    pub fn points(&self, patch: usize) -> usize {
        self.points.get(patch).copied().unwrap_or(0)
    }

    /// The ranges of bytes, counted from the end of the header, that hold the cells of a patch and the values of one
    /// motion, or of all of them.
    #[must_use]
    pub fn ranges(&self, patch: usize, point: Option<usize>) -> Vec<Range<u64>> {
        let mut ranges: Vec<Range<u64>> = Vec::new();
        for block in self.wanted(patch, point) {
            match ranges.last_mut() {
                Some(last) if last.end == block.offset => last.end += block.bytes,
                _ => ranges.push(block.offset..block.offset + block.bytes),
            }
        }
        ranges
    }

    /// The cells of a patch with one motion, or all of them, from the bytes of [`Header::ranges`] put end to end.
    ///
    /// # Errors
    /// The bytes are damaged.
    pub fn decode(
        &self,
        patch: usize,
        point: Option<usize>,
        bytes: &[u8],
    ) -> Result<PatchFields, String> {
        let mesh_of = |point: usize| {
            let of_patch = self.meshes.get(patch);
            of_patch.and_then(|all| all.get(point)).copied()
        };
        let mut cells = PatchFields::default();
        match point {
            // The one mesh of the one motion.
            Some(_) => {
                cells.points.push(PointFields::default());
                cells.meshes.push(PatchCells::default());
            }
            None => {
                for point in 0..self.points(patch) {
                    let mesh = mesh_of(point).unwrap_or(0);
                    cells.points.push(PointFields {
                        mesh,
                        ..PointFields::default()
                    });
                }
                let meshes = self
                    .wanted(patch, None)
                    .filter(|block| block.point.is_none());
                let meshes = meshes.map(|block| block.mesh + 1).max().unwrap_or(0);
                cells.meshes.resize_with(meshes, PatchCells::default);
            }
        }
        let mut rest = bytes;
        for block in self.wanted(patch, point) {
            let length = usize::try_from(block.bytes).map_err(|error| error.to_string())?;
            let (packed, after) = rest
                .split_at_checked(length)
                .ok_or_else(|| format!("block {} is cut short", block.name))?;
            rest = after;
            let values = block.unpack(packed)?;
            let place = |at: usize| if point.is_some() { 0 } else { at };
            match block.point {
                None => block.put_cells(&mut cells.meshes[place(block.mesh)], &values)?,
                Some(at) => {
                    let point = cells.points.get_mut(place(at)).ok_or_else(|| {
                        format!("block {} belongs to a motion that is not there", block.name)
                    })?;
                    block.put_values(point, &values)?;
                }
            }
        }
        Ok(cells)
    }

    /// The blocks of a patch, or only those of one motion and of its cells.
    fn wanted(&self, patch: usize, point: Option<usize>) -> impl Iterator<Item = &Block> {
        let all = self.meshes.get(patch);
        let mesh = point.map(|at| all.and_then(|all| all.get(at)).copied().unwrap_or(0));
        self.blocks.iter().filter(move |block| {
            let wanted = match block.point {
                None => mesh.is_none_or(|mesh| mesh == block.mesh),
                Some(at) => point.is_none_or(|point| point == at),
            };
            block.patch == patch && wanted
        })
    }
}

impl Block {
    /// The little-endian values of the block.
    fn unpack(&self, packed: &[u8]) -> Result<Vec<u8>, String> {
        let size = match self.kind {
            Kind::F64 => 8,
            Kind::U32 => 4,
            Kind::U8 => 1,
        };
        let expected = self.count.checked_mul(size).ok_or("a block is too large")?;
        let values = zstd::bulk::decompress(packed, expected)
            .map_err(|error| format!("block {}: {error}", self.name))?;
        if values.len() == expected {
            Ok(values)
        } else {
            Err(format!(
                "block {}: {} bytes, {expected} expected",
                self.name,
                values.len()
            ))
        }
    }

    /// Puts a part of a mesh where it belongs.
    fn put_cells(&self, cells: &mut PatchCells, values: &[u8]) -> Result<(), String> {
        match self.name.as_str() {
            "x_mm" => cells.x_mm = read_f64(values),
            "y_mm" => cells.y_mm = read_f64(values),
            "dx_mm" => cells.dx_mm = read_f64(values),
            "dy_mm" => cells.dy_mm = read_f64(values),
            "strip" => cells.strip = read_u32(values),
            "pressure_mpa" => cells.pressure_mpa = Some(read_f64(values)),
            other => return Err(format!("unknown block {other}")),
        }
        Ok(())
    }

    /// Puts values of a motion where they belong.
    fn put_values(&self, point: &mut PointFields, values: &[u8]) -> Result<(), String> {
        match self.name.as_str() {
            "zone" => {
                point.zone = Some(
                    values
                        .iter()
                        .map(|code| zone_of(*code))
                        .collect::<Result<_, _>>()?,
                );
            }
            "traction_x_mpa" => point.traction_x_mpa = Some(read_f64(values)),
            "traction_y_mpa" => point.traction_y_mpa = Some(read_f64(values)),
            "slip_x" => point.slip_x = Some(read_f64(values)),
            "slip_y" => point.slip_y = Some(read_f64(values)),
            "temperature_c" => point.temperature_c = Some(read_f64(values)),
            "subsurface" => point.subsurface = Some(read_f64(values)),
            other => return Err(format!("unknown block {other}")),
        }
        Ok(())
    }
}

fn zone_of(code: u8) -> Result<Zone, String> {
    match code {
        0 => Ok(Zone::Stick),
        1 => Ok(Zone::Slip),
        other => Err(format!("unknown zone {other}")),
    }
}

fn read_f64(bytes: &[u8]) -> Vec<f64> {
    let (values, _) = bytes.as_chunks::<8>();
    values
        .iter()
        .map(|value| f64::from_le_bytes(*value))
        .collect()
}

fn read_u32(bytes: &[u8]) -> Vec<u32> {
    let (values, _) = bytes.as_chunks::<4>();
    values
        .iter()
        .map(|value| u32::from_le_bytes(*value))
        .collect()
}

#[cfg(test)]
mod tests {
    use crate::codec::encode::encode;
    use proptest::prelude::*;

    use super::*;
    use railhead_contact::solution::words::answer::Fields;

    /// Any bit pattern: NaN payloads, infinities and negative zero have to survive too.
    fn values(count: usize) -> impl Strategy<Value = Vec<f64>> {
        prop::collection::vec(any::<u64>().prop_map(f64::from_bits), count)
    }

    fn cells(count: usize) -> impl Strategy<Value = PatchCells> {
        (
            prop::array::uniform4(values(count)),
            prop::collection::vec(any::<u32>(), count),
            prop::option::of(values(count)),
        )
            .prop_map(
                |([x_mm, y_mm, dx_mm, dy_mm], strip, pressure_mpa)| PatchCells {
                    x_mm,
                    y_mm,
                    dx_mm,
                    dy_mm,
                    strip,
                    pressure_mpa,
                },
            )
    }

    fn patch() -> impl Strategy<Value = PatchFields> {
        (0_usize..40, 0_usize..4, 1_usize..3).prop_flat_map(|(count, points, meshes)| {
            let point = (
                0..meshes,
                prop::option::of(prop::collection::vec(any::<bool>(), count)),
                prop::array::uniform4(prop::option::of(values(count))),
            )
                .prop_map(
                    |(mesh, zone, [traction_x_mpa, traction_y_mpa, slip_x, slip_y])| PointFields {
                        mesh,
                        zone: zone.map(|z| {
                            z.into_iter()
                                .map(|slips| if slips { Zone::Slip } else { Zone::Stick })
                                .collect()
                        }),
                        traction_x_mpa,
                        traction_y_mpa,
                        slip_x,
                        slip_y: slip_y.clone(),
                        temperature_c: slip_y.clone(),
                        subsurface: slip_y,
                    },
                );
            (
                prop::collection::vec(cells(count), meshes),
                prop::collection::vec(point, points),
            )
                .prop_map(|(meshes, points)| PatchFields { meshes, points })
        })
    }

    fn read(file: &[u8], patch: usize, point: Option<usize>) -> PatchFields {
        let length = header_length(&file[..PREFIX_BYTES]).unwrap();
        let body = PREFIX_BYTES + length;
        let header = Header::read(&file[PREFIX_BYTES..body]).unwrap();
        let bytes = header
            .ranges(patch, point)
            .into_iter()
            .flat_map(|range| &file[body + range.start as usize..body + range.end as usize])
            .copied()
            .collect::<Vec<_>>();
        header.decode(patch, point, &bytes).unwrap()
    }

    /// Equality of every bit: NaN is equal to the same NaN here.
    fn bits(cells: &PatchFields) -> String {
        let f = |v: &Vec<f64>| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        let points = cells.points.iter().map(|p| {
            let o = |v: &Option<Vec<f64>>| v.as_ref().map(f);
            (
                p.mesh,
                p.zone.clone(),
                o(&p.traction_x_mpa),
                o(&p.traction_y_mpa),
                o(&p.slip_x),
                [o(&p.slip_y), o(&p.temperature_c), o(&p.subsurface)],
            )
        });
        let points = points.collect::<Vec<_>>();
        let meshes = cells.meshes.iter().map(|mesh| {
            let axes = [&mesh.x_mm, &mesh.y_mm, &mesh.dx_mm, &mesh.dy_mm].map(f);
            let pressure = mesh.pressure_mpa.as_ref().map(f);
            (axes, mesh.strip.clone(), pressure)
        });
        let meshes = meshes.collect::<Vec<_>>();
        format!("{meshes:?} {points:?}")
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn fields_come_back_bit_for_bit(patches in prop::collection::vec(patch(), 0..3)) {
            let fields = Fields { patches };
            let file = encode(&fields).unwrap();
            for (index, cells) in fields.patches.iter().enumerate() {
                prop_assert_eq!(bits(&read(&file, index, None)), bits(cells));
                for (at, point) in cells.points.iter().enumerate() {
                    let one = PatchFields {
                        meshes: vec![cells.cells(at).clone()],
                        points: vec![PointFields { mesh: 0, ..point.clone() }],
                    };
                    prop_assert_eq!(bits(&read(&file, index, Some(at))), bits(&one));
                }
            }
        }
    }

    #[test]
    fn one_patch_is_one_range() {
        let cells = PatchFields {
            meshes: vec![PatchCells {
                x_mm: vec![1.0, 2.0],
                ..PatchCells::default()
            }],
            points: vec![
                PointFields {
                    slip_x: Some(vec![0.5, 0.25]),
                    ..PointFields::default()
                };
                3
            ],
        };
        let file = encode(&Fields {
            patches: vec![cells.clone(), cells],
        })
        .unwrap();
        let length = header_length(&file).unwrap_or(0);
        assert_eq!(length, 0, "a longer prefix is not a prefix");
        let length = header_length(&file[..PREFIX_BYTES]).unwrap();
        let header = Header::read(&file[PREFIX_BYTES..PREFIX_BYTES + length]).unwrap();
        assert_eq!(header.patches(), 2);
        assert_eq!(header.points(1), 3);
        assert_eq!(header.ranges(1, None).len(), 1);
        assert_eq!(header.ranges(1, Some(2)).len(), 2);
        let end = header.ranges(1, None)[0].end as usize;
        assert_eq!(PREFIX_BYTES + length + end, file.len());
    }

    #[test]
    fn a_damaged_block_is_noticed() {
        let cells = PatchFields {
            meshes: vec![PatchCells {
                x_mm: (0..100).map(f64::from).collect(),
                ..PatchCells::default()
            }],
            points: vec![PointFields::default()],
        };
        let mut file = encode(&Fields {
            patches: vec![cells],
        })
        .unwrap();
        let length = header_length(&file[..PREFIX_BYTES]).unwrap();
        let body = PREFIX_BYTES + length;
        let header = Header::read(&file[PREFIX_BYTES..body]).unwrap();
        file[body + 40] ^= 1;
        assert!(header.decode(0, None, &file[body..]).is_err());
        assert!(header.decode(0, None, &file[body..body + 20]).is_err());
        assert!(header_length(b"RHFIELD1....").is_err());
    }
}
