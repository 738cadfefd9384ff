//! Edits of single values in the text of a scene file. Only the bytes of the value change: comments, layout, line
//! endings and a byte-order mark are preserved. A missing key is added to its table, in the style of the table's keys.

use std::ops::Range;

use toml::Value;
use toml_edit::{Document, InlineTable, Item, Table, Value as ParsedValue};

use wgray_scene::{KeyPath, Pieces, Segment};

/// The reason why a key or value without a source span cannot be edited.
const NO_LOCATION: &str = "cannot be located in the file";

/// Replacement text for a byte range.
type Edit = (Range<usize>, String);

/// Returns the text with the key set to the value, or removed if `value` is `None`.
///
/// # Errors
///
/// The reason why the value cannot be set.
pub fn edited(text: &str, path: &KeyPath, value: Option<&Value>) -> Result<String, String> {
    edited_in(&Pieces::of(text), path, value)
}

/// Like [`edited`], for a text that is already split into pieces.
///
/// # Errors
///
/// The reason why the value cannot be set.
pub fn edited_in(pieces: &Pieces, path: &KeyPath, value: Option<&Value>) -> Result<String, String> {
    let piece = pieces.find(path);
    let edits = edits(&piece.text, &piece.path, value).map_err(|reason| format!("{path}: {reason}"))?;
    let mut text_edits: Vec<Edit> = Vec::with_capacity(edits.len());
    for (range, new) in edits {
        // Only the start is mapped to the full text, because the end may belong to the next piece.
        let start = piece.place(range.start);
        text_edits.push((start..start + range.len(), new));
    }
    // Edits are applied from the end, so that the offsets of the remaining edits stay valid.
    text_edits.sort_by_key(|(range, _)| std::cmp::Reverse(range.start));
    let mut text = pieces.whole().to_owned();
    for (range, new) in text_edits {
        text.replace_range(range, &new);
    }
    Ok(text)
}

/// Parsed text in which keys and values can be located.
pub struct Layout<'a>(Document<&'a str>);

impl<'a> Layout<'a> {
    /// Parses a text; returns `None` if the text is not TOML.
    pub fn of(text: &'a str) -> Option<Layout<'a>> {
        Document::parse(text).ok().map(Layout)
    }

    /// Returns the range from the first to the last byte of all keys and values at a path.
    pub fn extent(&self, path: &KeyPath) -> Option<Range<usize>> {
        let node_path = NodePath::along(self.0.as_table(), &path.0);
        node_path.missing.is_empty().then_some(())?;
        let mut found = None;
        // The key precedes its value; a table's header is part of the table.
        if let Some(Node::Table(parent)) = node_path.nodes.iter().rev().nth(1)
            && let Some(Segment::Key(key)) = path.0.last()
            && !matches!(node_path.nodes.last()?, Node::Table(table) if !table.is_dotted())
        {
            found = parent.key(key).and_then(toml_edit::Key::span);
        }
        cover(&mut found, *node_path.nodes.last()?);
        found
    }

    /// Returns the range of the value at a path.
    pub fn value(&self, path: &KeyPath) -> Option<Range<usize>> {
        let node_path = NodePath::along(self.0.as_table(), &path.0);
        match node_path.nodes.last()? {
            Node::Value(value) if node_path.missing.is_empty() => value.span(),
            _ => None,
        }
    }
}

#[derive(Clone, Copy)]
enum Node<'a> {
    Table(&'a Table),
    Tables(&'a toml_edit::ArrayOfTables),
    Value(&'a ParsedValue),
}

impl<'a> Node<'a> {
    fn of(item: &'a Item) -> Option<Node<'a>> {
        match item {
            Item::Table(table) => Some(Node::Table(table)),
            Item::ArrayOfTables(tables) => Some(Node::Tables(tables)),
            Item::Value(value) => Some(Node::Value(value)),
            Item::None => None,
        }
    }

    fn step(self, segment: &Segment) -> Option<Node<'a>> {
        match (self, segment) {
            (Node::Table(table), Segment::Key(key)) => Node::of(table.get(key)?),
            (Node::Value(ParsedValue::InlineTable(table)), Segment::Key(key)) => table.get(key).map(Node::Value),
            (Node::Tables(tables), Segment::Index(i)) => tables.get(*i).map(Node::Table),
            (Node::Value(ParsedValue::Array(list)), Segment::Index(i)) => list.get(*i).map(Node::Value),
            _ => None,
        }
    }

    fn inline(self) -> Option<&'a InlineTable> {
        match self {
            Node::Value(value) => value.as_inline_table(),
            _ => None,
        }
    }

    /// Returns true if a table is defined by dotted keys.
    fn is_dotted(self) -> bool {
        match self {
            Node::Table(table) => table.is_dotted(),
            Node::Value(value) => value.as_inline_table().is_some_and(InlineTable::is_dotted),
            Node::Tables(_) => false,
        }
    }
}

/// The existing nodes along a path.
struct NodePath<'a, 'p> {
    nodes: Vec<Node<'a>>,
    /// The segments of the path that do not exist.
    missing: &'p [Segment],
}

impl<'a, 'p> NodePath<'a, 'p> {
    fn along(root: &'a Table, path: &'p [Segment]) -> NodePath<'a, 'p> {
        let mut nodes = vec![Node::Table(root)];
        for (i, segment) in path.iter().enumerate() {
            match nodes.last().and_then(|node| node.step(segment)) {
                Some(node) => nodes.push(node),
                None => {
                    return NodePath {
                        nodes,
                        missing: &path[i..],
                    };
                }
            }
        }
        NodePath { nodes, missing: &[] }
    }
}

fn edits(text: &str, path: &KeyPath, value: Option<&Value>) -> Result<Vec<Edit>, String> {
    let document = Document::parse(text).map_err(|error| error.message().to_owned())?;
    let node_path = NodePath::along(document.as_table(), &path.0);
    let node = *node_path.nodes.last().ok_or(NO_LOCATION)?;
    match (value, node_path.missing) {
        (None, []) => Ok(vec![removal(text, &node_path, &path.0)?]),
        (None, _) => Ok(Vec::new()),
        (Some(new), []) => {
            let Node::Value(old) = node else {
                return Err("is a table under its own header".to_owned());
            };
            let mut edits = Vec::new();
            replacement(old, new, &mut edits).ok_or(NO_LOCATION)?;
            Ok(edits)
        }
        (Some(new), [Segment::Key(key), sub_path @ ..]) => {
            let mut new_value = literal(new);
            for segment in sub_path.iter().rev() {
                let Segment::Key(key) = segment else {
                    return Err("is not in the scene".to_owned());
                };
                new_value = format!("{{ {key} = {new_value} }}");
            }
            let existing = path.0.len() - node_path.missing.len();
            addition(text, &node_path, &path.0[..existing], key, &new_value).map(|edit| vec![edit])
        }
        (Some(_), [Segment::Index(_), ..]) => Err("is not in the scene".to_owned()),
    }
}

/// Adds the edits that replace the old value; no edits if the values are equal.
fn replacement(old: &ParsedValue, new: &Value, edits: &mut Vec<Edit>) -> Option<()> {
    let is_same = match (old, new) {
        (ParsedValue::Array(before), Value::Array(after)) if before.len() == after.len() => {
            let mut pairs = before.iter().zip(after);
            return pairs.try_for_each(|(old, new)| replacement(old, new, edits));
        }
        (ParsedValue::String(before), Value::String(after)) => before.value() == after,
        (ParsedValue::Boolean(before), Value::Boolean(after)) => before.value() == after,
        _ => {
            let old_number = old.as_float().or(old.as_integer().map(|i| i as f64));
            let new_number = new.as_float().or(new.as_integer().map(|i| i as f64));
            old_number.is_some() && old_number == new_number
        }
    };
    if !is_same {
        edits.push((old.span()?, literal(new)));
    }
    Some(())
}

/// Returns the edit that adds a key to the table at the end of a path, after the table's last key.
fn addition(text: &str, node_path: &NodePath, path: &[Segment], key: &str, value: &str) -> Result<Edit, String> {
    let node = *node_path.nodes.last().ok_or(NO_LOCATION)?;
    // A table of dotted keys repeats the same prefix before each key.
    let dotted_tables = node_path.nodes.iter().rev().take_while(|node| node.is_dotted()).count();
    let prefix = KeyPath(path[path.len() - dotted_tables..].to_vec()).exact();
    let dot = if dotted_tables > 0 { "." } else { "" };
    let statement = format!("{prefix}{dot}{key} = {value}");
    let is_root = node_path.nodes.len() == 1;
    match node {
        Node::Value(ParsedValue::InlineTable(table)) => {
            let mut extent = None;
            cover(&mut extent, node);
            let values = table.iter().filter_map(|(_, value)| value.span());
            Ok(match (values.map(|span| span.end).max(), dotted_tables) {
                (Some(end), 0) => (end..end, format!(", {statement}")),
                (Some(_), _) => {
                    let end = extent.ok_or(NO_LOCATION)?.end;
                    (end..end, format!(", {statement}"))
                }
                (None, _) => {
                    let start = table.span().ok_or(NO_LOCATION)?.start + 1;
                    (start..start, format!(" {statement} "))
                }
            })
        }
        Node::Table(table) => match body_range(table) {
            Some(body) => {
                let line = line_start(text, body.start);
                let indent: String = text[line..].chars().take_while(|c| " \t".contains(*c)).collect();
                Ok(insert_after_line(text, body.end, &format!("{indent}{statement}")))
            }
            None if is_root => Ok(new_section(text, table, key, value)),
            None if !table.is_implicit() => {
                let header = table.span().ok_or(NO_LOCATION)?;
                Ok(insert_after_line(text, header.end, &statement))
            }
            None => {
                let mut extent = None;
                cover(&mut extent, node);
                let start = line_start(text, extent.ok_or(NO_LOCATION)?.start);
                let newline = line_break(text, start);
                let header = KeyPath(path.to_vec()).exact();
                Ok((
                    start..start,
                    format!("[{header}]{newline}{statement}{newline}{newline}"),
                ))
            }
        },
        _ => Err("does not belong to a table".to_owned()),
    }
}

/// Returns the edit that adds a missing section, after the section of the camera or of the image.
fn new_section(text: &str, root: &Table, name: &str, value: &str) -> Edit {
    let mut section = None;
    if let Some(item) = root.get("camera").or(root.get("image")) {
        Node::of(item).into_iter().for_each(|node| cover(&mut section, node));
    }
    let end = section.map_or(text.len(), |section| section.end);
    let newline = line_break(text, end);
    // `{ a = 1 }` becomes one line under a header.
    let inner = value
        .strip_prefix("{ ")
        .and_then(|inner| inner.strip_suffix(" }"))
        .unwrap_or(value);
    insert_after_line(text, end, &format!("{newline}[{name}]{newline}{inner}"))
}

/// Returns the edit that inserts a line after the line that contains the byte `offset`.
fn insert_after_line(text: &str, offset: usize, line: &str) -> Edit {
    let end = line_end(text, offset);
    (end..end, format!("{}{line}", line_break(text, offset)))
}

/// Returns the start of the line that contains the byte `offset`, after a byte-order mark.
pub fn line_start(text: &str, offset: usize) -> usize {
    let start = text[..offset].rfind('\n').map_or(0, |newline| newline + 1);
    let bom_len = '\u{feff}'.len_utf8();
    if start == 0 && text.starts_with('\u{feff}') {
        bom_len.min(offset)
    } else {
        start
    }
}

/// Returns the end of the line that contains the byte `offset`, without the line break.
pub fn line_end(text: &str, offset: usize) -> usize {
    let end = text[offset..].find('\n').map_or(text.len(), |newline| offset + newline);
    if text[offset..end].ends_with('\r') {
        end - 1
    } else {
        end
    }
}

/// Returns the line break of a line. For the last line, returns the line break of the first line.
fn line_break(text: &str, offset: usize) -> &'static str {
    let next = text[offset..].find('\n').map(|newline| offset + newline);
    match next.or(text.find('\n')) {
        Some(end) if text[..end].ends_with('\r') => "\r\n",
        _ => "\n",
    }
}

/// Returns the edit that removes the key at the end of a path, and the key's table if the table becomes empty.
fn removal(text: &str, node_path: &NodePath, path: &[Segment]) -> Result<Edit, String> {
    let refuse = || Err("can only be removed in the scene file".to_owned());
    let mut depth = path.len();
    loop {
        let ([.., parent, node], Some(Segment::Key(key))) = (&node_path.nodes[..=depth], path.get(depth - 1)) else {
            return refuse();
        };
        let Node::Value(value) = node else { return refuse() };
        let end = value.span().ok_or(NO_LOCATION)?.end;
        match (parent, parent.inline()) {
            (_, Some(table)) if table.is_dotted() => return refuse(),
            (_, Some(table)) if table.len() == 1 && depth > 1 => depth -= 1,
            (_, Some(table)) => {
                let start = table.key(key).and_then(toml_edit::Key::span).ok_or(NO_LOCATION)?.start;
                let after = text[end..].trim_start_matches([' ', '\t', '\r', '\n']);
                let before = text[..start].trim_end_matches([' ', '\t', '\r', '\n']);
                return match (after.strip_prefix(','), before.strip_suffix(',')) {
                    (Some(rest), _) => Ok((
                        start..text.len() - rest.trim_start_matches([' ', '\t']).len(),
                        String::new(),
                    )),
                    (None, Some(rest)) => Ok((rest.len()..end, String::new())),
                    _ => refuse(),
                };
            }
            (Node::Table(table), None) => {
                let start = table.key(key).and_then(toml_edit::Key::span).ok_or(NO_LOCATION)?.start;
                let (start, stop) = (line_start(text, start), line_end(text, end));
                let comment = text[end..stop].trim_start();
                if !comment.is_empty() {
                    return Ok((start..stop - comment.len(), String::new()));
                }
                let next = text[stop..].find('\n').map_or(text.len(), |newline| stop + newline + 1);
                return Ok((start..next, String::new()));
            }
            _ => return refuse(),
        }
    }
}

/// Returns the range of the keys in a table's own body, without keys under other headers.
fn body_range(table: &Table) -> Option<Range<usize>> {
    let mut range = None;
    for (key, item) in table.iter() {
        let span = match item {
            Item::Value(value) => value.span(),
            Item::Table(inner) if inner.is_dotted() => body_range(inner),
            _ => continue,
        };
        let key = table.key(key).and_then(toml_edit::Key::span);
        for span in [key, span].into_iter().flatten() {
            widen(&mut range, span);
        }
    }
    range
}

/// Extends `range` by the keys and values of a node.
fn cover(range: &mut Option<Range<usize>>, node: Node) {
    match node {
        Node::Value(value) => match value.as_inline_table().filter(|table| table.is_dotted()) {
            Some(table) => table.iter().for_each(|(_, value)| cover(range, Node::Value(value))),
            None => value.span().into_iter().for_each(|span| widen(range, span)),
        },
        Node::Tables(tables) => tables.iter().for_each(|table| cover(range, Node::Table(table))),
        Node::Table(table) => {
            if !table.is_implicit() && !table.is_dotted() {
                table.span().into_iter().for_each(|span| widen(range, span));
            }
            for (key, item) in table.iter() {
                let is_header = matches!(item, Item::Table(inner) if !inner.is_dotted()) || item.is_array_of_tables();
                let key = table.key(key).and_then(toml_edit::Key::span).filter(|_| !is_header);
                key.into_iter().for_each(|span| widen(range, span));
                Node::of(item).into_iter().for_each(|node| cover(range, node));
            }
        }
    }
}

/// Extends a range to contain a span.
fn widen(range: &mut Option<Range<usize>>, span: Range<usize>) {
    if span.is_empty() {
        return; // the root table has no header
    }
    *range = Some(match range.take() {
        Some(old) => old.start.min(span.start)..old.end.max(span.end),
        None => span,
    });
}

/// Formats a value for a scene file. Integral numbers have no decimal point.
fn literal(value: &Value) -> String {
    match value {
        Value::Float(x) if x.fract() == 0.0 && x.abs() < 1e15 => format!("{x:.0}"),
        Value::Array(list) => format!("[{}]", list.iter().map(literal).collect::<Vec<_>>().join(", ")),
        value => value.to_string(),
    }
}

#[cfg(test)]
mod tests;
