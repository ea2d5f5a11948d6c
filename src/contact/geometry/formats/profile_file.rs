//! The contents of a profile file.

/// The contents of a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ProfileFile {
    /// Points `[y, z]` in mm, with the file's own shifts, rotation and mirroring applied.
    pub points: Vec<[f64; 2]>,
    /// Length of the file's unit in mm, if the file names its unit. Without a name the points are read as mm.
    pub unit_mm: Option<f64>,
    /// Whether y of the points is positive to the track centre, if the format specifies it.
    pub mirror_y: Option<bool>,
    /// Whether z of the points is positive up, if the format specifies it.
    pub mirror_z: Option<bool>,
    /// Whether the file describes a wheel, if it states the body.
    pub wheel: Option<bool>,
    /// The count of points that the header states, if it differs from the rows of the file, commented-out rows included.
    pub wrong_count: Option<usize>,
    /// Rows of numbers that were read as a part of the header: their count and the line of the first.
    pub header_rows: Option<(usize, usize)>,
}
