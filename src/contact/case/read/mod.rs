//! From JSON text to a case, with every fault of the text.

pub mod contact;
pub mod damage;
pub mod draft;
pub mod evolution;
pub mod friction;
pub mod motion;
pub mod object;
pub mod samples;
pub mod solver;
pub mod subsurface;
pub mod wheel_rail;
pub mod wheelset;
