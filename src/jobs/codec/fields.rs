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
//! A block is a zstd frame with checksum; inside are `count` little-endian values of its kind (`f64`, `u32` or `u8`), in
//! the cell order of [`PatchCells`]. `subsurface` has nine values per point: x, y, depth and the stress. Blocks are ordered
//! by patch, in each patch first the cells of every mesh (`point` is null), then the motions, so that one patch is one
//! range of bytes. An array that was not computed has no block. Zones are `u8`: 0 stick, 1 slip.

use std::io;
use std::ops::Range;

use serde::{Deserialize, Serialize};
use zstd::bulk::Compressor;

use crate::error::JobsError;
use railhead_contact::solution::words::answer::{
    Fields, PatchCells, PatchFields, PointFields, Zone,
};

const MAGIC: &[u8; 8] = b"RHFIELD2";

/// Length of the part before the header in bytes.
const PREFIX_BYTES: usize = 12;

/// Index of a stored file of fields.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    points: Vec<usize>,
    meshes: Vec<Vec<usize>>,
    blocks: Vec<Block>,
    /// End of the header in the file.
    #[serde(skip)]
    end: u64,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Block {
    patch: usize,
    point: Option<usize>,
    mesh: usize,
    name: String,
    kind: Kind,
    count: usize,
    offset: u64,
    bytes: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    F64,
    U32,
    U8,
}

impl Header {
    /// Reads the header at the beginning of a file. If `start` does not contain all of it, the error is its length with the
    /// part before it.
    ///
    /// # Errors
    /// The file has another signature, or the header cannot be parsed.
    pub fn read(start: &[u8]) -> Result<Result<Header, u64>, String> {
        let length = start.strip_prefix(MAGIC).and_then(<[u8]>::first_chunk);
        let length = length.ok_or("a file of fields does not begin with its mark")?;
        let end = PREFIX_BYTES as u64 + u64::from(u32::from_le_bytes(*length));
        let place = usize::try_from(end).unwrap_or(usize::MAX);
        let Some(text) = start.get(PREFIX_BYTES..place) else {
            return Ok(Err(end));
        };
        let read = serde_json::from_slice(text);
        let read: Header = read.map_err(|error| format!("header of a file of fields: {error}"))?;
        Ok(Ok(Header { end, ..read }))
    }

    /// Number of motions of a patch; 0 if it does not exist.
    fn points(&self, patch: usize) -> usize {
        self.points.get(patch).copied().unwrap_or(0)
    }

    /// The byte ranges of the file with the cells of a patch and the values of one motion or of all motions.
    ///
    /// # Errors
    /// The motion does not exist.
    pub fn ranges(&self, patch: usize, point: Option<usize>) -> Result<Vec<Range<u64>>, JobsError> {
        let points = self.points(patch);
        if point.is_some_and(|point| point >= points) {
            return Err(JobsError::NoSuchPoint(points));
        }
        let mut ranges: Vec<Range<u64>> = Vec::new();
        for block in self.wanted(patch, point) {
            let begin = self.end + block.offset;
            match ranges.last_mut() {
                Some(last) if last.end == begin => last.end += block.bytes,
                _ => ranges.push(begin..begin + block.bytes),
            }
        }
        Ok(ranges)
    }

    /// Decodes the cells of a patch with one motion or all motions, from the concatenated bytes of [`Header::ranges`].
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
            // One motion with its mesh.
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

    /// The blocks of a patch, or only those of one motion and its cells.
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
    /// Decompresses the little-endian values.
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

    /// Decodes an array of a mesh.
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

    /// Decodes an array of a motion.
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

const ZSTD_LEVEL: i32 = 3;

/// Encodes fields for storage.
///
/// # Errors
/// Compression failed.
pub fn encode(fields: &Fields) -> io::Result<Vec<u8>> {
    let mut compressor = Compressor::new(ZSTD_LEVEL)?;
    compressor.include_checksum(true)?;
    let mut blocks = Blocks {
        compressor,
        list: Vec::new(),
        body: Vec::new(),
    };
    for (patch, all) in fields.patches.iter().enumerate() {
        for (mesh, cells) in all.meshes.iter().enumerate() {
            let at = (patch, None, mesh);
            blocks.push_f64(at, "x_mm", Some(&cells.x_mm))?;
            blocks.push_f64(at, "y_mm", Some(&cells.y_mm))?;
            blocks.push_f64(at, "dx_mm", Some(&cells.dx_mm))?;
            blocks.push_f64(at, "dy_mm", Some(&cells.dy_mm))?;
            let strips = cells
                .strip
                .iter()
                .flat_map(|v| v.to_le_bytes())
                .collect::<Vec<_>>();
            blocks.push(at, "strip", Kind::U32, &strips, cells.strip.len())?;
            blocks.push_f64(at, "pressure_mpa", cells.pressure_mpa.as_ref())?;
        }
        for (point, values) in all.points.iter().enumerate() {
            let at = (patch, Some(point), 0);
            if let Some(zones) = &values.zone {
                let codes = zones
                    .iter()
                    .map(|zone| zone_code(*zone))
                    .collect::<Vec<_>>();
                blocks.push(at, "zone", Kind::U8, &codes, codes.len())?;
            }
            blocks.push_f64(at, "traction_x_mpa", values.traction_x_mpa.as_ref())?;
            blocks.push_f64(at, "traction_y_mpa", values.traction_y_mpa.as_ref())?;
            blocks.push_f64(at, "slip_x", values.slip_x.as_ref())?;
            blocks.push_f64(at, "slip_y", values.slip_y.as_ref())?;
            blocks.push_f64(at, "temperature_c", values.temperature_c.as_ref())?;
            blocks.push_f64(at, "subsurface", values.subsurface.as_ref())?;
        }
    }
    let header = serde_json::to_vec(&Header {
        points: fields
            .patches
            .iter()
            .map(|patch| patch.points.len())
            .collect(),
        meshes: fields
            .patches
            .iter()
            .map(|patch| patch.points.iter().map(|point| point.mesh).collect())
            .collect(),
        blocks: blocks.list,
        end: 0,
    })?;
    let header_length = u32::try_from(header.len()).map_err(io::Error::other)?;
    let mut file = Vec::with_capacity(PREFIX_BYTES + header.len() + blocks.body.len());
    file.extend_from_slice(MAGIC);
    file.extend_from_slice(&header_length.to_le_bytes());
    file.extend_from_slice(&header);
    file.extend_from_slice(&blocks.body);
    Ok(file)
}

/// Patch, motion and mesh of a block. The cells of a mesh have no motion; the values of a motion have mesh 0.
type Place = (usize, Option<usize>, usize);

/// Blocks that were encoded so far.
struct Blocks {
    /// Reused, because creating one takes longer than compressing a small block.
    compressor: Compressor<'static>,
    list: Vec<Block>,
    body: Vec<u8>,
}

impl Blocks {
    fn push_f64(&mut self, at: Place, name: &str, v: Option<&Vec<f64>>) -> io::Result<()> {
        let Some(values) = v else { return Ok(()) };
        let bytes = values
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect::<Vec<_>>();
        self.push(at, name, Kind::F64, &bytes, values.len())
    }

    fn push(
        &mut self,
        (patch, point, mesh): Place,
        name: &str,
        kind: Kind,
        values: &[u8],
        count: usize,
    ) -> io::Result<()> {
        let offset = self.body.len();
        self.body
            .extend_from_slice(&self.compressor.compress(values)?);
        self.list.push(Block {
            patch,
            point,
            mesh,
            name: name.to_owned(),
            kind,
            count,
            offset: offset as u64,
            bytes: (self.body.len() - offset) as u64,
        });
        Ok(())
    }
}

fn zone_code(zone: Zone) -> u8 {
    match zone {
        Zone::Stick => 0,
        Zone::Slip => 1,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

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
        let header = Header::read(file).unwrap().unwrap();
        let bytes = header
            .ranges(patch, point)
            .unwrap()
            .into_iter()
            .flat_map(|range| &file[range.start as usize..range.end as usize])
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
        let header = Header::read(&file).unwrap().unwrap();
        assert_eq!(Header::read(&file[..20]).unwrap(), Err(header.end));
        assert!(Header::read(&file[1..]).is_err());
        assert_eq!(header.points(1), 3);
        assert_eq!(header.ranges(1, Some(2)).unwrap().len(), 2);
        assert!(header.ranges(1, Some(3)).is_err());
        let ranges = header.ranges(1, None).unwrap();
        assert_eq!(ranges.len(), 1);
        assert_eq!(ranges[0].end as usize, file.len());
    }
}
