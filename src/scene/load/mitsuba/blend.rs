//! Coverage of `blendbsdf`: a part that is not there takes its share of the surface with it.

use super::bsdfs::Look;
use crate::scene::{Alpha, ScalarInput};

const NOTHING: ScalarInput = ScalarInput::constant(0.0);

impl Look {
    /// How much of the surface is there.
    fn coverage(&self) -> ScalarInput {
        match (&self.surface, self.alpha) {
            (None, _) => NOTHING,
            (Some(_), Alpha::Blend { value }) => value,
            (Some(_), _) => ScalarInput::constant(1.0),
        }
    }

    fn covering(&self, coverage: ScalarInput) -> Self {
        Self { surface: self.surface.clone(), relief: self.relief, alpha: alpha_of(coverage) }
    }

    /// This look with an opacity over what is there of it already; `None` where that takes two pictures.
    pub(super) fn masked(&self, opacity: ScalarInput) -> Option<Self> {
        product(self.coverage(), opacity).map(|coverage| self.covering(coverage))
    }
}

fn alpha_of(coverage: ScalarInput) -> Alpha {
    if coverage == ScalarInput::constant(1.0) { Alpha::Opaque } else { Alpha::Blend { value: coverage } }
}

fn product(a: ScalarInput, b: ScalarInput) -> Option<ScalarInput> {
    match (a.texture, b.texture) {
        (Some(_), Some(_)) => None,
        (texture, other) => Some(ScalarInput { factor: a.factor * b.factor, texture: texture.or(other) }),
    }
}

/// The one part that is to be seen, where the other has no share or is not there.
pub(super) fn alone(first: &Look, second: &Look, amount: ScalarInput) -> Option<Look> {
    let (a, b) = (first.coverage(), second.coverage());
    let rest = match amount.texture {
        None => Some(ScalarInput::constant(1.0 - amount.factor)),
        Some(_) => None,
    };
    if amount == NOTHING || (b == NOTHING && rest.is_some()) {
        return product(a, rest?).map(|coverage| first.covering(coverage));
    }
    if amount == ScalarInput::constant(1.0) || a == NOTHING {
        return product(b, amount).map(|coverage| second.covering(coverage));
    }
    None
}

/// Coverage of both parts together, and the second one's share of what is there; `None` where it takes two pictures.
pub(super) fn coverage(first: &Look, second: &Look, amount: ScalarInput) -> Option<(Alpha, ScalarInput)> {
    let (a, b) = (first.coverage(), second.coverage());
    if a == b {
        return Some((alpha_of(a), amount));
    }
    if [a, b, amount].iter().any(|input| input.texture.is_some()) {
        return None;
    }
    let of_second = amount.factor * b.factor;
    let total = (1.0 - amount.factor) * a.factor + of_second;
    let share = if total > 0.0 { of_second / total } else { 0.0 };
    Some((alpha_of(ScalarInput::constant(total)), ScalarInput::constant(share)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{ColorInput, Surface, TextureId, TextureLookup};
    use glam::Vec3;

    fn grey(alpha: Alpha) -> Look {
        Look {
            surface: Some(Surface::Diffuse { reflectance: ColorInput::constant(Vec3::splat(0.5)) }),
            alpha,
            relief: None,
        }
    }

    #[test]
    fn a_part_that_is_not_there_takes_its_share_along() {
        let half = ScalarInput::constant(0.5);
        let nothing = Look { surface: None, alpha: Alpha::Opaque, relief: None };
        let seen = alone(&nothing, &grey(Alpha::Opaque), half).unwrap();
        assert_eq!((seen.surface.is_some(), seen.alpha), (true, Alpha::Blend { value: half }));
        let picture = ScalarInput { factor: 1.0, texture: Some((TextureLookup::plain(TextureId(3)), 0)) };
        assert_eq!(alone(&nothing, &grey(Alpha::Opaque), picture).unwrap().alpha, Alpha::Blend { value: picture });
        assert!(alone(&grey(Alpha::Opaque), &nothing, picture).is_none());
    }

    #[test]
    fn shares_are_those_of_what_is_there() {
        let quarter = Alpha::Blend { value: ScalarInput::constant(0.25) };
        let (alpha, share) = coverage(&grey(quarter), &grey(Alpha::Opaque), ScalarInput::constant(0.2)).unwrap();
        assert_eq!(alpha, Alpha::Blend { value: ScalarInput::constant(0.4) });
        assert_eq!(share, ScalarInput::constant(0.5));
    }
}
