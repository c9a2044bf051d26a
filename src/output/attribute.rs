//! Names of attributes that are written in one place and read or written in another.

/// The display that a picture was made for, see [`super::display_attribute`].
pub const DISPLAY: &str = "fechner.display";
/// The fit of the tone operator, see [`super::tone_attribute`].
pub const TONE: &str = "fechner.tone";
/// The tone operator in words.
pub const OPERATOR: &str = "fechner.operator";
/// The scene's name: renders have it, and no others.
pub const SCENE: &str = "fechner.scene";
/// The threshold model.
pub const MODEL: &str = "fechner.model";
/// The contrast sensitivity function.
pub const CSF: &str = "fechner.csf";
/// What the display is called.
pub const OBSERVER_DISPLAY: &str = "fechner.observer.display";
/// Pixels a degree of visual angle along a row.
pub const OBSERVER_PIXELS_PER_DEGREE: &str = "fechner.observer.pixels_per_degree";
/// Luminance of the display's white.
pub const OBSERVER_WHITE_CD_M2: &str = "fechner.observer.white_cd_m2";
/// Luminance of the display's black.
pub const OBSERVER_BLACK_CD_M2: &str = "fechner.observer.black_cd_m2";
/// The room's light on the screen.
pub const OBSERVER_AMBIENT_CD_M2: &str = "fechner.observer.ambient_cd_m2";
