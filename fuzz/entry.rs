/// What must hold of any bytes: they are refused as text, or read without a panic; labels lie in the text; what parses
/// formats, to the same meaning, and only once.
pub fn entry(bytes: &[u8]) {
    use ripstop::diagnostics::FileId;
    use ripstop::syntax;

    let Ok(text) = syntax::decode("fuzz.weave", bytes.to_vec()) else { return };
    let mut diagnostics = Vec::new();
    let tree = syntax::parse(FileId(0), &text, &mut diagnostics);
    for label in diagnostics.iter().flat_map(|diagnostic| &diagnostic.labels) {
        assert!(text.get(label.span.range()).is_some(), "a label outside of the text: {label:?}");
    }
    if diagnostics.iter().any(|diagnostic| diagnostic.is_error()) {
        assert!(syntax::format(FileId(0), &text).is_err());
        return;
    }
    let once = syntax::format(FileId(0), &text).expect("what parses is formatted");
    let mut again = Vec::new();
    let formatted = syntax::parse(FileId(0), &once, &mut again);
    assert_eq!(tree.without_spans(), formatted.without_spans(), "formatting changed the meaning");
    assert_eq!(syntax::format(FileId(0), &once).as_deref(), Ok(once.as_str()), "formatting twice is not formatting once");
}
