//! Electro-optical transfer functions: between the number in a file and the light of a display.
//!
//! For numbers in files. Not for judging light, which is in cd/m² everywhere else
//! ([`crate::Display::luminance_cd_m2`]).

use serde::{Deserialize, Serialize};

/// How a display turns code values (0 to 1) into light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Eotf {
    /// IEC 61966-2-1, relative to white.
    Srgb,
    /// ITU-R BT.1886 with a black of 0: a power of 2.4, relative to white.
    Bt1886,
    /// SMPTE ST 2084: absolute, 1 is 10 000 cd/m².
    Pq,
    /// No curve.
    Linear,
}

/// The luminance of a PQ code of 1, cd/m² (SMPTE ST 2084).
pub const PQ_PEAK_CD_M2: f64 = 10_000.0;

/// Slope of the sRGB curve near black, where it is straight (IEC 61966-2-1).
pub const SRGB_SLOPE: f64 = 12.92;
/// Where that part ends, in linear light and in codes.
const SRGB_STRAIGHT_LIGHT: f64 = 0.003_130_8;
const SRGB_STRAIGHT_CODE: f64 = 0.040_45;
/// The rest is a power of linear light, scaled and lowered.
const SRGB_SCALE: f64 = 1.055;
const SRGB_LOWERED_BY: f64 = 0.055;
const SRGB_ROOT: f64 = 2.4;

const PQ_M1: f64 = 2610.0 / 16_384.0;
const PQ_M2: f64 = 2523.0 / 4096.0 * 128.0;
const PQ_C1: f64 = 3424.0 / 4096.0;
const PQ_C2: f64 = 2413.0 / 4096.0 * 32.0;
const PQ_C3: f64 = 2392.0 / 4096.0 * 32.0;

impl Eotf {
    /// Code value (clamped to 0..1) of linear light `relative` (1 = display white, which has `white_cd_m2`).
    ///
    /// Only [`Eotf::Pq`] needs `white_cd_m2`: its codes mean absolute luminances, and light of 0 is none. For a
    /// display whose black is brighter than that, encode what it emits over its white
    /// ([`Display::emitted_cd_m2`](crate::Display::emitted_cd_m2)). NaN gives 0.
    #[must_use]
    pub fn encode(self, relative: f64, white_cd_m2: f64) -> f64 {
        let light = if relative.is_nan() { 0.0 } else { relative.clamp(0.0, 1.0) };
        let code = match self {
            Self::Linear => light,
            Self::Srgb if light <= SRGB_STRAIGHT_LIGHT => SRGB_SLOPE * light,
            Self::Srgb => SRGB_SCALE * light.powf(1.0 / SRGB_ROOT) - SRGB_LOWERED_BY,
            Self::Bt1886 => light.powf(1.0 / 2.4),
            Self::Pq => {
                let power = (light * white_cd_m2 / PQ_PEAK_CD_M2).clamp(0.0, 1.0).powf(PQ_M1);
                ((PQ_C1 + PQ_C2 * power) / (1.0 + PQ_C3 * power)).powf(PQ_M2)
            }
        };
        code.clamp(0.0, 1.0)
    }

    /// The PQ code of a luminance, whatever the display.
    #[must_use]
    pub fn pq_code(cd_m2: f64) -> f64 {
        Self::Pq.encode(cd_m2 / PQ_PEAK_CD_M2, PQ_PEAK_CD_M2)
    }

    /// The luminance in cd/m² of a PQ code: the inverse of [`Eotf::pq_code`].
    #[must_use]
    pub fn pq_cd_m2(code: f64) -> f64 {
        Self::Pq.decode(code, PQ_PEAK_CD_M2) * PQ_PEAK_CD_M2
    }

    /// Linear light (1 = display white) of a code value (clamped to 0..1): the inverse of [`Eotf::encode`].
    #[must_use]
    pub fn decode(self, code: f64, white_cd_m2: f64) -> f64 {
        let code = if code.is_nan() { 0.0 } else { code.clamp(0.0, 1.0) };
        match self {
            Self::Linear => code,
            Self::Srgb if code <= SRGB_STRAIGHT_CODE => code / SRGB_SLOPE,
            Self::Srgb => ((code + SRGB_LOWERED_BY) / SRGB_SCALE).powf(SRGB_ROOT),
            Self::Bt1886 => code.powf(2.4),
            Self::Pq => {
                let power = code.powf(1.0 / PQ_M2);
                let light = ((power - PQ_C1).max(0.0) / (PQ_C2 - PQ_C3 * power)).powf(1.0 / PQ_M1);
                (light * PQ_PEAK_CD_M2 / white_cd_m2.max(f64::MIN_POSITIVE)).min(1.0)
            }
        }
    }
}

/// Linear value of a colour value in [0, 1] under the sRGB curve: [`Eotf::Srgb`] in single precision.
#[must_use]
pub fn srgb_to_linear(code: f32) -> f32 {
    if code <= SRGB_STRAIGHT_CODE as f32 {
        code / SRGB_SLOPE as f32
    } else {
        ((code + SRGB_LOWERED_BY as f32) / SRGB_SCALE as f32).powf(SRGB_ROOT as f32)
    }
}

/// The sRGB curve of a linear value clamped to [0, 1]: [`Eotf::Srgb`] in single precision. NaN stays.
#[must_use]
pub fn srgb_from_linear(light: f32) -> f32 {
    let light = light.clamp(0.0, 1.0);
    if light >= 1.0 {
        1.0 // the formula gives a little less, which dither would show as specks in a white area
    } else if light > SRGB_STRAIGHT_LIGHT as f32 {
        SRGB_SCALE as f32 * light.powf(1.0 / SRGB_ROOT as f32) - SRGB_LOWERED_BY as f32
    } else {
        SRGB_SLOPE as f32 * light
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decode_undoes_encode() {
        for eotf in [Eotf::Srgb, Eotf::Bt1886, Eotf::Pq, Eotf::Linear] {
            for step in 0..=100 {
                let light = f64::from(step) / 100.0;
                let back = eotf.decode(eotf.encode(light, 1000.0), 1000.0);
                assert!((back - light).abs() < 1e-4, "{eotf:?} {light} {back}");
            }
        }
    }

    #[test]
    fn known_codes() {
        assert!((Eotf::Srgb.encode(0.18, 200.0) - 0.461_356).abs() < 1e-5);
        // ST 2084: 100 cd/m² is code 0.508, 1000 cd/m² is 0.752.
        assert!((Eotf::Pq.encode(0.1, 1000.0) - 0.508_078).abs() < 1e-5);
        assert!((Eotf::Pq.encode(1.0, 1000.0) - 0.751_827).abs() < 1e-5);
        assert_eq!(Eotf::Srgb.encode(f64::NAN, 200.0), 0.0);
        assert!((Eotf::Srgb.encode(1e30, 200.0) - 1.0).abs() < 1e-12);
    }
}
