//! Checks that every number a client can read in an answer is finite, and names the first that is not.

use std::fmt::{self, Display};

use serde::ser::{
    Error, Impossible, Serialize, SerializeMap, SerializeSeq, SerializeStruct, SerializeTuple,
    Serializer,
};

use crate::contact::error::SolveError;
use crate::contact::solution::words::answer::{
    Fields, PatchCells, PatchFields, PointFields, Solution,
};

/// Refuses an answer that holds a number that is not finite.
///
/// # Errors
/// [`SolveError::NotFinite`] with the first such quantity.
pub fn require(solution: &Solution, fields: &Fields) -> Result<(), SolveError> {
    let found = first_in(solution).or_else(|| first_in_fields(fields));
    found.map_or(Ok(()), |quantity| Err(SolveError::NotFinite { quantity }))
}

/// The path of the first number of a value that is not finite.
fn first_in(value: &impl Serialize) -> Option<String> {
    let found = value.serialize(Finder).err()?;
    Some(found.0.trim_start_matches('.').to_owned())
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

/// The path to a number that is not finite; assembled from the innermost name outwards.
#[derive(Debug)]
struct Path(String);

impl Path {
    fn under(self, step: impl Display) -> Path {
        Path(format!("{step}{}", self.0))
    }
}

impl Display for Path {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Path {}

impl Error for Path {
    fn custom<T: Display>(message: T) -> Path {
        Path(message.to_string())
    }
}

/// A serializer that writes nothing and fails at the first number that is not finite.
struct Finder;

/// A list, map or structure being searched: the index of the next item, or the name of the next value.
#[derive(Default)]
struct Members {
    next: usize,
    key: String,
}

impl Members {
    fn item<T: Serialize + ?Sized>(&mut self, item: &T) -> Result<(), Path> {
        let number = self.next;
        self.next += 1;
        let visited = item.serialize(Finder);
        visited.map_err(|path| path.under(format_args!("[{number}]")))
    }
}

fn member<T: Serialize + ?Sized>(name: &str, value: &T) -> Result<(), Path> {
    let visited = value.serialize(Finder);
    visited.map_err(|path| path.under(format_args!(".{name}")))
}

/// Lists and tuples are searched in the same way.
macro_rules! items {
    ($($kind:ident),+) => {
        $(impl $kind for Members {
            type Ok = ();
            type Error = Path;

            fn serialize_element<T: Serialize + ?Sized>(&mut self, item: &T) -> Result<(), Path> {
                self.item(item)
            }

            fn end(self) -> Result<(), Path> {
                Ok(())
            }
        })+
    };
}

items!(SerializeSeq, SerializeTuple);

impl SerializeMap for Members {
    type Ok = ();
    type Error = Path;

    fn serialize_key<T: Serialize + ?Sized>(&mut self, key: &T) -> Result<(), Path> {
        let key = serde_json::to_value(key).map_err(Path::custom)?;
        self.key = key.as_str().unwrap_or_default().to_owned();
        Ok(())
    }

    fn serialize_value<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Path> {
        member(&self.key, value)
    }

    fn end(self) -> Result<(), Path> {
        Ok(())
    }
}

impl SerializeStruct for Members {
    type Ok = ();
    type Error = Path;

    fn serialize_field<T: Serialize + ?Sized>(
        &mut self,
        name: &'static str,
        value: &T,
    ) -> Result<(), Path> {
        member(name, value)
    }

    fn end(self) -> Result<(), Path> {
        Ok(())
    }
}

/// Kinds of values that cannot contain a number that is not finite.
macro_rules! passed {
    ($($method:ident: $kind:ty),+ $(,)?) => {
        $(fn $method(self, _: $kind) -> Result<(), Path> { Ok(()) })+
    };
}

impl Serializer for Finder {
    type Ok = ();
    type Error = Path;
    type SerializeSeq = Members;
    type SerializeTuple = Members;
    type SerializeTupleStruct = Impossible<(), Path>;
    type SerializeTupleVariant = Impossible<(), Path>;
    type SerializeMap = Members;
    type SerializeStruct = Members;
    type SerializeStructVariant = Impossible<(), Path>;

    passed! {
        serialize_bool: bool, serialize_i8: i8, serialize_i16: i16, serialize_i32: i32,
        serialize_i64: i64, serialize_u8: u8, serialize_u16: u16, serialize_u32: u32,
        serialize_u64: u64, serialize_char: char, serialize_str: &str, serialize_bytes: &[u8],
        serialize_unit_struct: &'static str,
    }

    fn serialize_f32(self, value: f32) -> Result<(), Path> {
        self.serialize_f64(value.into())
    }

    fn serialize_f64(self, value: f64) -> Result<(), Path> {
        if value.is_finite() {
            return Ok(());
        }
        Err(Path(String::new()))
    }

    fn serialize_none(self) -> Result<(), Path> {
        Ok(())
    }

    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Result<(), Path> {
        value.serialize(self)
    }

    fn serialize_unit(self) -> Result<(), Path> {
        Ok(())
    }

    fn serialize_unit_variant(self, _: &'static str, _: u32, _: &'static str) -> Result<(), Path> {
        Ok(())
    }

    fn serialize_newtype_struct<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        value: &T,
    ) -> Result<(), Path> {
        value.serialize(self)
    }

    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        _: u32,
        name: &'static str,
        value: &T,
    ) -> Result<(), Path> {
        member(name, value)
    }

    fn serialize_seq(self, _: Option<usize>) -> Result<Members, Path> {
        Ok(Members::default())
    }

    fn serialize_tuple(self, _: usize) -> Result<Members, Path> {
        Ok(Members::default())
    }

    fn serialize_tuple_struct(
        self,
        name: &'static str,
        _: usize,
    ) -> Result<Self::SerializeTupleStruct, Path> {
        Err(unvisited(name))
    }

    fn serialize_tuple_variant(
        self,
        name: &'static str,
        _: u32,
        _: &'static str,
        _: usize,
    ) -> Result<Self::SerializeTupleVariant, Path> {
        Err(unvisited(name))
    }

    fn serialize_map(self, _: Option<usize>) -> Result<Members, Path> {
        Ok(Members::default())
    }

    fn serialize_struct(self, _: &'static str, _: usize) -> Result<Members, Path> {
        Ok(Members::default())
    }

    fn serialize_struct_variant(
        self,
        name: &'static str,
        _: u32,
        _: &'static str,
        _: usize,
    ) -> Result<Self::SerializeStructVariant, Path> {
        Err(unvisited(name))
    }
}

/// A type that answers do not contain yet. It is reported as an error, so that the search is extended when one does.
fn unvisited(name: &str) -> Path {
    Path(format!(" (the search does not enter the type {name})"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::remark::list::Remark;

    #[derive(serde::Serialize)]
    struct Inner {
        pair: [f64; 2],
        maybe: Option<f64>,
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
