//! A wheelset on both rails: its roll and height, the patches of both wheels, and its kinematics as a rigid body.

pub mod balance;
pub mod kinematics;
