//! Measures of how reliable the points of a profile are. Pure functions of the points, in mm and MPa.
//!
//! The measures are local: they assess the profile where the bodies touch, and express defects as pressures that can be compared with
//! that of the contact (see [`readings`]).

pub mod noise;
pub mod points;
pub mod readings;
pub mod samples;
