//! Fields into their stored form.

use std::io::{Error, Result};

use zstd::bulk::Compressor;

use crate::codec::fields::{Block, Header, Kind, MAGIC, PREFIX_BYTES};
use railhead_contact::solution::words::answer::{Fields, Zone};

const ZSTD_LEVEL: i32 = 3;

/// Brings fields into their stored form.
///
/// # Errors
/// Compression ran out of memory.
pub fn encode(fields: &Fields) -> Result<Vec<u8>> {
    let mut compressor = Compressor::new(ZSTD_LEVEL)?;
    compressor.include_checksum(true)?;
    let mut blocks = Blocks {
        compressor,
        list: Vec::new(),
        body: Vec::new(),
    };
    for (patch, all) in fields.patches.iter().enumerate() {
        for (mesh, cells) in all.meshes.iter().enumerate() {
            let at = Place::cells(patch, mesh);
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
            let at = Place::values(patch, point);
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
    })?;
    let header_length = u32::try_from(header.len()).map_err(Error::other)?;
    let mut file = Vec::with_capacity(PREFIX_BYTES + header.len() + blocks.body.len());
    file.extend_from_slice(MAGIC);
    file.extend_from_slice(&header_length.to_le_bytes());
    file.extend_from_slice(&header);
    file.extend_from_slice(&blocks.body);
    Ok(file)
}

/// What a block belongs to.
#[derive(Clone, Copy)]
struct Place {
    patch: usize,
    point: Option<usize>,
    mesh: usize,
}

impl Place {
    /// The cells of a mesh.
    fn cells(patch: usize, mesh: usize) -> Place {
        let point = None;
        Place { patch, point, mesh }
    }

    /// The values of a motion.
    fn values(patch: usize, point: usize) -> Place {
        let (point, mesh) = (Some(point), 0);
        Place { patch, point, mesh }
    }
}

/// Blocks in the making.
struct Blocks {
    /// Kept for all blocks: making one takes longer than compressing a small block.
    compressor: Compressor<'static>,
    list: Vec<Block>,
    body: Vec<u8>,
}

impl Blocks {
    fn push_f64(&mut self, at: Place, name: &str, v: Option<&Vec<f64>>) -> Result<()> {
        let Some(values) = v else { return Ok(()) };
        let bytes = values
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect::<Vec<_>>();
        self.push(at, name, Kind::F64, &bytes, values.len())
    }

    fn push(
        &mut self,
        at: Place,
        name: &str,
        kind: Kind,
        values: &[u8],
        count: usize,
    ) -> Result<()> {
        let offset = self.body.len();
        self.body
            .extend_from_slice(&self.compressor.compress(values)?);
        self.list.push(Block {
            patch: at.patch,
            point: at.point,
            mesh: at.mesh,
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
