//! The coloured area of a picture: values or zones inside the border of the patch, and the borders.

use crate::render::picture::chart::Chart;
use crate::render::picture::colour::{SLIP, STICK, at};
use crate::render::picture::scene::{Heat, Scene, extent, zones_present};
use crate::render::picture::svg::{Svg, curves, polyline};
use crate::render::shape::outlines::{outlines, patch_outline};
use crate::render::shape::sheet::{AtBorder, Sheet};
use railhead_contact::solution::words::answer::Zone;

/// A patch to be drawn, and the resolution of the drawing.
pub(super) struct PatchMap<'a> {
    pub scene: &'a Scene,
    /// The curved grid; `None` if the patch has gaps or very few strips, so that every cell has its own colour.
    pub sheet: Option<Sheet>,
    /// Number of colours of the scale.
    pub bands: u32,
    /// Tolerance of simplified curves in units of the picture.
    pub tolerance: f64,
}

impl<'a> PatchMap<'a> {
    pub(super) fn of(scene: &'a Scene, bands: u32, tolerance: f64) -> PatchMap<'a> {
        let sheet = Sheet::new(&scene.fields);
        PatchMap {
            scene,
            sheet,
            bands,
            tolerance,
        }
    }

    /// Returns the bounding box `[x_min, x_max, y_min, y_max]` of the patch in mm.
    pub(super) fn extent(&self) -> [f64; 4] {
        let cells = || extent(&self.scene.fields);
        self.sheet.as_ref().map_or_else(cells, Sheet::extent)
    }

    fn curves(&self, chart: &Chart, loops: Vec<Vec<[f64; 2]>>) -> String {
        let placed = loops
            .into_iter()
            .map(|points| points.into_iter().map(|[x, y]| chart.at(x, y)).collect());
        curves(placed, self.tolerance)
    }

    /// Returns the index of the colour of a value.
    fn band(&self, value: f64, [low, high]: [f64; 2]) -> u32 {
        let share = ((value - low) / (high - low)).clamp(0.0, 1.0);
        let band = (share * f64::from(self.bands)) as u32;
        band.min(self.bands - 1)
    }

    fn colour(&self, band: u32) -> String {
        at((f64::from(band) + 0.5) / f64::from(self.bands))
    }

    /// Draws values between the ends of a scale. Every colour is drawn over those below it, so that there are no seams.
    pub(super) fn heat(&self, svg: &mut Svg, chart: &Chart, heat: &Heat, range: [f64; 2]) {
        let Some(sheet) = &self.sheet else {
            return self.cells(
                svg,
                chart,
                self.bands,
                |cell| self.band(heat.values[cell], range),
                |band| self.colour(band),
            );
        };
        let nodes = sheet.nodes(&heat.values, &self.scene.fields, heat.edge);
        let bands = heat.values.iter().map(|value| self.band(*value, range));
        let (lowest, highest) =
            bands.fold((self.bands, 0), |(a, b), band| (a.min(band), b.max(band)));
        let lowest = if heat.edge == AtBorder::Vanishes {
            0
        } else {
            lowest
        };
        let border = self.curves(chart, vec![sheet.border()]);
        svg.path(&border, &format!("fill=\"{}\"", self.colour(lowest)));
        for band in lowest + 1..=highest {
            let share = f64::from(band) / f64::from(self.bands);
            let level = range[0] + share * (range[1] - range[0]);
            let data = self.curves(chart, sheet.reaching(&nodes, level));
            if !data.is_empty() {
                svg.path(&data, &format!("fill=\"{}\"", self.colour(band)));
            }
        }
    }

    /// Draws stick and slip zones.
    pub(super) fn zones(&self, svg: &mut Svg, chart: &Chart) {
        let Some(zones) = self.scene.values.zone.as_deref() else {
            return;
        };
        let Some((sheet, stick)) = self.smooth_stick() else {
            let of = |cell: usize| u32::from(zones[cell] == Zone::Slip);
            let colour = |zone: u32| [STICK, SLIP][zone as usize].to_owned();
            return self.cells(svg, chart, 2, of, colour);
        };
        let border = self.curves(chart, vec![sheet.border()]);
        svg.path(&border, &format!("fill=\"{SLIP}\""));
        let stick = self.curves(chart, stick);
        svg.path(&stick, &format!("fill=\"{STICK}\" fill-rule=\"evenodd\""));
    }

    fn smooth_stick(&self) -> Option<(&Sheet, Vec<Vec<[f64; 2]>>)> {
        let sheet = self.sheet.as_ref()?;
        let stick = sheet.stick(&self.scene.fields, &self.scene.values)?;
        Some((sheet, stick))
    }

    /// Draws the cells of every class in the colour of the class.
    fn cells(
        &self,
        svg: &mut Svg,
        chart: &Chart,
        classes: u32,
        class: impl Fn(usize) -> u32,
        colour: impl Fn(u32) -> String,
    ) {
        let fields = &self.scene.fields;
        let classed: Vec<u32> = (0..fields.x_mm.len()).map(class).collect();
        // Crisp edges leave no light seams between cells.
        svg.raw("<g shape-rendering=\"crispEdges\">\n");
        for wanted in 0..classes {
            let data = polygons(chart, outlines(fields, Some(&classed), Some(wanted)));
            if !data.is_empty() {
                svg.path(&data, &format!("fill=\"{}\"", colour(wanted)));
            }
        }
        svg.raw("</g>\n");
    }

    /// Draws the border of the stick zone as a thin line, for small pictures.
    pub(super) fn border_thin(&self, svg: &mut Svg, chart: &Chart) {
        if let Some((_, stick)) = self.smooth_stick() {
            let stick = self.curves(chart, stick);
            if !stick.is_empty() {
                svg.path(&stick, "fill=\"none\" stroke=\"#fff\"");
            }
        }
    }

    /// Draws the borders of the patch and of the stick zone.
    pub(super) fn borders(&self, svg: &mut Svg, chart: &Chart) {
        let scene = self.scene;
        let patch = match &self.sheet {
            Some(sheet) => self.curves(chart, vec![sheet.border()]),
            None => polygons(chart, patch_outline(&scene.fields)),
        };
        svg.path(&patch, "fill=\"none\" stroke=\"#111\" stroke-width=\"1.2\"");
        if !zones_present(scene).0 {
            return;
        }
        let stick = match self.smooth_stick() {
            Some((_, stick)) => self.curves(chart, stick),
            None => {
                let zones = scene.values.zone.as_deref();
                polygons(chart, outlines(&scene.fields, zones, Some(Zone::Stick)))
            }
        };
        // A white line in a black one is visible on every colour of the scale.
        svg.path(
            &stick,
            "fill=\"none\" stroke=\"#000\" stroke-width=\"3.4\" stroke-linejoin=\"round\"",
        );
        svg.path(
            &stick,
            "fill=\"none\" stroke=\"#fff\" stroke-width=\"1.6\" stroke-linejoin=\"round\"",
        );
    }
}

/// Returns the path of closed polygons.
fn polygons(chart: &Chart, loops: Vec<Vec<[f64; 2]>>) -> String {
    let data = loops
        .into_iter()
        .map(|points| polyline(points.into_iter().map(|[x, y]| chart.at(x, y)), true));
    data.collect()
}
