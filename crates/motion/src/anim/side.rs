/// Side of the body, identified by a joint's name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Left,
    Right,
}

const WORDS: [(&str, &str); 3] = [("Left", "Right"), ("left", "right"), ("LEFT", "RIGHT")];

/// All readings of a joint's name as the name of one side: the side, and the name that the mirrored
/// joint would have.
///
/// The side may be the word `left` or `right` anywhere in the name, or the letter `L` or `R`: as a
/// separate word (`hand.l`, `l_hand`, `Bip01 L Hand`), before a capital at the start of a word
/// (`lHand`), or as a capital at the end of a word (`handL`).
pub(super) fn readings(name: &str) -> impl Iterator<Item = (Side, String)> {
    let (stem, tail) = name
        .strip_suffix("_End")
        .map_or((name, ""), |stem| (stem, "_End"));
    let words = WORDS
        .into_iter()
        .flat_map(|(left, right)| [(Side::Left, left, right), (Side::Right, right, left)])
        .filter(|(_, own, _)| stem.contains(own))
        .map(|(side, own, other)| (side, stem.replacen(own, other, 1)));
    let letters = stem.char_indices().filter_map(|(at, letter)| {
        let (side, other) = match letter {
            'L' => (Side::Left, "R"),
            'l' => (Side::Left, "r"),
            'R' => (Side::Right, "L"),
            'r' => (Side::Right, "l"),
            _ => return None,
        };
        let (before, after) = (&stem[..at], &stem[at + 1..]);
        tells_a_side(before, letter, after).then(|| (side, format!("{before}{other}{after}")))
    });
    words
        .chain(letters)
        .map(move |(side, twin)| (side, twin + tail))
}

fn tells_a_side(before: &str, letter: char, after: &str) -> bool {
    let (last, next) = (before.chars().next_back(), after.chars().next());
    let starts_word = last.is_none_or(|c| !c.is_alphanumeric());
    let ends_word = next.is_none_or(|c| !c.is_alphanumeric());
    let capital_follows = next.is_some_and(char::is_uppercase);
    let small_precedes = last.is_some_and(|c| c.is_lowercase() || c.is_numeric());
    starts_word && (ends_word || capital_follows)
        || ends_word && letter.is_uppercase() && small_precedes
}
