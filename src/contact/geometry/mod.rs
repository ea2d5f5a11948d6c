//! Cross-sections of wheel and rail: reading, quality, placement, first touch, and the distance between the bodies.

pub mod conicity;
pub mod contact_locus;
pub mod curve_place;
pub mod envelope;
pub mod formats;
pub mod holes;
pub mod locus_lines;
pub mod orientation;
pub mod plane_curve;
pub mod profile;
pub mod profile_quality;
pub mod reference_curve;
pub mod rigid_touch;
pub mod wheel_rail;
pub mod wheelset_pose;
