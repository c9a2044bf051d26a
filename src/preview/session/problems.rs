//! Keeps what went wrong and has not gone right since.

use std::collections::BTreeMap;

/// What can go wrong, each by itself: what goes right elsewhere does not mend it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Cause {
    /// The scene file.
    Scene,
    /// A setting that a viewer asked for.
    Setting,
    /// A picture that was to be written.
    Save,
    /// A look at the picture.
    Look,
}

/// The last problem of each cause.
#[derive(Default)]
pub(super) struct Problems(BTreeMap<Cause, String>);

impl Problems {
    /// Notes that something went wrong.
    pub(super) fn meet(&mut self, cause: Cause, problem: String) {
        self.0.insert(cause, problem);
    }

    /// Notes that something went right, which ends its problem.
    pub(super) fn solve(&mut self, cause: Cause) {
        self.0.remove(&cause);
    }

    /// Lists the problems, a line each; `None` where there is none.
    pub(super) fn told(&self) -> Option<String> {
        let problems: Vec<&str> = self.0.values().map(String::as_str).collect();
        (!problems.is_empty()).then(|| problems.join("\n"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A scene file stays broken when a picture can be saved again.
    #[test]
    fn a_success_mends_nothing_else() {
        let mut problems = Problems::default();
        problems.meet(Cause::Save, "no room".to_owned());
        problems.meet(Cause::Scene, "line 3".to_owned());
        assert_eq!(problems.told().as_deref(), Some("line 3\nno room"));
        problems.solve(Cause::Save);
        assert_eq!(problems.told().as_deref(), Some("line 3"));
        problems.solve(Cause::Scene);
        assert_eq!(problems.told(), None);
    }
}
