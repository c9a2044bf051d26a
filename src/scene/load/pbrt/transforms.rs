//! Directives about the current transform, and the numbers that they take.

use super::super::error::LoadError;
use super::directives::string;
use super::lexer::{Lexer, Token};
use super::{Reader, state};
use glam::{DMat4, DQuat, DVec3};

/// What a directive does to the current transform.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TransformDirective {
    Identity,
    Translate,
    Scale,
    Rotate,
    LookAt,
    Replace,
    Concat,
    Times,
    Activate,
    NameSystem,
    UseSystem,
}

impl Reader<'_> {
    pub(super) fn transform(
        &mut self,
        directive: TransformDirective,
        lexer: &mut Lexer,
        line: usize,
    ) -> Result<(), LoadError> {
        match directive {
            TransformDirective::Identity => self.state.change(|_| DMat4::IDENTITY),
            TransformDirective::Translate => {
                let by = DMat4::from_translation(numbers(lexer, line)?.into());
                self.state.change(|m| m * by);
            }
            TransformDirective::Scale => {
                let by = DMat4::from_scale(numbers(lexer, line)?.into());
                self.state.change(|m| m * by);
            }
            TransformDirective::Rotate => {
                let by = rotation(lexer, line)?;
                self.state.change(|m| m * by);
            }
            TransformDirective::LookAt => {
                let look = look_at(lexer, line)?;
                self.state.change(|m| m * look);
            }
            TransformDirective::Replace => {
                let matrix = DMat4::from_cols_array(&numbers(lexer, line)?);
                self.state.change(|_| matrix);
            }
            TransformDirective::Concat => {
                let matrix = DMat4::from_cols_array(&numbers(lexer, line)?);
                self.state.change(|m| m * matrix);
            }
            TransformDirective::Times => self.times = numbers(lexer, line)?,
            TransformDirective::Activate => {
                self.builder.at_another_time = Some(super::read);
                self.state.active = active(lexer, line)?;
            }
            TransformDirective::NameSystem => {
                self.coordinate_systems.insert(string(lexer, line)?, self.state.transforms);
            }
            TransformDirective::UseSystem => {
                let name = string(lexer, line)?;
                match self.coordinate_systems.get(&name) {
                    Some(transforms) => self.state.transforms = *transforms,
                    None => self.builder.note(format!("{}: no coordinate system \"{name}\".", lexer.place(line))),
                }
            }
        }
        Ok(())
    }
}

fn rotation(lexer: &mut Lexer, line: usize) -> Result<DMat4, LoadError> {
    let [angle, x, y, z] = numbers(lexer, line)?;
    let Some(axis) = DVec3::new(x, y, z).try_normalize() else {
        return Err(LoadError::invalid_at(lexer.place(line), "Rotate about an axis of no length"));
    };
    Ok(DMat4::from_quat(DQuat::from_axis_angle(axis, angle.to_radians())))
}

fn look_at(lexer: &mut Lexer, line: usize) -> Result<DMat4, LoadError> {
    let [ex, ey, ez, tx, ty, tz, ux, uy, uz] = numbers(lexer, line)?;
    let [eye, target, up] = [[ex, ey, ez], [tx, ty, tz], [ux, uy, uz]].map(DVec3::from_array);
    state::look_at(eye, target, up).ok_or_else(|| {
        let problem = "LookAt needs two different points and an up vector that is not along their line";
        LoadError::invalid_at(lexer.place(line), problem)
    })
}

/// Which of the two transforms the next directives change.
fn active(lexer: &mut Lexer, line: usize) -> Result<[bool; 2], LoadError> {
    match lexer.next()? {
        Some((Token::Word("StartTime"), _)) => Ok([true, false]),
        Some((Token::Word("EndTime"), _)) => Ok([false, true]),
        Some((Token::Word("All"), _)) => Ok([true, true]),
        _ => {
            let problem = "ActiveTransform: expected StartTime, EndTime or All";
            Err(LoadError::invalid_at(lexer.place(line), problem))
        }
    }
}

/// Numbers behind a directive, with or without brackets.
fn numbers<const N: usize>(lexer: &mut Lexer, line: usize) -> Result<[f64; N], LoadError> {
    let mut values = [0.0; N];
    let bracket = matches!(lexer.peek()?, Some(Token::Open));
    if bracket {
        lexer.next()?;
    }
    let wrong = |lexer: &Lexer| LoadError::invalid_at(lexer.place(line), format_args!("expected {N} finite numbers"));
    for value in &mut values {
        *value = match lexer.next()? {
            Some((Token::Word(word), _)) => word.parse().ok().filter(|n: &f64| (*n as f32).is_finite()),
            _ => None,
        }
        .ok_or_else(|| wrong(lexer))?;
    }
    if bracket && !matches!(lexer.next()?, Some((Token::Close, _))) {
        return Err(wrong(lexer));
    }
    Ok(values)
}
