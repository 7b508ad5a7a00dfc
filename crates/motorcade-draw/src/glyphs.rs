//! Letters as strokes, drawn for this project. A point is two digits: x from 0 to 4, y upwards from 0; the baseline is at 2, the
//! top of capitals at 8. Strokes are separated by spaces; a single point is a dot.

/// Height of capitals in units of the strokes.
pub(crate) const CAPITAL: f64 = 6.0;
/// Height of the baseline in units of the strokes.
pub(crate) const BASELINE: f64 = 2.0;
/// Gap between two letters in units of the strokes.
pub(crate) const GAP: f64 = 1.7;

/// A letter: width in units, strokes.
type Glyph = (f64, &'static str);

/// Drawn for characters that have no letter.
const UNKNOWN: Glyph = (4.0, "0242480802");

/// Width and strokes of a character.
pub(crate) fn glyph(character: char) -> Glyph {
    match character {
        ' ' => (2.0, ""),
        '0' => (4.0, "123243473818070312"),
        '1' => (2.0, "071812 0222"),
        '2' => (4.0, "07183847460242"),
        '3' => (4.0, "07183847463515 354443321203"),
        '4' => (4.0, "32380444"),
        '5' => (4.0, "480805354443321203"),
        '6' => (4.0, "473818070312324344351504"),
        '7' => (4.0, "084812"),
        '8' => (4.0, "15354647381807061504031232434435"),
        '9' => (4.0, "031232434738180706153546"),
        'A' => (4.0, "022842 1434"),
        'B' => (4.0, "02083847463505 3544433202"),
        'C' => (4.0, "4738180703123243"),
        'D' => (4.0, "02082846442202"),
        'E' => (4.0, "48080242 0535"),
        'F' => (4.0, "480802 0535"),
        'G' => (4.0, "47381807031232434525"),
        'H' => (4.0, "0208 4248 0545"),
        'I' => (0.0, "0208"),
        'J' => (3.0, "3833221203"),
        'K' => (4.0, "0208 4804 1542"),
        'L' => (4.0, "080242"),
        'M' => (4.0, "0208254842"),
        'N' => (4.0, "02084248"),
        'O' => (4.0, "123244463818060412"),
        'P' => (4.0, "02083847453404"),
        'Q' => (4.0, "123244463818060412 2442"),
        'R' => (4.0, "02083847463505 2542"),
        'S' => (4.0, "473818070615354443321203"),
        'T' => (4.0, "0848 2822"),
        'U' => (4.0, "080312324348"),
        'V' => (4.0, "082248"),
        'W' => (4.0, "0812263248"),
        'X' => (4.0, "0248 0842"),
        'Y' => (4.0, "082548 2522"),
        'Z' => (4.0, "08480242"),
        'a' => (3.0, "3632 3526160503122233"),
        'b' => (3.0, "0802 0516263533221203"),
        'c' => (3.0, "3526160503122233"),
        'd' => (3.0, "3832 3526160503122233"),
        'e' => (3.0, "04343526160503122233"),
        'f' => (2.0, "28180702 0626"),
        'g' => (3.0, "3631201001 3526160503122233"),
        'h' => (3.0, "0802 0516263532"),
        'i' => (0.0, "0206 08"),
        'j' => (1.0, "161100 18"),
        'k' => (3.0, "0802 3604 1532"),
        'l' => (1.0, "080312"),
        'm' => (4.0, "0206 05162522 25364542"),
        'n' => (3.0, "0206 0516263532"),
        'o' => (3.0, "122233352616050312"),
        'p' => (3.0, "0006 0516263533221203"),
        'q' => (3.0, "3630 3526160503122233"),
        'r' => (2.0, "0206 051626"),
        's' => (3.0, "35261605142433221203"),
        't' => (2.0, "08031222 0626"),
        'u' => (3.0, "0603122233 3632"),
        'v' => (2.0, "061226"),
        'w' => (4.0, "0612253246"),
        'x' => (3.0, "0236 0632"),
        'y' => (2.0, "0613 2600"),
        'z' => (3.0, "06360232"),
        '.' => (0.4, "02"),
        ',' => (1.0, "1201"),
        ':' => (0.0, "02 05"),
        '-' => (3.0, "0535"),
        '+' => (4.0, "0545 2723"),
        '±' => (4.0, "0646 2824 0242"),
        '/' => (3.0, "0138"),
        '%' => (4.0, "0248 0717180807 3343423233"),
        '(' => (1.0, "18060311"),
        ')' => (1.0, "08161301"),
        '?' => (4.0, "071838474624 22"),
        '#' => (4.0, "1218 3238 0646 0444"),
        'σ' => (4.0, "461605031222333526"),
        _ => UNKNOWN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strokes_stay_inside_their_letters() {
        let all = (' '..='~').chain(['±', 'σ']);
        for character in all {
            let (width, strokes) = glyph(character);
            for stroke in strokes.split(' ').filter(|s| !s.is_empty()) {
                assert!(stroke.len().is_multiple_of(2), "{character}: {stroke}");
                let digits: Vec<u32> = stroke.chars().map(|c| c.to_digit(10).unwrap()).collect();
                for point in digits.chunks(2) {
                    assert!(f64::from(point[0]) <= width.max(4.0) && point[1] <= 8, "{character}: {stroke}");
                }
            }
        }
    }

    #[test]
    fn letters_and_digits_have_strokes_of_their_own() {
        let characters: Vec<char> = ('0'..='9').chain('A'..='Z').chain('a'..='z').collect();
        for (k, a) in characters.iter().enumerate() {
            assert_ne!(glyph(*a), UNKNOWN, "{a}");
            assert!(characters[..k].iter().all(|b| glyph(*a) != glyph(*b)), "{a}");
        }
    }
}
