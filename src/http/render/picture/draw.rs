//! Draws a patch: heat map or zones, the border of the stick zone, arrows, axes in mm and a scale; or the patch alone.

use crate::render::picture::chart::{
    Anchor, Chart, SLIP, STICK, Svg, WIDTH, colour_at, colour_bar, curves, escape, open, polyline,
    px,
};
use crate::render::shape::outlines::{outlines, patch_outline, resample};
use crate::render::shape::sheet::{AtBorder, Sheet, bounds};
use railhead_contact::case::words::solver::Output;
use railhead_contact::solution::words::answer::{PatchCells, PointFields, Zone};

/// Width in pixels below which the patch is drawn alone, because text would be unreadable.
const ALONE_BELOW: u32 = 200;
/// Number of colours of the scale; the eye sees no steps between this many.
const BANDS: u32 = 48;
/// Number of colours in a picture of the patch alone.
const BANDS_ALONE: u32 = 14;
/// Tolerance of simplified curves in pixels.
const TOLERANCE: f64 = 0.2;

/// Draws a scene as SVG, `width` pixels wide.
#[must_use]
pub(crate) fn draw(scene: &Scene, width: u32) -> Svg {
    if width < ALONE_BELOW {
        return draw_alone(scene, width);
    }
    let map = PatchMap::of(
        scene,
        BANDS,
        TOLERANCE * (WIDTH / f64::from(width)).max(1.0),
    );
    let chart = Chart::around(map.extent());
    let mut svg = open(&scene.title, &scene.remarks, width, chart.height());
    chart.grid(&mut svg);
    match heat(scene) {
        Some(heat) => {
            let range = heat.range(scene.range);
            map.heat(&mut svg, &chart, &heat, range);
            colour_bar(&mut svg, &chart, &heat, range);
        }
        None => map.zones(&mut svg, &chart),
    }
    map.borders(&mut svg, &chart);
    let components = match scene.shown {
        Output::Slip => (&scene.values.slip_x, &scene.values.slip_y),
        Output::Pressure | Output::Temperature => (&None, &None),
        _ => (&scene.values.traction_x_mpa, &scene.values.traction_y_mpa),
    };
    let drawn = match components {
        (Some(x), Some(y)) => arrows(&mut svg, &chart, &scene.fields, x, y),
        _ => false,
    };
    chart.axes(&mut svg, ["x in mm", "y in mm"]);
    rolling(&mut svg, &chart);
    legend(&mut svg, &chart, scene, drawn);
    svg.raw("</svg>\n");
    svg
}

/// Draws a patch alone, for lists.
fn draw_alone(scene: &Scene, width: u32) -> Svg {
    let map = PatchMap::of(scene, BANDS_ALONE, 1.5 * TOLERANCE);
    let chart = Chart::alone(map.extent(), f64::from(width));
    let height = px(chart.height_alone());
    let mut svg = Svg::default();
    svg.raw(&format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" role=\"img\">\n",
    ));
    svg.raw(&format!("<title>{}</title>\n", escape(&scene.title)));
    match heat(scene) {
        Some(heat) => map.heat(&mut svg, &chart, &heat, heat.range(scene.range)),
        None => map.zones(&mut svg, &chart),
    }
    map.border_thin(&mut svg, &chart);
    svg.raw("</svg>\n");
    svg
}

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
        colour_at((f64::from(band) + 0.5) / f64::from(self.bands))
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

/// Distance between arrows.
const ARROW_SPACING: f64 = 30.0;
/// Length of the longest arrow.
const ARROW_LENGTH: f64 = 27.0;
/// Length below which an arrow is omitted.
const ARROW_SHORTEST: f64 = 2.0;

/// Draws arrows on a regular grid, each centred on its sample. Returns whether any was drawn.
pub(super) fn arrows(
    svg: &mut Svg,
    chart: &Chart,
    fields: &PatchCells,
    along: &[f64],
    across: &[f64],
) -> bool {
    let shape = extent(fields);
    let count = |length: f64| {
        let arrows = length * chart.scale() / ARROW_SPACING;
        arrows.round().clamp(2.0, 100.0) as usize
    };
    let (nx, ny) = (count(shape[1] - shape[0]), count(shape[3] - shape[2]));
    let x = resample(fields, along, nx, ny);
    let y = resample(fields, across, nx, ny);
    let cells = along.iter().zip(across);
    let longest = cells.map(|(x, y)| x.hypot(*y)).fold(0.0, f64::max);
    if longest <= 0.0 {
        return false;
    }
    let mut data = String::new();
    for (iy, row) in x.values.iter().enumerate() {
        for (ix, along) in row.iter().enumerate() {
            let (Some(along), Some(across)) = (along, y.values[iy][ix]) else {
                continue;
            };
            // The second axis of the picture points downward.
            let arrow = [along, &-across].map(|part| part / longest * ARROW_LENGTH);
            if arrow[0].hypot(arrow[1]) >= ARROW_SHORTEST {
                data.push_str(&arrow_path(chart.at(x.x_mm[ix], x.y_mm[iy]), arrow));
            }
        }
    }
    svg.raw("<g fill=\"none\" stroke-linecap=\"round\" stroke-linejoin=\"round\">\n");
    svg.path(&data, "stroke=\"#fff\" stroke-width=\"2.8\"");
    svg.path(&data, "stroke=\"#000\" stroke-width=\"1.2\"");
    svg.raw("</g>\n");
    true
}

/// Returns the path of an arrow centred on a position.
fn arrow_path((x, y): (f64, f64), [dx, dy]: [f64; 2]) -> String {
    let length = dx.hypot(dy);
    let head = (0.35 * length).clamp(1.5, 6.0) / length;
    let (tip_x, tip_y) = (x + 0.5 * dx, y + 0.5 * dy);
    let stroke = |side: f64| {
        let (back_x, back_y) = (-dx * head, -dy * head);
        (
            tip_x + back_x - side * 0.5 * back_y,
            tip_y + back_y + side * 0.5 * back_x,
        )
    };
    let shaft = polyline([(x - 0.5 * dx, y - 0.5 * dy), (tip_x, tip_y)], false);
    shaft + &polyline([stroke(1.0), (tip_x, tip_y), stroke(-1.0)], false)
}

/// Draws the arrow of the rolling direction.
pub(super) fn rolling(svg: &mut Svg, chart: &Chart) {
    let [x, y, width, height] = chart.area;
    let (end, bottom) = (x + width, y + height);
    let place = (end - 52.0, bottom + 39.0);
    svg.text(place, 12.0, Anchor::End, "", "rolling");
    let arrow = arrow_path((end - 24.0, bottom + 35.0), [44.0, 0.0]);
    svg.path(&arrow, "fill=\"none\" stroke=\"#111\" stroke-width=\"1.8\"");
}

/// Draws the legend of lines and arrows below the axes.
pub(super) fn legend(svg: &mut Svg, chart: &Chart, scene: &Scene, arrows: bool) {
    let y = chart.area[1] + chart.area[3] + 66.0;
    let mut x = chart.area[0];
    let (stick, slip) = zones_present(scene);
    if scene.shown == Output::Zones {
        for (colour, word, present) in [(STICK, "stick", stick), (SLIP, "slip", slip)] {
            let word = match present {
                true => word.to_owned(),
                false => format!("{word} (nowhere)"),
            };
            let style = format!("fill=\"{colour}\" stroke=\"#111\"");
            svg.rect([x, y - 10.0, 22.0, 12.0], &style);
            svg.text((x + 28.0, y), 12.0, Anchor::Start, "", &word);
            x += if present { 84.0 } else { 150.0 };
        }
    } else if scene.values.zone.is_some() {
        if stick {
            let data = format!("M{} {}h26", px(x), px(y - 4.0));
            svg.path(&data, "stroke=\"#000\" stroke-width=\"3.4\"");
            svg.path(&data, "stroke=\"#fff\" stroke-width=\"1.6\"");
            let text = match slip {
                true => "border of the stick zone",
                false => "stick everywhere",
            };
            svg.text((x + 33.0, y), 12.0, Anchor::Start, "", text);
            x += 210.0;
        } else {
            svg.text((x, y), 12.0, Anchor::Start, "", "slip everywhere");
            x += 120.0;
        }
    }
    if arrows {
        let text = match scene.shown {
            Output::Slip => "slip of the upper body against the lower",
            _ => "traction on the lower body",
        };
        let arrow = arrow_path((x + 14.0, y - 4.0), [ARROW_LENGTH, 0.0]);
        svg.path(&arrow, "fill=\"none\" stroke=\"#000\" stroke-width=\"1.2\"");
        svg.text((x + 35.0, y), 12.0, Anchor::Start, "", text);
    }
}

/// The content of the picture of a patch.
#[derive(Debug, Clone)]
pub(crate) struct Scene {
    /// The title, a text of the client.
    pub title: String,
    /// At most two lines below the title.
    pub remarks: Vec<String>,
    /// The field that is coloured.
    pub shown: Output,
    /// The cells.
    pub fields: PatchCells,
    /// The values of one motion.
    pub values: PointFields,
    /// The ends of the scale; by default 0 and the largest value.
    pub range: Option<[f64; 2]>,
}

/// The values of a heat map.
pub(crate) struct Heat {
    /// Magnitude per cell.
    pub values: Vec<f64>,
    /// Their name.
    pub label: &'static str,
    /// Their unit; empty if they have none.
    pub unit: &'static str,
    /// Their behaviour at the border of the patch.
    pub edge: AtBorder,
}

impl Heat {
    /// Returns the ends of the scale, the second above the first.
    pub(crate) fn range(&self, asked: Option<[f64; 2]>) -> [f64; 2] {
        let largest = self.values.iter().copied().fold(0.0, f64::max);
        asked.unwrap_or([0.0, if largest > 0.0 { largest } else { 1.0 }])
    }
}

/// Returns the values of the heat map; `None` for zones.
pub(crate) fn heat(scene: &Scene) -> Option<Heat> {
    let magnitude = |x: &Option<Vec<f64>>, y: &Option<Vec<f64>>| {
        let (x, y) = (x.as_deref().unwrap_or(&[]), y.as_deref().unwrap_or(&[]));
        x.iter().zip(y).map(|(x, y)| x.hypot(*y)).collect()
    };
    let values = &scene.values;
    match scene.shown {
        Output::Tractions => Some(Heat {
            values: magnitude(&values.traction_x_mpa, &values.traction_y_mpa),
            label: "traction",
            unit: "MPa",
            edge: AtBorder::Vanishes,
        }),
        Output::Pressure => Some(Heat {
            values: scene.fields.pressure_mpa.clone().unwrap_or_default(),
            label: "pressure",
            unit: "MPa",
            edge: AtBorder::Vanishes,
        }),
        Output::Slip => Some(Heat {
            values: magnitude(&values.slip_x, &values.slip_y),
            label: "slip / rolling speed",
            unit: "",
            edge: AtBorder::Continues,
        }),
        Output::Temperature => Some(Heat {
            values: values.temperature_c.clone().unwrap_or_default(),
            label: "temperature",
            unit: "°C",
            edge: AtBorder::Continues,
        }),
        Output::Zones
        | Output::Resultants
        | Output::Subsurface
        | Output::Damage
        | Output::Gradients => None,
    }
}

/// Returns the bounding box `[x_min, x_max, y_min, y_max]` of the cells in mm.
pub(crate) fn extent(fields: &PatchCells) -> [f64; 4] {
    let shape = bounds((0..fields.x_mm.len()).flat_map(|cell| {
        let (x, y) = (fields.x_mm[cell], fields.y_mm[cell]);
        let (dx, dy) = (0.5 * fields.dx_mm[cell], 0.5 * fields.dy_mm[cell]);
        [[x - dx, y - dy], [x + dx, y + dy]]
    }));
    match shape.iter().all(|value| value.is_finite()) {
        true => shape,
        false => [-1.0, 1.0, -1.0, 1.0],
    }
}

/// Whether any cell sticks, and whether any cell slips.
pub(crate) fn zones_present(scene: &Scene) -> (bool, bool) {
    let zones = scene.values.zone.as_deref().unwrap_or(&[]);
    (zones.contains(&Zone::Stick), zones.contains(&Zone::Slip))
}
