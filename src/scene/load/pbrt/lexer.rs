//! Words, strings and brackets of a pbrt file, each with its line. What they mean is left to `directives`.

use super::super::error::{LoadError, Place};
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// One word of the language.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Token<'a> {
    /// A directive, a number, `true` or `false`.
    Word(&'a str),
    /// A string without its quotes.
    Quoted(Cow<'a, str>),
    /// `[`
    Open,
    /// `]`
    Close,
}

/// Takes a file apart. Comments run from `#` to the end of the line.
pub(super) struct Lexer<'a> {
    pub(super) file: PathBuf,
    text: &'a str,
    at: usize,
    /// Line of the token that comes next, from 1.
    line: usize,
    peeked: Option<(Token<'a>, usize)>,
}

impl<'a> Lexer<'a> {
    pub(super) fn new(file: &Path, text: &'a str) -> Self {
        Self { file: file.to_owned(), text, at: 0, line: 1, peeked: None }
    }

    /// Where a line of this file is.
    pub(super) fn place(&self, line: usize) -> Place {
        Place::line(&self.file, line)
    }

    /// The next token and its line; `None` at the end.
    pub(super) fn next(&mut self) -> Result<Option<(Token<'a>, usize)>, LoadError> {
        match self.peeked.take() {
            Some(token) => Ok(Some(token)),
            None => self.read(),
        }
    }

    /// The next token and its line, without going on; `None` at the end.
    pub(super) fn peek(&mut self) -> Result<Option<&Token<'a>>, LoadError> {
        if self.peeked.is_none() {
            self.peeked = self.read()?;
        }
        Ok(self.peeked.as_ref().map(|(token, _)| token))
    }

    fn read(&mut self) -> Result<Option<(Token<'a>, usize)>, LoadError> {
        let bytes = self.text.as_bytes();
        loop {
            match bytes.get(self.at) {
                None => return Ok(None),
                Some(b'\n') => self.line += 1,
                Some(b'#') => {
                    let rest = &bytes[self.at..];
                    self.at += rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len());
                    continue;
                }
                Some(byte) if byte.is_ascii_whitespace() => {}
                Some(_) => break,
            }
            self.at += 1;
        }
        let line = self.line;
        let token = match bytes[self.at] {
            b'[' => self.take(1, Token::Open),
            b']' => self.take(1, Token::Close),
            b'"' => self.string()?,
            _ => {
                let rest = &self.text[self.at..];
                let is_end = |byte: &u8| byte.is_ascii_whitespace() || matches!(byte, b'[' | b']' | b'"' | b'#');
                let length = rest.as_bytes().iter().position(is_end).unwrap_or(rest.len());
                self.take(length, Token::Word(&rest[..length]))
            }
        };
        Ok(Some((token, line)))
    }

    fn take(&mut self, length: usize, token: Token<'a>) -> Token<'a> {
        self.at += length;
        token
    }

    fn string(&mut self) -> Result<Token<'a>, LoadError> {
        let line = self.line;
        let rest = &self.text[self.at + 1..];
        let bytes = rest.as_bytes();
        let mut length = 0;
        let mut escapes = false;
        loop {
            match bytes.get(length) {
                Some(b'"') => break,
                Some(b'\\') => {
                    escapes = true;
                    length += 1;
                }
                None | Some(b'\n') => {
                    return Err(LoadError::invalid_at(self.place(line), "a string without its closing quote"));
                }
                Some(_) => {}
            }
            length += 1;
        }
        let raw = &rest[..length];
        self.at += length + 2;
        Ok(Token::Quoted(if escapes { Cow::Owned(unescape(raw)) } else { Cow::Borrowed(raw) }))
    }
}

fn unescape(raw: &str) -> String {
    let mut text = String::with_capacity(raw.len());
    let mut characters = raw.chars();
    while let Some(character) = characters.next() {
        text.push(match (character, character == '\\') {
            (_, false) => character,
            _ => match characters.next() {
                Some('n') => '\n',
                Some('t') => '\t',
                Some('r') => '\r',
                Some(other) => other,
                None => '\\',
            },
        });
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_have_their_lines() {
        let mut lexer = Lexer::new(Path::new("a.pbrt"), "Shape \"a \\\"b\\\"\" # no\n[1 -.5e3]\"x\"");
        let mut tokens = Vec::new();
        while let Some(token) = lexer.next().unwrap() {
            tokens.push(token);
        }
        let expected = [
            (Token::Word("Shape"), 1),
            (Token::Quoted("a \"b\"".into()), 1),
            (Token::Open, 2),
            (Token::Word("1"), 2),
            (Token::Word("-.5e3"), 2),
            (Token::Close, 2),
            (Token::Quoted("x".into()), 2),
        ];
        assert_eq!(tokens, expected);
    }

    #[test]
    fn an_open_string_is_an_error_with_its_line() {
        for text in ["\n\"abc\nd\"", "\n\"abc\\", "\n\""] {
            let error = Lexer::new(Path::new("a.pbrt"), text).next().unwrap_err().to_string();
            assert_eq!(error, "a.pbrt:2: a string without its closing quote");
        }
    }
}
