//! Commands of this program as pages and messages print them, so that a shell runs them again.

use shlex::Quoter;

/// `wayhome` with these words, each quoted where a shell would read it otherwise.
///
/// ```
/// assert_eq!(wayhome::command_line::command_line(["world", "check", "my room.toml"]), "wayhome world check 'my room.toml'");
/// ```
pub fn command_line<S: AsRef<str>>(words: impl IntoIterator<Item = S>) -> String {
    let mut line = "wayhome".to_owned();
    for word in words {
        line.push(' ');
        line.push_str(&quoted(word.as_ref()));
    }
    line
}

fn quoted(word: &str) -> String {
    // No argument of a process holds a NUL, the one byte that cannot be quoted.
    let quote = |text: &str| Quoter::new().allow_nul(true).quote(text).map_or_else(|_| text.to_owned(), Into::into);
    // A comma is special between braces only; `shlex` quotes it everywhere, and lists of values are easier to read without.
    let bare = word.replace(',', "");
    if !bare.is_empty() && quote(&bare) == bare { word.to_owned() } else { quote(word) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shell_reads_the_words_again() {
        let words = [
            "home",
            "my room.toml",
            "",
            "~",
            "a,b",
            ",",
            "{a,b}",
            "$HOME",
            "it's",
            "exec:python3 'a b.py' \"c\"",
            "#1",
            "x=*",
            "ä",
        ];
        let line = command_line(words);
        assert_eq!(shlex::split(&line).unwrap()[1..], words, "{line}");
        assert_eq!(
            command_line(["compare", "--seeds", "1..3", "--start", "1,2,-90"]),
            "wayhome compare --seeds 1..3 --start 1,2,-90"
        );
    }
}
