//! Quotes names that others gave, for CSV and HTML.

use std::borrow::Cow;

/// A field of CSV, in quotes where it has to be (RFC 4180).
pub(super) fn csv_field(text: &str) -> Cow<'_, str> {
    if text.contains([',', '"', '\n', '\r']) {
        Cow::Owned(format!("\"{}\"", text.replace('"', "\"\"")))
    } else {
        Cow::Borrowed(text)
    }
}

/// Text of HTML, also of attributes in quotes.
pub(super) fn html_text(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;").replace('\'', "&#39;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_must_be_is_quoted() {
        assert_eq!(csv_field("cornell-box"), "cornell-box");
        assert_eq!(csv_field("a, \"b\""), "\"a, \"\"b\"\"\"");
        assert_eq!(html_text("cornell-box"), "cornell-box");
        assert_eq!(html_text("<b>\"&'"), "&lt;b&gt;&quot;&amp;&#39;");
    }
}
