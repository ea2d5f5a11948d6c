//! How does the surface give? Displacement caused by tractions on the cells of a mesh.

pub mod coefficients;
pub mod fft;
pub mod logarithm;
pub mod strips;
