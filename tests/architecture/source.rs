//! One file of Rust as the rules read it: code, comments and test modules told apart, each line and
//! column kept.
//!
//! No parser: the lexical grammar (The Rust Reference, "Tokens" and "Comments") is enough to say
//! what is code, and the rules then look for paths and words. A path that a macro puts together is
//! not seen.

/// A file's text three times over, each as long as the file itself, with blanks for what is left
/// out.
pub(crate) struct Source {
    /// From the repository's root, with `/` on every system.
    pub(crate) path: String,
    /// No comments, no text or character literals.
    pub(crate) code: String,
    /// `code` without what is compiled for tests only.
    pub(crate) library: String,
    /// Comments only.
    pub(crate) comments: String,
}

impl Source {
    pub(crate) fn new(path: &str, text: &str) -> Self {
        let (code, comments) = split(text);
        let library = without_tests(&code);
        Self {
            path: path.to_owned(),
            code,
            library,
            comments,
        }
    }

    /// The module's path in the crate: `src/maps/slab.rs` is `region`, `slab`.
    pub(crate) fn module(&self) -> Vec<&str> {
        let inside = self.path.strip_prefix("src/").unwrap_or(&self.path);
        let mut names: Vec<&str> = inside.trim_end_matches(".rs").split('/').collect();
        if matches!(names.last(), Some(&"mod" | &"lib" | &"main")) {
            names.pop();
        }
        names
    }

    pub(crate) fn line_of(&self, at: usize) -> usize {
        self.code[..at].matches('\n').count() + 1
    }

    pub(crate) fn complaint(&self, at: usize, words: &str) -> String {
        format!("{}:{}: {words}", self.path, self.line_of(at))
    }

    /// The modules of this file that stand in files of their own and are compiled for tests only.
    pub(crate) fn test_modules(&self) -> Vec<String> {
        test_items(&self.code)
            .filter_map(|(start, end)| {
                let item = self.code[start..end].strip_suffix(';')?;
                let (_, name) = item.split_once("mod ")?;
                let mut folder = self.module();
                folder.push(name.trim());
                Some(folder.join("/"))
            })
            .collect()
    }
}

/// Where `word` stands alone in `code`, not as a part of a longer name.
pub(crate) fn words<'a>(code: &'a str, word: &'a str) -> impl Iterator<Item = usize> + 'a {
    code.match_indices(word)
        .map(|(at, _)| at)
        .filter(move |&at| {
            let before = code[..at].chars().next_back();
            let after = code[at + word.len()..].chars().next();
            !before.is_some_and(is_of_name) && !after.is_some_and(is_of_name)
        })
}

/// The name at the start of `code`, empty where there is none.
pub(crate) fn name_at(code: &str) -> &str {
    let code = code.trim_start();
    &code[..code
        .find(|letter| !is_of_name(letter))
        .unwrap_or(code.len())]
}

/// The end of the block that opens at `open`: just after its closing brace.
pub(crate) fn block_end(code: &str, open: usize) -> usize {
    let mut depth = 0;
    for (at, letter) in code.bytes().enumerate().skip(open) {
        match letter {
            b'{' => depth += 1,
            b'}' if depth == 1 => return at + 1,
            b'}' => depth -= 1,
            _ => {}
        }
    }
    code.len()
}

fn is_of_name(letter: char) -> bool {
    letter == '_' || letter.is_alphanumeric()
}

/// Code and comments of `text`.
fn split(text: &str) -> (String, String) {
    let blank: String = text
        .bytes()
        .map(|byte| if byte == b'\n' { '\n' } else { ' ' })
        .collect();
    let (mut code, mut comments) = (blank.clone(), blank);
    let mut at = 0;
    while at < text.len() {
        let rest = &text[at..];
        let comment = comment_length(rest);
        let literal = literal_length(rest, text[..at].chars().next_back());
        let letter = rest.chars().next().map_or(1, char::len_utf8);
        if comment > 0 {
            comments.replace_range(at..at + comment, &rest[..comment]);
        } else if literal == 0 {
            code.replace_range(at..at + letter, &rest[..letter]);
        }
        at += comment.max(literal).max(letter);
    }
    (code, comments)
}

/// The length of the comment that starts `rest`, or 0.
fn comment_length(rest: &str) -> usize {
    if rest.starts_with("//") {
        return rest.find('\n').unwrap_or(rest.len());
    }
    if !rest.starts_with("/*") {
        return 0;
    }
    let (mut at, mut depth) = (0, 0);
    while at < rest.len() {
        if rest[at..].starts_with("/*") {
            (at, depth) = (at + 2, depth + 1);
        } else if rest[at..].starts_with("*/") {
            (at, depth) = (at + 2, depth - 1);
            if depth == 0 {
                return at;
            }
        } else {
            at += rest[at..].chars().next().map_or(1, char::len_utf8);
        }
    }
    at
}

/// The length of the text or character literal that starts `rest`, or 0. A lifetime is none.
fn literal_length(rest: &str, before: Option<char>) -> usize {
    if rest.starts_with('"') {
        return closed_at(rest, 1, '"');
    }
    if let Some(after) = rest.strip_prefix('\'') {
        let mut letters = after.chars();
        return match (letters.next(), letters.next()) {
            (Some('\\'), _) => closed_at(rest, 1, '\''),
            (Some(letter), Some('\'')) => 2 + letter.len_utf8(),
            _ => 0,
        };
    }
    let raw = rest
        .strip_prefix("br")
        .or(rest.strip_prefix("cr"))
        .or(rest.strip_prefix('r'));
    let Some(after) = raw.filter(|_| !before.is_some_and(is_of_name)) else {
        return 0;
    };
    let hashes = after.len() - after.trim_start_matches('#').len();
    if !after[hashes..].starts_with('"') {
        return 0;
    }
    let open = rest.len() - after.len() + hashes + 1;
    let close = format!("\"{}", "#".repeat(hashes));
    rest[open..]
        .find(&close)
        .map_or(rest.len(), |at| open + at + close.len())
}

fn closed_at(rest: &str, from: usize, close: char) -> usize {
    let mut escaped = false;
    for (at, letter) in rest.char_indices().skip(from) {
        match letter {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            _ if letter == close => return at + 1,
            _ => {}
        }
    }
    rest.len()
}

/// From where to where items are compiled for tests only.
fn test_items(code: &str) -> impl Iterator<Item = (usize, usize)> + '_ {
    ["#[cfg(test)]", "#[cfg(all(test,"]
        .into_iter()
        .flat_map(move |attribute| {
            code.match_indices(attribute).filter_map(move |(start, _)| {
                let after = start + code[start..].find(']')?;
                let open = after + code[after..].find(['{', ';'])?;
                let is_block = code[open..].starts_with('{');
                Some((
                    start,
                    if is_block {
                        block_end(code, open)
                    } else {
                        open + 1
                    },
                ))
            })
        })
}

fn without_tests(code: &str) -> String {
    let mut left = code.to_owned();
    for (start, end) in test_items(code) {
        let blank: String = code[start..end]
            .bytes()
            .map(|byte| if byte == b'\n' { '\n' } else { ' ' })
            .collect();
        left.replace_range(start..end, &blank);
    }
    left
}
