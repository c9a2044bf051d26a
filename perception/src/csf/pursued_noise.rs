//! Fresh noise before an eye that moves: each frame is smeared over the retina while it is held.
//!
//! Not for an eye at rest, to which this is [`super::FreshNoise`], nor for displays that flash: there is no smear
//! where frames are lit for an instant.

use super::castle::CastleCsf;
use super::castle_temporal::{Energies, sustained_response, transient, transient_response};
use super::fresh_noise::HIGHEST_HZ;
use super::{ContrastSensitivity, FrameTiming};
use crate::error::Error;
use crate::table::Between;
use std::f64::consts::FRAC_PI_2;

/// How much less of noise that is new in every frame an eye sees that follows something.
///
/// A grating of ρ cycles a degree that is held for T p (T the time of a frame, p the share for which it is lit)
/// passes an eye of velocity v at s = ρ v cos θ Hz, θ being the angle between the two. Drawn anew in each frame, it
/// has the power density T sinc²((f − s) T p) on the retina: that of [`super::FreshNoise`], moved by s. Weighted with
/// castleCSF's temporal sensitivity, squared, and averaged over θ it is what is left of the energy of white noise.
#[derive(Clone, Debug)]
pub(crate) struct PursuedNoise {
    csf: CastleCsf,
    luminance_cd_m2: f64,
    /// Energies by s in steps of [`Self::step_hz`].
    by_shift: Vec<Energies>,
    step_hz: f64,
}

/// Steps for each lobe of the noise's spectrum, which is 1 / (T p) wide.
const STEPS_PER_LOBE: usize = 8;
/// Beyond so many lobes what is left counts as constant, which is more than there is.
const LOBES: usize = 16;
const ANGLES: usize = 16;
const HZ_STEP: f64 = 0.5;

impl PursuedNoise {
    /// Under an adaptation luminance, for patterns that cover `area_deg2` square degrees.
    pub(crate) fn new(area_deg2: f64, timing: FrameTiming, luminance_cd_m2: f64) -> Result<Self, Error> {
        timing.check()?;
        let held_s = timing.persistence / timing.frames_per_second;
        let step_hz = 1.0 / (held_s * STEPS_PER_LOBE as f64);
        let bins = (HIGHEST_HZ / HZ_STEP) as usize;
        let responses: Vec<(f64, [f64; 2])> = (0..bins)
            .map(|bin| (bin as f64 + 0.5) * HZ_STEP)
            .map(|hz| (hz, [sustained_response(hz), transient_response(hz, luminance_cd_m2)]))
            .collect();
        let at_shift = |shift_hz: f64| {
            let mut energies = Energies::default();
            for &(hz, [sustained, transient]) in &responses {
                let density = timing.held(hz - shift_hz).powi(2) + timing.held(hz + shift_hz).powi(2);
                energies.sustained += density * sustained * sustained;
                energies.mixed += density * sustained * transient;
                energies.transient += density * transient * transient;
            }
            energies
        };
        let by_shift = (0..=LOBES * STEPS_PER_LOBE).map(|step| at_shift(step as f64 * step_hz)).collect();
        Ok(Self { csf: CastleCsf::new(area_deg2)?, luminance_cd_m2, by_shift, step_hz })
    }

    /// Energy that an eye of `velocity_deg_s` receives of noise of one spatial frequency, over that which it receives
    /// at rest.
    pub(crate) fn energy_left(&self, freq_cpd: f64, velocity_deg_s: f64) -> f64 {
        let channels = [
            self.csf.sensitivity(freq_cpd, self.luminance_cd_m2),
            transient(freq_cpd, self.luminance_cd_m2, self.csf.area_deg2()),
        ];
        self.energy_left_of(channels, freq_cpd * velocity_deg_s)
    }

    /// [`Self::energy_left`] for sensitivities of the sustained and the transient channel, of noise that passes at so
    /// many Hz along its own direction.
    fn energy_left_of(&self, channels: [f64; 2], passing_hz: f64) -> f64 {
        let angle = |index: usize| FRAC_PI_2 * (index as f64 + 0.5) / ANGLES as f64;
        let at_angle = |index| self.energy(channels, passing_hz * angle(index).cos());
        (0..ANGLES).map(at_angle).sum::<f64>() / (ANGLES as f64 * self.energy(channels, 0.0))
    }

    fn energy(&self, [sustained, transient]: [f64; 2], shift_hz: f64) -> f64 {
        let Between { below, above, share } = Between::of(shift_hz / self.step_hz, self.by_shift.len());
        let [low, high] = [below, above].map(|step| self.by_shift[step].seen_by(sustained, transient));
        (1.0 - share) * low + share * high
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::csf::FreshNoise;

    fn noise(frames_per_second: f64, persistence: f64) -> PursuedNoise {
        PursuedNoise::new(1.0, FrameTiming { frames_per_second, persistence }, 100.0).expect("in range")
    }

    /// The energy at rest is that of fresh noise, by its own integral.
    #[test]
    fn at_rest_it_is_fresh_noise() {
        let timing = FrameTiming { frames_per_second: 24.0, persistence: 1.0 };
        let (pursued, fresh) = (noise(24.0, 1.0), FreshNoise::new(1.0, timing).expect("in range"));
        for (a, b) in [(1.0, 4.0), (4.0, 16.0)] {
            let own = |freq| {
                let channels = [pursued.csf.sensitivity(freq, 100.0), transient(freq, 100.0, 1.0)];
                pursued.energy(channels, 0.0)
            };
            let expected = (fresh.sensitivity(a, 100.0) / fresh.sensitivity(b, 100.0)).powi(2);
            assert!((own(a) / own(b) / expected - 1.0).abs() < 0.01, "{a} {b}");
        }
        assert!((noise(60.0, 1.0).energy_left(8.0, 1e-3) - 1.0).abs() < 1e-4);
    }

    /// Where the eye integrates over many frames, what is left is the smear's own share: the mean of sinc² over
    /// directions.
    #[test]
    fn fast_frames_are_smeared_as_a_shutter_would() {
        let (freq_cpd, velocity_deg_s) = (8.0, 20.0);
        let timing = FrameTiming { frames_per_second: 240.0, persistence: 1.0 };
        let angle = |index: usize| FRAC_PI_2 * (index as f64 + 0.5) / 1000.0;
        let smear: f64 =
            (0..1000).map(|i| timing.held(freq_cpd * velocity_deg_s * angle(i).cos()).powi(2)).sum::<f64>() / 1000.0;
        let left = noise(240.0, 1.0).energy_left(freq_cpd, velocity_deg_s);
        assert!((left / smear - 1.0).abs() < 0.1, "{left} {smear}");
    }

    /// Of the sustained channel alone, against sums in steps of 0.01 Hz up to 400 Hz and over 200 directions
    /// (`benches/peers/fresh_noise.py`).
    #[test]
    fn energies_agree_with_fine_quadrature() {
        for (fps, freq_cpd, velocity_deg_s, expected) in [
            (24.0, 16.0, 1.0, 0.5485),
            (24.0, 16.0, 4.0, 0.1280),
            (24.0, 24.0, 2.0, 0.1683),
            (60.0, 16.0, 1.0, 0.8924),
            (60.0, 16.0, 4.0, 0.2912),
            (60.0, 24.0, 2.0, 0.4196),
        ] {
            let left = noise(fps, 1.0).energy_left_of([1.0, 0.0], freq_cpd * velocity_deg_s);
            assert!((left / expected - 1.0).abs() < 0.03, "{fps} {freq_cpd} {velocity_deg_s}: {left}, not {expected}");
        }
    }

    #[test]
    fn faster_eyes_and_longer_frames_see_less() {
        for freq_cpd in [4.0, 16.0] {
            let left = [0.0, 1.0, 4.0, 16.0, 64.0].map(|v| noise(24.0, 1.0).energy_left(freq_cpd, v));
            assert!(left.windows(2).all(|pair| pair[1] < pair[0]), "{freq_cpd}: {left:?}");
            assert!(noise(60.0, 1.0).energy_left(freq_cpd, 4.0) > noise(24.0, 1.0).energy_left(freq_cpd, 4.0));
            // A display that flashes smears nothing.
            assert!(noise(60.0, 0.001).energy_left(freq_cpd, 4.0) > 0.99);
        }
        assert!(PursuedNoise::new(1.0, FrameTiming { frames_per_second: 0.0, persistence: 1.0 }, 100.0).is_err());
    }
}
