//! Lines up adjoining one-line pieces: the `=` of fields always, anything else where its author had lined it up.

use super::Line;

/// Sets the padding of every cell.
pub(super) fn align(lines: &mut [Line]) {
    keep_sign_room(lines);
    let mut start = 0;
    while start < lines.len() {
        let mut end = start + 1;
        if lines[start].whole {
            while end < lines.len() && lines[end].whole && lines[end].body == lines[start].body {
                end += 1;
            }
            let run = &mut lines[start..end];
            equals(run);
            columns(run);
            comments(run);
        }
        start = end;
    }
}

/// `[ 0.5, 0, 0]` keeps its blank next to a line with `[-0.5, 0, 0]`.
fn keep_sign_room(lines: &mut [Line]) {
    let signed: Vec<bool> =
        lines.iter().map(|line| line.cells.windows(2).any(|pair| pair[0].text == "[" && pair[1].text == "-")).collect();
    for (i, line) in lines.iter_mut().enumerate() {
        let neighbours = [i.checked_sub(1), Some(i + 1)];
        let beside_signed = neighbours.into_iter().flatten().any(|i| signed.get(i) == Some(&true));
        for cell in line.cells.iter_mut().filter(|cell| cell.sign_room && beside_signed) {
            cell.gap = 1;
        }
    }
}

/// Lines up the `=` of adjoining fields. Stretches that their author lined up each by itself stay apart.
fn equals(run: &mut [Line]) {
    let mut start = 0;
    while start < run.len() {
        let mut end = start;
        while end < run.len() && run[end].equals.is_some() {
            end += 1;
        }
        if end > start {
            for group in groups(&run[start..end]) {
                line_up(run, group.iter().map(|line| (start + line, run[start + line].equals.unwrap_or(0))).collect());
            }
        }
        start = end.max(start + 1);
    }
}

/// Parts adjoining fields into those whose `=` share a column.
fn groups(fields: &[Line]) -> Vec<Vec<usize>> {
    let place = |i: usize| fields[i].equals.map(|cell| fields[i].cells[cell].place).unwrap_or_default();
    let natural = |i: usize| fields[i].column_behind(fields[i].equals.unwrap_or(0));
    let mut groups: Vec<(Option<usize>, Vec<usize>)> = Vec::new();
    let mut start = 0;
    while start < fields.len() {
        let mut end = start + 1;
        while end < fields.len()
            && place(end).column == place(start).column
            && place(end).line == place(end - 1).line + 1
        {
            end += 1;
        }
        let lined_up = (start..end).any(|i| natural(i) != natural(start));
        let column = lined_up.then(|| place(start).column);
        match groups.last_mut() {
            Some((known, group)) if column.is_none() || known.is_none() || *known == column => {
                *known = known.or(column);
                group.extend(start..end);
            }
            _ => groups.push((column, (start..end).collect())),
        }
        start = end;
    }
    groups.into_iter().map(|(_, group)| group).collect()
}

/// Lines up the other cells that stood in one column of adjoining lines, at least one of them behind extra blanks.
fn columns(run: &mut [Line]) {
    // (column in the source, the cells): sets of one column grow from line to line.
    let mut sets: Vec<(usize, Vec<(usize, usize)>)> = Vec::new();
    let mut open: Vec<(usize, usize)> = Vec::new();
    for below in 1..run.len() {
        let mut next = Vec::new();
        for (cell, other) in shared(&run[below - 1], &run[below]) {
            let set = match open.iter().find(|(known, _)| *known == cell) {
                Some((_, set)) => *set,
                None => {
                    sets.push((run[below].cells[other].place.column, vec![(below - 1, cell)]));
                    sets.len() - 1
                }
            };
            sets[set].1.push((below, other));
            next.push((other, set));
        }
        open = next;
    }
    sets.sort_by_key(|(column, _)| *column);
    for (_, cells) in sets {
        line_up(run, cells);
    }
}

/// The cells of two adjoining lines that stand below each other by their author's will.
fn shared(above: &Line, below: &Line) -> Vec<(usize, usize)> {
    let mut pairs = Vec::new();
    let (mut i, mut j) = (from(above), from(below));
    while i < above.cells.len() && j < below.cells.len() {
        let (a, b) = (&above.cells[i], &below.cells[j]);
        match a.place.column.cmp(&b.place.column) {
            std::cmp::Ordering::Less => i += 1,
            std::cmp::Ordering::Greater => j += 1,
            std::cmp::Ordering::Equal => {
                let adjoin = a.place.line + 1 == b.place.line;
                let spaced = a.gap == 1 && b.gap == 1 && !a.comment && !b.comment;
                if adjoin && spaced && (a.place.blanks > 1 || b.place.blanks > 1) {
                    pairs.push((i, j));
                }
                i += 1;
                j += 1;
            }
        }
    }
    pairs
}

/// The first cell of a line that may be lined up freely: that behind the `=` of a field.
fn from(line: &Line) -> usize {
    line.equals.map_or(1, |equals| equals + 1)
}

/// Lines up comments behind code that stood in one column.
fn comments(run: &mut [Line]) {
    let with_comment: Vec<usize> = (0..run.len())
        .filter(|i| run[*i].cells.len() > 1 && run[*i].cells.last().is_some_and(|cell| cell.comment))
        .collect();
    let last = |line: usize| (line, run[line].cells.len() - 1);
    let column = |line: usize| run[line].cells.last().map(|cell| cell.place.column);
    let groups: Vec<Vec<(usize, usize)>> = with_comment
        .chunk_by(|a, b| column(*a) == column(*b))
        .map(|group| group.iter().map(|line| last(*line)).collect())
        .collect();
    for group in groups {
        line_up(run, group);
    }
}

/// Pads the cells (line, cell) to the first column that all of them reach.
fn line_up(run: &mut [Line], cells: Vec<(usize, usize)>) {
    let natural =
        |run: &[Line], (line, cell): (usize, usize)| run[line].column_behind(cell) + run[line].cells[cell].gap;
    let column = cells.iter().map(|cell| natural(run, *cell)).max().unwrap_or(0);
    for cell in cells {
        let padding = column - natural(run, cell);
        run[cell.0].cells[cell.1].padding = padding;
    }
}
