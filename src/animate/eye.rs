//! What the eyes of a shot's viewers do, frame by frame.

use super::ShotSettings;
use super::velocity::VelocityMap;
use crate::adaptive::pursuit::Pursuit;
use fechner_perception::display::Display;
use fechner_perception::eccentricity::FlatDisplay;
use fechner_perception::motion::image_velocity_deg_s;
use fechner_perception::{Error, Plane};
use glam::Vec2;

/// Whether eyes follow what moves. Each frame's noise is its own and stands still on the display for as long as the
/// frame does, so a moving eye smears it, and it may be stronger. Eyes that rest see it best.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Eye {
    /// They rest: safe whatever viewers do.
    #[default]
    Rests,
    /// They follow whatever they look at.
    FollowsAll,
    /// They follow what stands out in the picture and in its motion.
    FollowsSalient,
    /// They move as the gaze that the shot was watched with, where each frame has one.
    FollowsGaze,
}

impl ShotSettings {
    /// How the eyes move in a frame whose motion is known; `None` where they rest, and for frames that may be paused.
    ///
    /// # Errors
    /// For an impossible display.
    pub fn pursuit(&self, frame: u32, velocity: &VelocityMap) -> Result<Option<Pursuit>, Error> {
        if self.pausable {
            return Ok(None);
        }
        Ok(match self.eye {
            Eye::Rests => None,
            Eye::FollowsAll => Some(Pursuit::All(self.image_velocity_deg_s(velocity)?)),
            Eye::FollowsSalient => Some(Pursuit::Salient(self.image_velocity_deg_s(velocity)?)),
            Eye::FollowsGaze => self.gaze_velocity_deg_s(frame).map(Pursuit::Watched),
        })
    }

    /// Of what each pixel shows, by the slower of its motions from the frame before and to the next: eyes that follow
    /// less see more.
    fn image_velocity_deg_s(&self, velocity: &VelocityMap) -> Result<Plane, Error> {
        let area = self.trace.film_area();
        let (width, height) = (area.width as usize, area.height as usize);
        let speed = |motion: &[Vec2]| {
            let of =
                |component: fn(Vec2) -> f32| Plane::from_fn(width, height, |x, y| component(motion[y * width + x]));
            image_velocity_deg_s(&of(|motion| motion.x), &of(|motion| motion.y), &self.display())
        };
        Ok(speed(&velocity.to_next)?.combined(&speed(&velocity.to_previous)?, f32::min))
    }

    /// Of the gaze, by the slower of its motions from the frame before and to the next, where each of the three has a
    /// single one: half of a jump that ends in a frame, or begins there, would be taken for steady pursuit, and an eye
    /// that rests there sees more.
    pub fn gaze_velocity_deg_s(&self, frame: u32) -> Option<f64> {
        let at = |frame: u32| match self.gaze.as_ref()?.of_frame(frame) {
            [gaze] => Some(*gaze),
            _ => None,
        };
        let now = at(frame)?;
        let (before, after) = (at(frame.checked_sub(1)?)?, at(frame.checked_add(1)?)?);
        let area = self.trace.film_area();
        let flat = FlatDisplay::new(area.width as usize, area.height as usize, self.viewing.display.pixel_density());
        Some(flat.angle_deg(before, now).min(flat.angle_deg(now, after)) * self.frames_per_second)
    }

    /// The display at the shot's own rate.
    fn display(&self) -> Display {
        Display { frames_per_second: self.frames_per_second, ..self.viewing.display.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adaptive::settings::Limits;
    use crate::animate::gaze::GazeTrack;
    use crate::integrator::TraceSettings;
    use fechner_perception::display::Viewing;

    fn shot(eye: Eye, gaze: Option<&str>) -> ShotSettings {
        let viewing = Viewing::of(Display { pixels_per_degree: 40.0, ..Display::default() });
        let gaze = gaze.map(|table| GazeTrack::parse(table, (100, 50)).expect("a track"));
        let trace = TraceSettings::new(100, 50, 0);
        ShotSettings { last: 9, gaze, eye, ..ShotSettings::new(24.0, trace, Limits::of_visibility(1.0), viewing, 1.0) }
    }

    fn moving() -> VelocityMap {
        VelocityMap { to_next: vec![Vec2::new(5.0, 0.0); 5000], to_previous: vec![Vec2::new(-3.0, -4.0); 5000] }
    }

    #[test]
    fn eyes_follow_at_the_rate_of_the_shot() {
        let velocity = match shot(Eye::FollowsAll, None).pursuit(3, &moving()).expect("a display") {
            Some(Pursuit::All(velocity)) => velocity.get(50, 25),
            other => panic!("{other:?}"),
        };
        // Five pixels of a fortieth degree, 24 times a second.
        assert!((velocity - 3.0).abs() < 1e-5, "{velocity}");
        assert!(matches!(
            shot(Eye::FollowsSalient, None).pursuit(3, &moving()).expect("a display"),
            Some(Pursuit::Salient(_))
        ));
        // Of oblong pixels five lines are less of the view than three columns.
        let mut oblong = shot(Eye::FollowsAll, None);
        oblong.viewing.display.pixel_aspect_ratio = 2.0;
        let map = VelocityMap { to_next: vec![Vec2::X * 3.0; 5000], to_previous: vec![Vec2::Y * 5.0; 5000] };
        match oblong.pursuit(3, &map).expect("a display") {
            Some(Pursuit::All(velocity)) => assert!((velocity.get(50, 25) - 1.5).abs() < 1e-5),
            other => panic!("{other:?}"),
        }
        assert_eq!(shot(Eye::Rests, None).pursuit(3, &moving()).expect("a display"), None);
        assert_eq!(
            ShotSettings { pausable: true, ..shot(Eye::FollowsAll, None) }.pursuit(3, &moving()).expect("a display"),
            None
        );
    }

    #[test]
    fn a_watched_eye_moves_as_its_gaze() {
        let track = "frame,x,y\n1,10,20\n2,13,24\n3,22,36\n4,82,36\n5,82,36\n6,10,20\n7,1,1\n7,2,2\n9,3,3\n";
        let watched = |frame| shot(Eye::FollowsGaze, Some(track)).pursuit(frame, &moving()).expect("a display");
        // Five pixels a frame and then more, fifteen and then a jump; where it lands and where it leaves from the gaze
        // rests. A degree beside the middle of a flat display pixels are 0.1 % smaller.
        for (frame, expected) in [(2, 3.0), (3, 9.0), (4, 0.0), (5, 0.0)] {
            match watched(frame) {
                Some(Pursuit::Watched(velocity)) => {
                    assert!((velocity - expected).abs() <= 2e-3 * expected, "{velocity} for {expected}");
                }
                other => panic!("{other:?}"),
            }
        }
        // At the ends, beside frames without a line, and with two viewers nothing is known.
        assert!([0, 1, 6, 7, 8, 9, u32::MAX].into_iter().all(|frame| watched(frame).is_none()));
    }
}
