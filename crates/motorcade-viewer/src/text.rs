//! Text of the page: escaping and numbers.

/// Escapes text for HTML and SVG, content and quoted attributes alike.
pub(crate) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            // Control characters are not allowed in a page, not even escaped.
            c if c.is_control() && c != '\n' && c != '\t' => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// A number with fixed digits; a dash when it is not finite, and no minus before zero.
pub(crate) fn number(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    let text = format!("{value:.digits$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| matches!(c, '0' | '.')) => rest.to_owned(),
        _ => text,
    }
}

/// A number that may be missing.
pub(crate) fn maybe(value: Option<f64>, digits: usize) -> String {
    number(value.unwrap_or(f64::NAN), digits)
}

/// A coordinate of a drawing, to a tenth of a pixel.
pub(crate) fn px(value: f64) -> String {
    number(value, 1)
}

/// Coordinates as `x,y x,y …`, without repeated points.
pub(crate) fn points(positions: impl IntoIterator<Item = (f64, f64)>) -> String {
    let mut out: Vec<String> = Vec::new();
    for (x, y) in positions {
        let next = format!("{},{}", px(x), px(y));
        if out.last() != Some(&next) {
            out.push(next);
        }
    }
    out.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_breaks_out_of_text() {
        assert_eq!(escape("<a b=\"c\">&'\u{1}"), "&lt;a b=&quot;c&quot;&gt;&amp;&#39;\u{fffd}");
    }

    #[test]
    fn numbers_read_well() {
        assert_eq!(number(-0.04, 1), "0.0");
        assert_eq!(number(-0.06, 1), "-0.1");
        assert_eq!(number(f64::NAN, 1), "–");
        assert_eq!(points([(0.0, 1.0), (0.01, 1.0), (2.0, 1.0)]), "0.0,1.0 2.0,1.0");
    }
}
