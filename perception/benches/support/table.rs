//! Comma-separated tables of measurements.

/// A table with its columns' names in the first line.
pub(crate) struct Table {
    names: Vec<String>,
    rows: Vec<Vec<String>>,
}

/// One line of a [`Table`].
pub(crate) struct Row<'a> {
    names: &'a [String],
    fields: &'a [String],
}

impl Table {
    /// Reads the file that the environment variable `variable` names. Without it, or without the file, says so.
    pub(crate) fn from_environment(variable: &str, what: &str) -> Option<Self> {
        let Ok(path) = std::env::var(variable) else {
            println!("set {variable} to {what}");
            return None;
        };
        match std::fs::read_to_string(&path) {
            Ok(text) => Some(Self::parse(&text)),
            Err(error) => {
                println!("{path}: {error}");
                None
            }
        }
    }

    fn parse(text: &str) -> Self {
        let fields = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
        let mut lines = text.lines().map(fields);
        Self { names: lines.next().unwrap_or_default(), rows: lines.collect() }
    }

    pub(crate) fn rows(&self) -> impl Iterator<Item = Row<'_>> {
        self.rows.iter().map(|fields| Row { names: &self.names, fields })
    }
}

impl Row<'_> {
    pub(crate) fn text(&self, name: &str) -> Option<&str> {
        let index = self.names.iter().position(|known| known == name)?;
        self.fields.get(index).map(String::as_str)
    }

    /// A finite number.
    pub(crate) fn number(&self, name: &str) -> Option<f64> {
        self.text(name)?.parse::<f64>().ok().filter(|value| value.is_finite())
    }
}
