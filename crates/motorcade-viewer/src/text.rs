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

/// A number at an axis, with a minus and no hyphen.
pub(crate) fn tick(value: f64, digits: usize) -> String {
    number(value, digits).replace('-', "\u{2212}")
}

/// A number and its unit.
pub(crate) fn quantity(value: f64, digits: usize, unit: &str) -> String {
    format!("{} {unit}", number(value, digits))
}

/// A number, its standard deviation and their unit: `1.64 ± 0.04 s`.
pub(crate) fn estimate(value: f64, sigma: f64, digits: usize, unit: &str) -> String {
    format!("{} ± {}", number(value, digits), quantity(sigma, digits, unit))
}

/// A number that may be missing.
pub(crate) fn maybe(value: Option<f64>, digits: usize) -> String {
    number(value.unwrap_or(f64::NAN), digits)
}

/// A coordinate of a drawing, to a tenth of a pixel.
pub(crate) fn px(value: f64) -> String {
    number(value, 1)
}

/// Coordinates as `x,y x,y …`. Of neighbours in one column of a tenth of a pixel the first, the lowest, the highest and the last
/// remain: what is left out cannot be seen.
pub(crate) fn points(positions: impl IntoIterator<Item = (f64, f64)>) -> String {
    let mut out: Vec<(String, String)> = Vec::new();
    let mut column: Vec<(f64, f64)> = Vec::new();
    for position in positions {
        if column.first().is_some_and(|first| px(first.0) != px(position.0)) {
            flush(&mut column, &mut out);
        }
        column.push(position);
    }
    flush(&mut column, &mut out);
    out.dedup();
    out.iter().map(|(x, y)| format!("{x},{y}")).collect::<Vec<_>>().join(" ")
}

/// Passes on what is seen of the points of one column.
fn flush(column: &mut Vec<(f64, f64)>, out: &mut Vec<(String, String)>) {
    let by_height = |a: &usize, b: &usize| column[*a].1.total_cmp(&column[*b].1);
    let (low, high) = ((0..column.len()).min_by(by_height), (0..column.len()).max_by(by_height));
    let mut kept: Vec<usize> =
        [Some(0), low, high, column.len().checked_sub(1)].into_iter().flatten().collect();
    kept.sort_unstable();
    kept.dedup();
    out.extend(kept.into_iter().filter_map(|k| column.get(k)).map(|(x, y)| (px(*x), px(*y))));
    column.clear();
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
        assert_eq!(estimate(1.638, 0.04, 2, "s"), "1.64 ± 0.04 s");
        assert_eq!(points([(0.0, 1.0), (0.01, 1.0), (2.0, 1.0)]), "0.0,1.0 2.0,1.0");
        let column = [5.0, 3.0, 4.0, 9.0, 6.0, 7.0].map(|y| (1.0, y));
        assert_eq!(points(column), "1.0,5.0 1.0,3.0 1.0,9.0 1.0,7.0");
        assert_eq!(points([]), "");
    }
}
