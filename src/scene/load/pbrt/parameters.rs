//! Parameter lists: `"float fov" [ 40 ]`, read by name and type, and what was left unread.

use super::super::error::{LoadError, Place, unknown};
use super::lexer::{Lexer, Token};
use glam::{Vec2, Vec3};
use std::cell::Cell;

/// The values of one parameter, all of one kind.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Values {
    Numbers(Vec<f64>),
    Strings(Vec<String>),
    Booleans(Vec<bool>),
}

/// One parameter.
#[derive(Clone, Debug)]
pub(super) struct Parameter {
    /// "float", "rgb", "texture", ...
    pub(super) kind: String,
    pub(super) name: String,
    line: usize,
    pub(super) values: Values,
    read: Cell<bool>,
}

/// The parameters of one directive.
#[derive(Clone, Debug)]
pub(super) struct Parameters {
    place: Place,
    list: Vec<Parameter>,
}

const KINDS: [&str; 14] = [
    "integer",
    "float",
    "point2",
    "vector2",
    "point3",
    "point",
    "vector3",
    "vector",
    "normal3",
    "normal",
    "spectrum",
    "rgb",
    "blackbody",
    "bool",
];

impl Parameters {
    /// Reads what follows a directive.
    pub(super) fn read(lexer: &mut Lexer, line: usize) -> Result<Self, LoadError> {
        let mut list = Vec::new();
        while let Some(Token::Quoted(_)) = lexer.peek()? {
            let Some((Token::Quoted(declaration), line)) = lexer.next()? else { break };
            let wrong = |problem: String| Err(LoadError::invalid_at(lexer.place(line), problem));
            let mut words = declaration.split_whitespace();
            let (Some(kind), Some(name), None) = (words.next(), words.next(), words.next()) else {
                return wrong(format!("expected \"type name\", found \"{declaration}\""));
            };
            if !KINDS.contains(&kind) && !["string", "texture"].contains(&kind) {
                let known = KINDS.iter().copied().chain(["string", "texture"]);
                return wrong(unknown("parameter type", kind, known));
            }
            let values = read_values(lexer, line)?;
            let fits = match (kind, &values) {
                ("bool", Values::Strings(words)) => words.iter().all(|word| word == "true" || word == "false"),
                ("bool", values) => matches!(values, Values::Booleans(_)),
                ("string" | "texture", values) => matches!(values, Values::Strings(_)),
                ("spectrum", values) => !matches!(values, Values::Booleans(_)),
                (_, values) => matches!(values, Values::Numbers(_)),
            };
            if !fits {
                return Err(LoadError::invalid_at(
                    lexer.place(line),
                    format_args!("\"{kind} {name}\" has values of another kind"),
                ));
            }
            list.push(Parameter { kind: kind.to_owned(), name: name.to_owned(), line, values, read: Cell::new(false) });
        }
        Ok(Self { place: lexer.place(line), list })
    }

    /// A list of nothing.
    pub(super) fn none(place: Place) -> Self {
        Self { place, list: Vec::new() }
    }

    /// Where the directive stands.
    pub(super) fn place(&self) -> Place {
        self.place.clone()
    }

    /// An error about the directive.
    pub(super) fn error(&self, problem: impl std::fmt::Display) -> LoadError {
        LoadError::invalid_at(self.place(), problem)
    }

    /// An error about something that is not read.
    pub(super) fn unsupported(&self, problem: impl std::fmt::Display) -> LoadError {
        LoadError::Unsupported { place: self.place(), problem: super::super::error::one_line(problem) }
    }

    /// Appends defaults that `Attribute` directives set, of each name the last.
    pub(super) fn with_defaults(mut self, defaults: &[Parameter]) -> Self {
        for default in defaults.iter().rev() {
            if self.list.iter().all(|parameter| parameter.name != default.name) {
                self.list.push(default.clone());
            }
        }
        self
    }

    /// The list itself.
    pub(super) fn into_list(self) -> Vec<Parameter> {
        self.list
    }

    /// Whether any parameter is a texture.
    pub(super) fn has_textures(&self) -> bool {
        self.list.iter().any(|parameter| parameter.kind == "texture" || parameter.name == "filename")
    }

    /// Names that nothing has asked for, with their lines.
    pub(super) fn unread(&self) -> Vec<String> {
        let unread = self.list.iter().filter(|parameter| !parameter.read.get());
        unread.map(|parameter| format!("\"{} {}\"", parameter.kind, parameter.name)).collect()
    }

    /// The parameter of this name and one of these types.
    pub(super) fn find(&self, kinds: &[&str], name: &str) -> Option<&Parameter> {
        let found = self.list.iter().find(|p| p.name == name && kinds.contains(&p.kind.as_str()))?;
        found.read.set(true);
        Some(found)
    }

    /// An error about one parameter.
    pub(super) fn error_at(&self, parameter: &Parameter, problem: impl std::fmt::Display) -> LoadError {
        let place = Place { file: self.place.file.clone(), line: Some(parameter.line) };
        LoadError::invalid_at(place, format_args!("\"{} {}\": {problem}", parameter.kind, parameter.name))
    }

    /// All numbers of a parameter, finite as f32.
    pub(super) fn numbers(&self, kinds: &[&str], name: &str) -> Result<Option<&[f64]>, LoadError> {
        let Some(parameter) = self.find(kinds, name) else { return Ok(None) };
        let Values::Numbers(numbers) = &parameter.values else {
            return Err(self.error_at(parameter, "expected numbers"));
        };
        if let Some(bad) = numbers.iter().find(|&&number| !(number as f32).is_finite()) {
            return Err(self.error_at(parameter, format_args!("{bad} is not finite")));
        }
        Ok(Some(numbers))
    }

    fn exactly<const N: usize>(&self, kinds: &[&str], name: &str) -> Result<Option<[f64; N]>, LoadError> {
        let Some(numbers) = self.numbers(kinds, name)? else { return Ok(None) };
        match <[f64; N]>::try_from(numbers) {
            Ok(array) => Ok(Some(array)),
            Err(_) => {
                let found = numbers.len();
                Err(self.error(format_args!("\"{name}\": expected {N} numbers, found {found}")))
            }
        }
    }

    /// A parameter of one number.
    pub(super) fn float(&self, name: &str) -> Result<Option<f32>, LoadError> {
        Ok(self.exactly::<1>(&["float"], name)?.map(|[value]| value as f32))
    }

    pub(super) fn float_or(&self, name: &str, default: f32) -> Result<f32, LoadError> {
        Ok(self.float(name)?.unwrap_or(default))
    }

    /// One whole number.
    pub(super) fn integer(&self, name: &str) -> Result<Option<i64>, LoadError> {
        match self.exactly::<1>(&["integer"], name)? {
            Some([value]) if value.fract() == 0.0 => Ok(Some(value as i64)),
            Some([value]) => Err(self.error(format_args!("\"{name}\": expected a whole number, found {value}"))),
            None => Ok(None),
        }
    }

    pub(super) fn point(&self, name: &str) -> Result<Option<Vec3>, LoadError> {
        let found = self.exactly::<3>(&["point3", "point", "vector3", "vector"], name)?;
        Ok(found.map(|p| Vec3::from_array(p.map(|v| v as f32))))
    }

    pub(super) fn rgb(&self, name: &str) -> Result<Option<Vec3>, LoadError> {
        Ok(self.exactly::<3>(&["rgb"], name)?.map(|p| Vec3::from_array(p.map(|v| v as f32))))
    }

    /// One string.
    pub(super) fn string(&self, name: &str) -> Result<Option<&str>, LoadError> {
        self.word(&["string"], name)
    }

    /// One string of a parameter of one of these types.
    pub(super) fn word(&self, kinds: &[&str], name: &str) -> Result<Option<&str>, LoadError> {
        let Some(parameter) = self.find(kinds, name) else { return Ok(None) };
        match &parameter.values {
            Values::Strings(words) if words.len() == 1 => Ok(Some(&words[0])),
            _ => Err(self.error_at(parameter, "expected one string")),
        }
    }

    pub(super) fn strings(&self, name: &str) -> Result<&[String], LoadError> {
        match self.find(&["string"], name) {
            Some(Parameter { values: Values::Strings(words), .. }) => Ok(words),
            _ => Ok(&[]),
        }
    }

    pub(super) fn boolean_or(&self, name: &str, default: bool) -> Result<bool, LoadError> {
        let Some(parameter) = self.find(&["bool"], name) else { return Ok(default) };
        match &parameter.values {
            Values::Booleans(values) if values.len() == 1 => Ok(values[0]),
            Values::Strings(words) if words.len() == 1 => Ok(words[0] == "true"),
            _ => Err(self.error_at(parameter, "expected true or false")),
        }
    }

    /// Points in threes.
    pub(super) fn vec3s(&self, kinds: &[&str], name: &str) -> Result<Option<Vec<Vec3>>, LoadError> {
        let Some(numbers) = self.numbers(kinds, name)? else { return Ok(None) };
        let (triples, rest) = numbers.as_chunks::<3>();
        if !rest.is_empty() {
            return Err(self.error(format_args!("\"{name}\": {} numbers are not triples", numbers.len())));
        }
        Ok(Some(triples.iter().map(|p| Vec3::from_array(p.map(|v| v as f32))).collect()))
    }

    /// Points in twos.
    pub(super) fn vec2s(&self, name: &str) -> Result<Option<Vec<Vec2>>, LoadError> {
        let Some(numbers) = self.numbers(&["point2", "vector2", "float"], name)? else { return Ok(None) };
        let (pairs, rest) = numbers.as_chunks::<2>();
        if !rest.is_empty() {
            return Err(self.error(format_args!("\"{name}\": {} numbers are not pairs", numbers.len())));
        }
        Ok(Some(pairs.iter().map(|p| Vec2::from_array(p.map(|v| v as f32))).collect()))
    }
}

/// One value, or values in brackets.
pub(super) fn read_values(lexer: &mut Lexer, line: usize) -> Result<Values, LoadError> {
    let missing = |lexer: &Lexer| LoadError::invalid_at(lexer.place(line), "a parameter without a value");
    let Some((first, first_line)) = lexer.next()? else { return Err(missing(lexer)) };
    let mut numbers = Vec::new();
    let mut strings = Vec::new();
    let mut booleans = Vec::new();
    let mut add = |token: Token, line: usize, lexer: &Lexer| -> Result<(), LoadError> {
        match token {
            Token::Quoted(text) => strings.push(text.into_owned()),
            Token::Word("true") => booleans.push(true),
            Token::Word("false") => booleans.push(false),
            Token::Word(word) => match word.parse::<f64>() {
                Ok(number) => numbers.push(number),
                Err(_) => {
                    return Err(LoadError::invalid_at(
                        lexer.place(line),
                        format_args!("expected a value, found {word}"),
                    ));
                }
            },
            Token::Open | Token::Close => {
                return Err(LoadError::invalid_at(lexer.place(line), "a bracket where a value should be"));
            }
        }
        Ok(())
    };
    if first == Token::Open {
        loop {
            match lexer.next()? {
                None => {
                    return Err(LoadError::invalid_at(lexer.place(first_line), "a list without its closing bracket"));
                }
                Some((Token::Close, _)) => break,
                Some((token, line)) => add(token, line, lexer)?,
            }
        }
    } else {
        add(first, first_line, lexer)?;
    }
    match (numbers.is_empty(), strings.is_empty(), booleans.is_empty()) {
        (_, true, true) => Ok(Values::Numbers(numbers)),
        (true, false, true) => Ok(Values::Strings(strings)),
        (true, true, false) => Ok(Values::Booleans(booleans)),
        _ => Err(LoadError::invalid_at(lexer.place(line), "values of different kinds in one list")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn read(text: &str) -> Result<Parameters, LoadError> {
        Parameters::read(&mut Lexer::new(Path::new("a.pbrt"), text), 1)
    }

    #[test]
    fn values_come_with_and_without_brackets() {
        let parameters = read("\"float fov\" 40 \"rgb L\" [ 1 2 3 ] \"bool twosided\" true \"bool b\" \"true\" \"string s\" [\"x\"]\n \"float odd\" 1").unwrap();
        assert_eq!(parameters.float("fov").unwrap(), Some(40.0));
        assert_eq!(parameters.rgb("L").unwrap(), Some(Vec3::new(1.0, 2.0, 3.0)));
        assert!(parameters.boolean_or("twosided", false).unwrap() && parameters.boolean_or("b", false).unwrap());
        assert_eq!(parameters.string("s").unwrap(), Some("x"));
        assert_eq!(parameters.unread(), ["\"float odd\""]);
    }

    #[test]
    fn slips_are_named_with_their_line() {
        for (text, expected) in [
            ("\n\"float\" 1", "a.pbrt:2: expected \"type name\""),
            ("\n\"flaot x\" 1", "did you mean \"float\"?"),
            ("\n\"float x\" [ 1 2", "without its closing bracket"),
            ("\n\"float x\" [ 1 \"a\" ]", "different kinds"),
            ("\n\"float x\" \"a\"", "values of another kind"),
            ("\"float x\"", "a parameter without a value"),
            ("\"float x\" Shape", "expected a value, found Shape"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
        assert!(read("\"rgb L\" [ 1 2 ]").unwrap().rgb("L").is_err());
        assert!(read("\"float x\" [ 1e39 ]").unwrap().float("x").is_err());
    }
}
