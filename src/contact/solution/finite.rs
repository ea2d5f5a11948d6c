//! Checks that every number a client can read in an answer is finite, and names the first that is not.

use std::io::{Error, Result, Write, sink};

use serde::Serialize;
use serde_json::ser::{Formatter, Serializer};

use crate::contact::error::SolveError;
use crate::contact::solution::words::answer::{
    Fields, PatchCells, PatchFields, PointFields, Solution,
};

/// Members that are `null` where there is nothing to say, with those around them.
const NULLS: [&str; 4] = [
    "error_estimate",
    "normalised.creepage_x",
    "normalised.creepage_y",
    "normalised.spin",
];

/// Refuses an answer that holds a number that is not finite.
///
/// # Errors
/// [`SolveError::NotFinite`] with the first such quantity.
pub fn require(solution: &Solution, fields: &Fields) -> std::result::Result<(), SolveError> {
    let found = first_in(solution).or_else(|| first_in_fields(fields));
    found.map_or(Ok(()), |quantity| Err(SolveError::NotFinite { quantity }))
}

/// The path of the first number of a value that is not finite: JSON has no such numbers, and has `null` in their place.
fn first_in(value: &impl Serialize) -> Option<String> {
    let mut path = Path::default();
    let finder = Finder(&mut path);
    let written = value.serialize(&mut Serializer::with_formatter(sink(), finder));
    written.err().map(|_| path.name())
}

fn first_in_fields(fields: &Fields) -> Option<String> {
    let mut patches = fields.patches.iter().enumerate();
    patches.find_map(|(p, patch)| Some(format!("patches[{p}].{}", first_in_patch(patch)?)))
}

fn first_in_patch(patch: &PatchFields) -> Option<String> {
    let mut meshes = patch.meshes.iter().enumerate();
    let in_meshes =
        meshes.find_map(|(k, mesh)| Some(format!("meshes[{k}].{}", first_in_cells(mesh)?)));
    let mut points = patch.points.iter().enumerate();
    in_meshes.or_else(|| {
        points.find_map(|(k, point)| Some(format!("points[{k}].{}", first_in_point(point)?)))
    })
}

fn first_in_cells(mesh: &PatchCells) -> Option<String> {
    first_of(&[
        ("x_mm", Some(&mesh.x_mm)),
        ("y_mm", Some(&mesh.y_mm)),
        ("dx_mm", Some(&mesh.dx_mm)),
        ("dy_mm", Some(&mesh.dy_mm)),
        ("pressure_mpa", mesh.pressure_mpa.as_ref()),
    ])
}

fn first_in_point(point: &PointFields) -> Option<String> {
    first_of(&[
        ("traction_x_mpa", point.traction_x_mpa.as_ref()),
        ("traction_y_mpa", point.traction_y_mpa.as_ref()),
        ("slip_x", point.slip_x.as_ref()),
        ("slip_y", point.slip_y.as_ref()),
        ("temperature_c", point.temperature_c.as_ref()),
        ("subsurface", point.subsurface.as_ref()),
    ])
}

fn first_of(all: &[(&str, Option<&Vec<f64>>)]) -> Option<String> {
    all.iter().find_map(|(name, values)| {
        let cell = values
            .as_ref()?
            .iter()
            .position(|value| !value.is_finite())?;
        Some(format!("{name}[{cell}]"))
    })
}

/// The way to the value that is being written.
#[derive(Default)]
struct Path {
    steps: Vec<Step>,
    /// The names of the members on the way, one behind the other.
    names: String,
    /// The name of a member is being written.
    in_name: bool,
}

enum Step {
    /// A member, and where its name begins.
    Member(usize),
    /// A place in an array.
    Item(usize),
}

impl Path {
    fn name(&self) -> String {
        let mut name = String::new();
        let mut end = self.names.len();
        for step in self.steps.iter().rev() {
            let step = match step {
                Step::Member(start) => format!(
                    ".{}",
                    &self.names[*start..std::mem::replace(&mut end, *start)]
                ),
                Step::Item(place) => format!("[{place}]"),
            };
            name.insert_str(0, &step);
        }
        name.trim_start_matches('.').to_owned()
    }
}

/// Writes nothing, and stops at a `null` that stands for a number.
struct Finder<'a>(&'a mut Path);

impl Formatter for Finder<'_> {
    fn write_null<W: ?Sized + Write>(&mut self, _: &mut W) -> Result<()> {
        let name = self.0.name();
        match NULLS.iter().any(|member| name.ends_with(member)) {
            true => Ok(()),
            false => Err(Error::other("a number that is not finite")),
        }
    }

    fn begin_array<W: ?Sized + Write>(&mut self, _: &mut W) -> Result<()> {
        self.0.steps.push(Step::Item(0));
        Ok(())
    }

    fn end_array_value<W: ?Sized + Write>(&mut self, _: &mut W) -> Result<()> {
        if let Some(Step::Item(place)) = self.0.steps.last_mut() {
            *place += 1;
        }
        Ok(())
    }

    fn end_array<W: ?Sized + Write>(&mut self, _: &mut W) -> Result<()> {
        self.0.steps.pop();
        Ok(())
    }

    fn begin_object_key<W: ?Sized + Write>(&mut self, _: &mut W, _: bool) -> Result<()> {
        self.0.steps.push(Step::Member(self.0.names.len()));
        self.0.in_name = true;
        Ok(())
    }

    fn write_string_fragment<W: ?Sized + Write>(&mut self, _: &mut W, part: &str) -> Result<()> {
        if self.0.in_name {
            self.0.names.push_str(part);
        }
        Ok(())
    }

    fn end_object_key<W: ?Sized + Write>(&mut self, _: &mut W) -> Result<()> {
        self.0.in_name = false;
        Ok(())
    }

    fn end_object_value<W: ?Sized + Write>(&mut self, _: &mut W) -> Result<()> {
        if let Some(Step::Member(start)) = self.0.steps.pop() {
            self.0.names.truncate(start);
        }
        Ok(())
    }

    fn write_f64<W: ?Sized + Write>(&mut self, _: &mut W, _: f64) -> Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::remark::list::Remark;

    #[derive(serde::Serialize)]
    struct Inner {
        pair: [f64; 2],
        #[serde(skip_serializing_if = "Option::is_none")]
        maybe: Option<f64>,
        error_estimate: Option<f64>,
        remark: crate::contact::remark::entry::RemarkEntry,
    }

    #[derive(serde::Serialize)]
    struct Outer {
        word: &'static str,
        list: Vec<Inner>,
    }

    fn outer(pair: [f64; 2], maybe: Option<f64>) -> Outer {
        let inner = |pair, maybe| Inner {
            pair,
            maybe,
            error_estimate: None,
            remark: Remark::OnPlanes {
                reason: String::new(),
            }
            .at_patch(1),
        };
        let list = vec![inner([0.0; 2], None), inner(pair, maybe)];
        Outer { word: "NaN", list }
    }

    #[test]
    fn the_first_number_that_is_not_finite_is_named() {
        assert_eq!(first_in(&outer([1.0, -0.0], Some(f64::MAX))), None);
        assert_eq!(first_in(&outer([1.0, 0.0], None)), None);
        let named = |value| first_in(&value);
        assert_eq!(
            named(outer([1.0, f64::NAN], None)).as_deref(),
            Some("list[1].pair[1]")
        );
        assert_eq!(
            named(outer([1.0; 2], Some(f64::INFINITY))).as_deref(),
            Some("list[1].maybe")
        );
    }

    #[test]
    fn cells_are_searched_too() {
        let mut patch = PatchFields {
            meshes: vec![PatchCells::default()],
            points: vec![PointFields::default(); 2],
        };
        let fields = |patch: &PatchFields| Fields {
            patches: vec![PatchFields::default(), patch.clone()],
        };
        assert_eq!(first_in_fields(&fields(&patch)), None);
        patch.points[1].slip_y = Some(vec![0.0, f64::NEG_INFINITY]);
        assert_eq!(
            first_in_fields(&fields(&patch)).as_deref(),
            Some("patches[1].points[1].slip_y[1]")
        );
    }
}
