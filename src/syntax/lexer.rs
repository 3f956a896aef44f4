//! Text to tokens, in one pass over the bytes, for the splitter and the formatter.
//!
//! No input is refused here: what is no token of the language becomes [`TokenKind::Unknown`] and the grammar rejects it.

/// What a token is; its text is in the source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TokenKind {
    /// A name or a reserved word.
    Word,
    Number,
    /// A string with both its quotes.
    Text,
    /// A string that its line cut off.
    CutText,
    /// `// …`, to the end of the line.
    Comment,
    /// `/// …`, to the end of the line.
    Doc,
    Newline,
    /// `;`
    Semicolon,
    /// `,`
    Comma,
    /// `(`, `[` or `{`
    Open(u8),
    /// `)`, `]` or `}`
    Close(u8),
    /// An operator or a punctuation mark, as long as it can be: `..<`, `->`, `==`, `:`.
    Symbol,
    /// A character that the language has no use for.
    Unknown,
}

/// Half-open byte range of one token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Token {
    pub kind: TokenKind,
    pub start: u32,
    pub end: u32,
}

impl Token {
    pub fn text<'t>(&self, text: &'t str) -> &'t str {
        text.get(self.start as usize..self.end as usize).unwrap_or("")
    }

    /// Neither comment nor line end.
    pub fn is_code(&self) -> bool {
        !matches!(self.kind, TokenKind::Comment | TokenKind::Doc | TokenKind::Newline)
    }
}

/// The symbols of more than one character, longest first.
const LONG_SYMBOLS: [&[u8]; 9] = [b"..<", b"..", b"->", b"==", b"!=", b"<=", b">=", b"&&", b"||"];

/// Cuts a text into tokens; blanks are left out. Linear in the length of the text, which must be under 4 GiB.
pub(super) fn lex(text: &str) -> Vec<Token> {
    let bytes = text.as_bytes();
    let mut tokens = Vec::with_capacity(bytes.len() / 4);
    let mut at = 0;
    while at < bytes.len() {
        let start = at;
        let Some((kind, end)) = next(text, bytes, at) else {
            at += blank_length(bytes, at);
            continue;
        };
        at = end;
        tokens.push(Token { kind, start: start as u32, end: end as u32 });
    }
    tokens
}

/// The token at `at` and where it ends; None at a blank.
fn next(text: &str, bytes: &[u8], at: usize) -> Option<(TokenKind, usize)> {
    use TokenKind::*;
    Some(match bytes[at] {
        b' ' | b'\t' | b'\r' => return None,
        0xEF if bytes[at..].starts_with("\u{FEFF}".as_bytes()) => return None,
        b'\n' => (Newline, at + 1),
        b';' => (Semicolon, at + 1),
        b',' => (Comma, at + 1),
        bracket @ (b'(' | b'[' | b'{') => (Open(bracket), at + 1),
        bracket @ (b')' | b']' | b'}') => (Close(bracket), at + 1),
        b'"' => string(bytes, at),
        b'/' if bytes[at..].starts_with(b"//") => comment(bytes, at),
        byte if is_name_start(byte) => (Word, run(bytes, at, is_name_char)),
        byte if byte.is_ascii_digit() => (Number, number(bytes, at)),
        byte if byte.is_ascii() => symbol(bytes, at),
        _ => (Unknown, at + text[at..].chars().next().map_or(1, char::len_utf8)),
    })
}

fn blank_length(bytes: &[u8], at: usize) -> usize {
    if bytes[at] == 0xEF { 3 } else { 1 }
}

pub(super) fn is_name_start(byte: u8) -> bool {
    byte.is_ascii_alphabetic() || byte == b'_'
}

pub(super) fn is_name_char(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || byte == b'_'
}

/// The end of the run of bytes from `at` on which `belongs` holds.
fn run(bytes: &[u8], at: usize, belongs: impl Fn(u8) -> bool) -> usize {
    at + bytes[at..].iter().take_while(|byte| belongs(**byte)).count()
}

fn number(bytes: &[u8], at: usize) -> usize {
    let mut end = run(bytes, at, |byte| byte.is_ascii_digit());
    if bytes.get(end) == Some(&b'.') && bytes.get(end + 1).is_some_and(u8::is_ascii_digit) {
        end = run(bytes, end + 1, |byte| byte.is_ascii_digit());
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let digits = end + 1 + sign;
        let exponent_end = run(bytes, digits.min(bytes.len()), |byte| byte.is_ascii_digit());
        if exponent_end > digits && !bytes.get(exponent_end).is_some_and(|byte| is_name_char(*byte)) {
            end = exponent_end;
        }
    }
    end
}

fn string(bytes: &[u8], at: usize) -> (TokenKind, usize) {
    let mut end = at + 1;
    while let Some(byte) = bytes.get(end) {
        match byte {
            b'"' => return (TokenKind::Text, end + 1),
            b'\n' => break,
            b'\\' if bytes.get(end + 1).is_some_and(|next| *next != b'\n') => end += 2,
            _ => end += 1,
        }
    }
    (TokenKind::CutText, end.min(bytes.len()))
}

fn comment(bytes: &[u8], at: usize) -> (TokenKind, usize) {
    let end = run(bytes, at, |byte| byte != b'\n');
    let is_doc = bytes[at..].starts_with(b"///") && bytes.get(at + 3) != Some(&b'/');
    (if is_doc { TokenKind::Doc } else { TokenKind::Comment }, end)
}

fn symbol(bytes: &[u8], at: usize) -> (TokenKind, usize) {
    let rest = &bytes[at..];
    let length = LONG_SYMBOLS.iter().find(|symbol| rest.starts_with(symbol)).map_or(1, |symbol| symbol.len());
    let known = length > 1 || b"=:.+-*/^<>?|%".contains(&bytes[at]);
    (if known { TokenKind::Symbol } else { TokenKind::Unknown }, at + length)
}

#[cfg(test)]
mod tests {
    use super::TokenKind::*;
    use super::*;

    fn kinds(text: &str) -> Vec<(TokenKind, &str)> {
        lex(text).iter().map(|token| (token.kind, token.text(text))).collect()
    }

    #[test]
    fn a_range_of_whole_numbers_is_three_tokens() {
        assert_eq!(kinds("0..9"), [(Number, "0"), (Symbol, ".."), (Number, "9")]);
        assert_eq!(kinds("0 ..< 9.5e-3"), [(Number, "0"), (Symbol, "..<"), (Number, "9.5e-3")]);
    }

    #[test]
    fn an_exponent_needs_digits() {
        assert_eq!(kinds("2eV"), [(Number, "2"), (Word, "eV")]);
        assert_eq!(kinds("2e"), [(Number, "2"), (Word, "e")]);
        assert_eq!(kinds("1e308"), [(Number, "1e308")]);
    }

    #[test]
    fn comments_docs_and_strings_end_with_their_line() {
        assert_eq!(
            kinds("/// a\n// b\n//// c\n\"x // y\" \"cut\nz"),
            [
                (Doc, "/// a"),
                (Newline, "\n"),
                (Comment, "// b"),
                (Newline, "\n"),
                (Comment, "//// c"),
                (Newline, "\n"),
                (Text, "\"x // y\""),
                (CutText, "\"cut"),
                (Newline, "\n"),
                (Word, "z"),
            ]
        );
    }

    #[test]
    fn strange_characters_are_unknown_and_whole() {
        assert_eq!(kinds("µm #"), [(Unknown, "µ"), (Word, "m"), (Unknown, "#")]);
        assert_eq!(kinds("\u{FEFF}a\\"), [(Word, "a"), (Unknown, "\\")]);
    }
}
