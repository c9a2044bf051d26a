//! The wave-optical model of He, Torrance, Sillion and Greenberg: surfaces whose relief is of the size of the light's
//! wavelength, which look glossier the flatter one looks at them.
//!
//! Parameters: `eta` and `k`, index of refraction per linear RGB channel (k of 0 is a dielectric's face); the relief's
//! root mean square height σ₀ and autocorrelation length τ in nanometres, both of a Gaussian relief; `diffuse`, albedo
//! per channel in [0, 1] of what leaves after scattering beneath the surface or between its hills.
//!
//! In it: the specular term (a delta lobe of weight F·S·e^−g), the directional-diffuse term with its series, effective
//! roughness and Smith's shadowing, at one wavelength a channel (610, 550, 465 nm), and the uniform-diffuse term. Left
//! out: polarisation. Of own making: the uniform-diffuse term is coupled by (1 − F(μo))(1 − F(μi)), which the paper
//! leaves a constant without a bound on energy, and the series beyond g = 40, expanded around its largest term. The
//! Kirchhoff approximation beneath it all overshoots: a lossless relief of 50 nm over 1500 nm gives back 1.034 of the
//! light at a cosine of 0.15.
//!
//! Source: X. He, K. Torrance, F. Sillion & D. Greenberg, *A comprehensive physical model for light reflection*
//! (SIGGRAPH 1991), eqs. 5, 23 to 25, 57 to 79; its factor G is (v·v/v_z)² once the products of polarisation vectors
//! are multiplied out. Not for coarse relief (use the conductor: it is the limit, and far cheaper).

use super::microfacets::Microfacets;
use super::mirror::reflect_about_normal;
use super::{BsdfEvaluation, BsdfSample, fresnel, to_front, turn, warp};
use crate::scene::Distribution;
use glam::Vec3;
use libm::erfcf;
use std::f32::consts::{FRAC_1_PI, PI, TAU};

/// The wavelengths that stand for the channels, in nanometres.
const WAVELENGTHS_NM: [f32; 3] = [610.0, 550.0, 465.0];

/// Height of relief below which a face is a mirror: g is below 1e-9, and e^−g is 1 to `f32`.
const FLATTEST_NM: f32 = 1e-3;

/// A Gaussian relief of the size of a wavelength.
#[derive(Clone, Copy, Debug)]
pub struct HeTorrance {
    eta: Vec3,
    k: Vec3,
    height_nm: f32,
    correlation_nm: f32,
    diffuse: Vec3,
    /// 1 − the average reflectance of a smooth face.
    average_passed: Vec3,
    /// The limit of coarse relief, for sampling.
    facets: Microfacets,
}

/// Probabilities of the ways to sample.
struct LobeProbabilities {
    mirror: f32,
    /// The first term of the series: a Gaussian of direction cosines.
    diffraction: f32,
    facets: f32,
    cosine: f32,
}

impl HeTorrance {
    /// The parameters as in the file's head: indices at least 0, lengths above 0 nm (a height of 0 is a mirror).
    pub fn new(eta: Vec3, k: Vec3, height_nm: f32, correlation_nm: f32, diffuse: Vec3) -> Self {
        let correlation_nm = correlation_nm.max(1.0);
        let alpha = (2.0 * height_nm / correlation_nm).clamp(2.0 * super::MIN_ALPHA, 1.0);
        Self {
            eta,
            k,
            height_nm: height_nm.max(0.0),
            correlation_nm,
            diffuse,
            average_passed: (Vec3::ONE - fresnel::conductor_average(eta, k)).max(Vec3::splat(1e-6)),
            facets: Microfacets::isotropic(alpha, Distribution::Beckmann),
        }
    }

    fn is_mirror(&self) -> bool {
        self.height_nm < FLATTEST_NM
    }

    pub(super) fn has_smooth_lobe(&self) -> bool {
        !self.is_mirror() || self.diffuse != Vec3::ZERO
    }

    /// τ cot θ/(2σ₀), by which shadowing depends on direction.
    fn shadow_argument(&self, cos: f32) -> f32 {
        let sin = (1.0 - cos * cos).max(1e-12).sqrt();
        self.correlation_nm * cos / (2.0 * self.height_nm.max(FLATTEST_NM) * sin)
    }

    /// Share of the relief that is seen from a cosine (eqs. 23 to 25).
    fn seen(&self, cos: f32) -> f32 {
        let x = self.shadow_argument(cos);
        if x > 4.0 {
            return 1.0;
        }
        let erfc = erfcf(x);
        let lambda = 0.5 * ((-x * x).exp() / (PI.sqrt() * x.max(1e-12)) - erfc);
        (1.0 - 0.5 * erfc) / (lambda + 1.0)
    }

    /// Height of the hills that both directions can see, in nanometres (eqs. 80 to 82).
    fn effective_height_nm(&self, cos_o: f32, cos_i: f32) -> f32 {
        let hidden = |cos: f32| {
            let x = self.shadow_argument(cos);
            if x > 4.0 { 0.0 } else { (1.0 - cos * cos).max(0.0).sqrt() / cos.max(1e-6) * erfcf(x) }
        };
        let c = 0.25 * (hidden(cos_o) + hidden(cos_i)) / (0.5 * PI).sqrt();
        // y = c·exp(−y²/2), whose sides cross once.
        let (mut low, mut high) = (0.0, c.min(8.0));
        if high > 1e-4 {
            for _ in 0..16 {
                let y: f32 = 0.5 * (low + high);
                if y < c * (-0.5 * y * y).exp() { low = y } else { high = y }
            }
        }
        let y = 0.5 * (low + high);
        self.height_nm / (1.0 + y * y).sqrt()
    }

    /// g per channel: the squared phase that the hills give to light, from both cosines (eq. 62).
    fn phase2(&self, cos_o: f32, cos_i: f32) -> Vec3 {
        let height = self.effective_height_nm(cos_o, cos_i);
        let cosines = cos_o + cos_i;
        Vec3::from_array(WAVELENGTHS_NM.map(|wavelength| (TAU * height / wavelength * cosines).powi(2)))
    }

    /// Reflectance of the specular term.
    fn mirror_reflectance(&self, cos: f32) -> Vec3 {
        let seen = if self.is_mirror() { 1.0 } else { self.seen(cos) };
        let phase2 = self.phase2(cos, cos);
        let coherent = Vec3::new((-phase2.x).exp(), (-phase2.y).exp(), (-phase2.z).exp());
        fresnel::conductor(cos, self.eta, self.k) * coherent * (seen * seen)
    }

    fn shares(&self, wo: Vec3) -> LobeProbabilities {
        let fresnel = fresnel::conductor(wo.z, self.eta, self.k);
        let mirror = self.mirror_reflectance(wo.z).max_element();
        let cosine_only = |mirror: f32, cosine: f32| {
            let total = (mirror + cosine).max(1e-20);
            LobeProbabilities { mirror: mirror / total, diffraction: 0.0, facets: 0.0, cosine: cosine / total }
        };
        let diffuse = self.diffuse.max_element();
        if self.is_mirror() {
            return cosine_only(mirror, diffuse);
        }
        // Of sampling alone: these change noise, not light. Some is left to every lobe that may give any.
        let scattered = (fresnel.max_element() - mirror).max(0.02);
        let phase2 = self.phase2(wo.z, wo.z).y;
        let coarse = phase2 / (1.0 + phase2);
        let cosine = 0.2 * scattered + diffuse;
        let total = mirror + scattered + cosine;
        LobeProbabilities {
            mirror: mirror / total,
            diffraction: scattered * (1.0 - 0.7 * coarse) / total,
            facets: scattered * 0.7 * coarse / total,
            cosine: cosine / total,
        }
    }

    /// Standard deviation of the direction cosines in the first term of the series, for green.
    fn diffraction_width(&self) -> f32 {
        WAVELENGTHS_NM[1] / (PI * std::f32::consts::SQRT_2 * self.correlation_nm)
    }

    fn evaluate_front(&self, shares: &LobeProbabilities, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        let passed = |cos: f32| Vec3::ONE - fresnel::conductor(cos, self.eta, self.k);
        let mut value = self.diffuse * passed(wo.z) * passed(wi.z) / self.average_passed * (FRAC_1_PI * wi.z);
        let mut pdf = shares.cosine * warp::cosine_hemisphere_pdf(wi.z);
        if !self.is_mirror() {
            value += self.directional_diffuse(wo, wi);
            let width = self.diffraction_width();
            let (x, y) = (wo.x + wi.x, wo.y + wi.y);
            let gaussian = (-0.5 * (x * x + y * y) / (width * width)).exp() / (TAU * width * width);
            pdf += shares.diffraction * gaussian * wi.z + shares.facets * self.facets.reflect(wo, wi).pdf;
        }
        BsdfEvaluation { value, pdf }
    }

    /// The directional-diffuse term times cos θi (eq. 77 with 78 and 79).
    fn directional_diffuse(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        let v = wo + wi;
        let length2 = v.length_squared();
        let cos_half = (0.5 * length2.sqrt()).min(1.0);
        let phase2 = self.phase2(wo.z, wi.z);
        let across2 = v.x * v.x + v.y * v.y;
        let distribution = |channel: usize| {
            let wavelength = WAVELENGTHS_NM[channel];
            let x = across2 * (PI * self.correlation_nm / wavelength).powi(2);
            let scale = 0.25 * (PI * self.correlation_nm / wavelength).powi(2);
            scale * series(phase2[channel], x)
        };
        let geometry = (length2 / v.z).powi(2) * self.seen(wo.z) * self.seen(wi.z) * FRAC_1_PI / wo.z;
        let density = Vec3::new(distribution(0), distribution(1), distribution(2));
        let term = fresnel::conductor(cos_half, self.eta, self.k) * density * geometry;
        if term.is_finite() { term } else { Vec3::ZERO }
    }

    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        let (wo, wi) = to_front(wo, wi);
        if wo.z > 0.0 && wi.z > 0.0 { self.evaluate_front(&self.shares(wo), wo, wi) } else { BsdfEvaluation::BLACK }
    }

    pub(super) fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let front = if wo.z < 0.0 { turn(wo) } else { wo };
        let shares = self.shares(front);
        let point = [u[0], u[1]];
        let mut left = u[2] - shares.mirror;
        if left < 0.0 {
            let weight = self.mirror_reflectance(front.z) / shares.mirror;
            return Some(BsdfSample::reflected_delta(reflect_about_normal(wo), weight, shares.mirror));
        }
        left -= shares.diffraction;
        let wi = if left < 0.0 {
            self.sample_diffraction(front, point)?
        } else if left < shares.facets {
            self.facets.sample_reflection(front, point)?
        } else {
            warp::cosine_hemisphere(point)
        };
        self.evaluate_front(&shares, front, wi).sample_turned(wi, wo)
    }

    fn sample_diffraction(&self, wo: Vec3, u: [f32; 2]) -> Option<Vec3> {
        let radius = self.diffraction_width() * (-2.0 * (1.0 - u[1]).ln()).sqrt();
        let (sin, cos) = warp::sin_cos_of_turns(u[0]);
        let (x, y) = (radius * cos - wo.x, radius * sin - wo.y);
        let z2 = 1.0 - x * x - y * y;
        (z2 > 0.0).then(|| Vec3::new(x, y, z2.sqrt()))
    }

    /// The face's reflectance and what the base adds: the relief moves light about but is taken to lose none.
    pub(super) fn albedo(&self, wo: Vec3) -> Vec3 {
        let reflected = fresnel::conductor(wo.z.abs(), self.eta, self.k);
        reflected + self.diffuse * (Vec3::ONE - reflected)
    }
}

/// Σ g^m e^−g/(m·m!) e^(−x/m) over m ≥ 1.
///
/// The terms are Poisson weights times a smooth function of m; where g is large that function is expanded to
/// second order around m = g.
fn series(g: f32, x: f32) -> f32 {
    const MAX_SUMMED: f32 = 40.0;
    if g > MAX_SUMMED {
        let k = x / g;
        let bent = k.min(g);
        return (-k + (bent * bent - 4.0 * bent + 2.0) / (2.0 * g)).exp() / g;
    }
    let mut weight = (-g).exp();
    let mut sum = 0.0;
    // Terms fall once m is beyond both g and √x; far beyond them nothing is left.
    let last = (g + 8.0 * g.sqrt() + 6.0) as u32;
    for m in 1..=last {
        let m = m as f32;
        weight *= g / m;
        sum += weight / m * (-x / m).exp();
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_joins_its_expansion() {
        for k in [0.0f32, 0.5, 2.0, 4.0] {
            let (below, above) = (series(39.999, k * 39.999), series(40.001, k * 40.001));
            assert!((below / above - 1.0).abs() < 0.02, "{k}: {below} {above}");
        }
    }

    /// The limit of coarse relief is the Beckmann microfacet model with α = 2σ₀/τ.
    #[test]
    fn coarse_relief_is_beckmann() {
        let (height, correlation) = (2000.0, 20_000.0);
        let model = HeTorrance::new(Vec3::ZERO, Vec3::splat(3.0), height, correlation, Vec3::ZERO);
        let facets = Microfacets::isotropic(2.0 * height / correlation, Distribution::Beckmann);
        let wo = Vec3::new(0.3, 0.1, 0.9).normalize();
        for wi in [Vec3::new(-0.3, -0.1, 0.9), Vec3::new(-0.1, -0.2, 0.9), Vec3::new(-0.4, 0.1, 0.8)] {
            let wi = wi.normalize();
            let ratio = model.evaluate(wo, wi).value.y / facets.reflect(wo, wi).value;
            assert!((ratio - 1.0).abs() < 0.02, "{wi}: {ratio}");
        }
    }
}
