//! Complex indices of refraction of the metals that our own scene files may name; pbrt's and Mitsuba's have those of
//! `spectrum::named`, which are averaged over whole spectra.
//!
//! Read at 630, 532 and 465 nm (red, green and blue of Rec.709-like primaries), linearly between the tabulated
//! wavelengths of: gold, silver, copper: Johnson and Christy, Phys. Rev. B 6, 4370 (1972); iron, chromium: Johnson
//! and Christy, Phys. Rev. B 9, 5056 (1974); aluminium: McPeak et al., ACS Photonics 2, 326 (2015). Three
//! wavelengths are not a spectral render: gold comes out too pale, face on (0.942, 0.704, 0.403) where its
//! reflectance under D65 is (1.038, 0.728, 0.365), which Rec.709 does not hold. The metals of our scenes, and all
//! that was measured with them, are these.

use glam::Vec3;

/// Index of refraction η + ik per RGB channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metal {
    /// Real part.
    pub eta: Vec3,
    /// Imaginary part.
    pub k: Vec3,
}

const fn metal(eta: [f32; 3], k: [f32; 3]) -> Metal {
    Metal { eta: Vec3::from_array(eta), k: Vec3::from_array(k) }
}

/// Every metal by name.
pub const METALS: &[(&str, Metal)] = &[
    ("gold", metal([0.188, 0.544, 1.332], [3.403, 2.231, 1.869])),
    ("silver", metal([0.057, 0.054, 0.047], [4.254, 3.429, 2.803])),
    ("copper", metal([0.275, 1.116, 1.247], [3.373, 2.596, 2.456])),
    ("aluminium", metal([1.136, 0.728, 0.528], [6.663, 5.663, 4.943])),
    ("iron", metal([2.892, 2.895, 2.646], [3.065, 2.918, 2.805])),
    ("chromium", metal([3.145, 3.034, 2.456], [3.312, 3.330, 3.210])),
];
