//! What the channels of pictures are called: viewers and compositors take `albedo.R` for the R of a layer `albedo`.

/// The picture.
pub const RGB: [&str; 3] = ["R", "G", "B"];
/// How much of a pixel is covered; without it, all is.
pub const ALPHA: &str = "A";
/// The picture before it was denoised.
pub const RAW: [&str; 3] = ["raw.R", "raw.G", "raw.B"];
/// How visible the noise is that a denoiser left.
pub const VISIBILITY_OF_VARIANCE: &str = "visibility_variance.Y";
/// How visible that is which a denoiser changed.
pub const VISIBILITY_OF_BIAS: &str = "visibility_bias.Y";
/// 1 where nothing shows that what a denoiser changed stays small.
pub const UNPROVEN: &str = "unproven.Y";
/// Share of light that the first surface scatters.
pub const ALBEDO: [&str; 3] = ["albedo.R", "albedo.G", "albedo.B"];
/// Where the first surface faces.
pub const NORMAL: [&str; 3] = ["normal.X", "normal.Y", "normal.Z"];
/// How far the first surface is from the camera, scene units.
pub const DEPTH: &str = "depth.Z";
/// Which object is seen.
pub const OBJECT_ID: &str = "id.Y";
/// How many samples the pixel has.
pub const SAMPLES: &str = "samples.Y";
/// Variance of the mean's luminance, (cd/m²)² of the scene.
pub const VARIANCE: &str = "variance.Y";
/// Standard error that is just at visibility 1, cd/m² on the display.
pub const THRESHOLD: &str = "threshold.Y";
/// What the eye is adapted to, cd/m².
pub const ADAPTATION: &str = "adaptation.Y";
/// How visible the noise is.
pub const VISIBILITY: &str = "visibility.Y";
/// Place of the surface's point in the next frame less that in this one, in pixels.
pub const VELOCITY: [&str; 2] = ["velocity.X", "velocity.Y"];
/// Place of the surface's point in the frame before less that in this one, in pixels.
pub const VELOCITY_TO_PREVIOUS: [&str; 2] = ["velocity_previous.X", "velocity_previous.Y"];
