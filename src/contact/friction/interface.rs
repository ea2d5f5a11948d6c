//! What lies between the bodies and makes the contact softer to tractions.

/// The interface of the two surfaces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interface {
    /// Kalker's reduction factor k, more than 0 and at most 1: tractions displace the surfaces 1/k times as far.
    pub reduction: f64,
    /// Flexibility of an elastic layer in mm³/N, its thickness over its shear modulus: the displacement difference of the surfaces grows
    /// by this times the traction of the same place. 0 without a layer.
    pub layer: f64,
    /// The stress at which the layer yields, where it does.
    pub yielding: Option<LayerYield>,
}

/// A layer that yields: it transmits no more than a stress that grows with its plastic shear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayerYield {
    /// Shear stress in MPa at which it begins to yield.
    pub stress: f64,
    /// Growth of that stress in MPa per mm of plastic displacement, not negative.
    pub hardening: f64,
}

impl Default for Interface {
    /// Clean surfaces.
    fn default() -> Self {
        Interface {
            reduction: 1.0,
            layer: 0.0,
            yielding: None,
        }
    }
}
