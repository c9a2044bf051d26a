//! How much of unpolarised light a smooth boundary reflects.
//!
//! Sources: M. Born & E. Wolf, *Principles of Optics* (7th ed. 1999), sections 1.5.2 (dielectric, eqs. 21 and 33) and
//! 14.4.1 (conductor, eqs. 7 to 15); C. Schlick, *An inexpensive BRDF model for physically-based rendering* (1994),
//! eq. 15.

use glam::Vec3;

/// What happens to a ray at a dielectric boundary.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DielectricBoundary {
    /// Share of energy that is reflected; 1 under total internal reflection.
    pub(crate) reflectance: f32,
    /// Cosine of the refracted ray to the normal, at least 0; 0 under total internal reflection.
    pub(crate) cos_transmitted: f32,
}

/// Exact reflectance of a dielectric boundary for an incident cosine in [0, 1]; `eta` is the index on the far side over
/// the index on the incident side, above 0.
pub(crate) fn dielectric(cos_incident: f32, eta: f32) -> DielectricBoundary {
    let cos_incident = cos_incident.clamp(0.0, 1.0);
    let sin2_transmitted = (1.0 - cos_incident * cos_incident) / (eta * eta);
    if sin2_transmitted >= 1.0 {
        return DielectricBoundary { reflectance: 1.0, cos_transmitted: 0.0 };
    }
    let cos_transmitted = (1.0 - sin2_transmitted).sqrt();
    let perpendicular = (cos_incident - eta * cos_transmitted) / (cos_incident + eta * cos_transmitted);
    let parallel = (eta * cos_incident - cos_transmitted) / (eta * cos_incident + cos_transmitted);
    DielectricBoundary { reflectance: 0.5 * (perpendicular * perpendicular + parallel * parallel), cos_transmitted }
}

/// Exact reflectance per channel of a conductor with complex index `eta` + i `k` relative to the incident side, for an
/// incident cosine in [0, 1].
pub(crate) fn conductor(cos_incident: f32, eta: Vec3, k: Vec3) -> Vec3 {
    let cos = cos_incident.clamp(0.0, 1.0);
    let cos2 = cos * cos;
    let sin2 = 1.0 - cos2;
    let eta2 = eta * eta;
    let k2 = k * k;
    // a² + b² is |n²−sin²|, where a + ib is the refracted wave's normal component.
    let difference = eta2 - k2 - Vec3::splat(sin2);
    let modulus = (difference * difference + 4.0 * eta2 * k2).sqrt();
    let a = (0.5 * (modulus + difference)).max(Vec3::ZERO).sqrt();
    let sum = modulus + Vec3::splat(cos2);
    let twice_a_cos = 2.0 * cos * a;
    let perpendicular = (sum - twice_a_cos) / (sum + twice_a_cos);
    let sum = cos2 * modulus + Vec3::splat(sin2 * sin2);
    let product = twice_a_cos * sin2;
    // At exact grazing with η + ik = 1 all terms vanish; the limit is that everything is reflected.
    let denominator = sum + product;
    let parallel = perpendicular * ((sum - product) / denominator.max(Vec3::splat(1e-20)));
    (0.5 * (perpendicular + parallel)).clamp(Vec3::ZERO, Vec3::ONE)
}

/// The average 2∫F(μ)μ dμ of [`conductor`], by Gauss–Legendre quadrature in μ² with four points: within 0.002 for every
/// metal, and it only tints light that bounced twice or more between facets.
pub(crate) fn conductor_average(eta: Vec3, k: Vec3) -> Vec3 {
    const NODES: [(f32, f32); 4] = [
        (0.069_431_84, 0.173_927_43),
        (0.330_009_5, 0.326_072_57),
        (0.669_990_54, 0.326_072_57),
        (0.930_568_16, 0.173_927_43),
    ];
    NODES.iter().fold(Vec3::ZERO, |sum, &(mu2, weight)| sum + weight * conductor(mu2.sqrt(), eta, k))
}

/// Reflectance at normal incidence of a dielectric of relative index `ior`.
pub(crate) fn normal_reflectance(ior: f32) -> f32 {
    let root = (ior - 1.0) / (ior + 1.0);
    root * root
}

/// Schlick's (1 − cos)⁵, by which reflectance goes from F0 to 1.
pub(crate) fn schlick_weight(cos_incident: f32) -> f32 {
    let x = (1.0 - cos_incident).clamp(0.0, 1.0);
    let x2 = x * x;
    x2 * x2 * x
}

/// Average 2∫(1 − μ)⁵ μ dμ of [`schlick_weight`].
pub(crate) const SCHLICK_AVERAGE: f32 = 1.0 / 21.0;
