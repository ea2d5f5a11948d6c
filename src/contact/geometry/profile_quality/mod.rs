//! How far can the points of a profile be trusted? Pure functions of the points, in mm and MPa.
//!
//! The measures are local: what counts is what the points leave open where the bodies touch, expressed as a pressure that compares with
//! that of the contact (see [`flattening`]).

pub mod flattening;
pub mod holes;
pub mod noise;
pub mod points;
pub mod readings;
pub mod samples;
pub mod shape;
