//! The functions of a source text and how long they are.

/// The functions of a text with their lines. As rustfmt writes them, the closing brace stands below the first letter of the declaration.
pub fn functions(text: &str) -> Vec<(String, usize)> {
    let lines: Vec<&str> = text.lines().collect();
    let mut functions = Vec::new();
    for (start, line) in lines.iter().enumerate() {
        let words = line.trim_start();
        let indent = &line[..line.len() - words.len()];
        let Some((before, after)) = words.split_once("fn ") else {
            continue;
        };
        let modifiers = [
            "pub", "const", "async", "unsafe", "extern", "crate", "super", "in",
        ];
        let mut before = before.split(|c: char| !c.is_alphanumeric() && c != '_');
        if !before.all(|word| word.is_empty() || modifiers.contains(&word)) {
            continue;
        }
        let name: String = after
            .chars()
            .take_while(|c| c.is_alphanumeric() || *c == '_')
            .collect();
        let ends = |line: &&str| {
            let end = line.strip_prefix(indent).unwrap_or_default();
            end == "}" || (end.ends_with(';') && !end.starts_with(' '))
        };
        // A declaration without a body, or with one on its line.
        if line.ends_with(';') || line.ends_with('}') {
            continue;
        }
        if let Some(length) = lines[start + 1..].iter().position(ends) {
            functions.push((name, length + 2));
        }
    }
    functions
}
