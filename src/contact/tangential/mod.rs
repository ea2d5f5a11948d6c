//! How does it drag? Tractions and slips for given pressure and motion.

pub mod boundary_element;
pub mod equations;
pub mod liu_hsu;
pub mod rules;
