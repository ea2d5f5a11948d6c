//! The words of a case: units in the names, no arithmetic.

pub mod canonical;
pub mod contact;
pub mod damage;
pub mod evolution;
pub mod friction;
pub mod history;
pub mod material;
pub mod motion;
pub mod question;
pub mod solver;
pub mod subsurface;
