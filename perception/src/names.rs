//! Tables of what is found by name: one line a thing, so that a name and what it stands for cannot part.
//!
//! For the few names of a command line, which are searched from the first to the last. Not for names that files bring
//! by the thousand.

/// A table of things by name, in the order in which names are listed.
pub(crate) type NamedTable<T, const N: usize> = [(&'static str, T); N];

/// The names of a table, in its order.
pub(crate) const fn names_of<T, const N: usize>(table: &NamedTable<T, N>) -> [&'static str; N] {
    let mut names = [""; N];
    let mut index = 0;
    while index < N {
        names[index] = table[index].0;
        index += 1;
    }
    names
}

/// What stands under a name in a table; `None` where nothing does.
pub(crate) fn find<'a, T>(table: &'a [(&'static str, T)], name: &str) -> Option<&'a T> {
    table.iter().find(|(known, _)| *known == name).map(|(_, found)| found)
}
