//! Drafts: from the variants of `draft` to one repeat of a weave.

use crate::geometry::draft::Draft as Drawn;
use crate::geometry::wif;
use crate::scene::Draft;
use crate::semantics::value::{Object, Value};

/// The draft that an object of a `draft` kind stands for, or what is wrong with it.
pub fn draft_of(object: &Object) -> Result<Draft, String> {
    let count = |name: &str| count_of(object, name);
    let drawn = match &*object.kind {
        "drawdown" => return drawdown(object),
        "twill" => Drawn::twill(count("up")?, count("down")?, count("step")?),
        "satin" => Drawn::satin(count("ends")?, count("counter")?),
        "grouped" => Drawn::basket(count("ends")?, count("picks")?),
        "ripstop_grid" => Drawn::ripstop(count("ground")?, count("heavy")?),
        "tied_up" => {
            let threading = singles(counts_of(object, "threading")?);
            let treadling = singles(counts_of(object, "treadling")?);
            let tie_up = rows_of(object, "tie_up")?;
            let shafts = largest(threading.iter().chain(&tie_up));
            Drawn::from_treadling(shafts, &threading, &tie_up, &treadling)
        }
        "lifted" => {
            let threading = singles(counts_of(object, "threading")?);
            let lifts = rows_of(object, "lift_plan")?;
            let shafts = largest(threading.iter().chain(&lifts));
            Drawn::from_lift_plan(shafts, &threading, &lifts)
        }
        other => return Err(format!("a draft by `{other}` is not available yet")),
    };
    let held = drawn.and_then(Drawn::interlaced);
    held.map(|drawn| from_drawn(&object.name, drawn)).map_err(|error| error.to_string())
}

/// A draft from the text of a WIF file.
pub fn draft_from_wif(path: &str, text: &str) -> Result<Draft, String> {
    let read = wif::read(text).map_err(|error| error.to_string())?;
    Ok(from_drawn(read.title.as_deref().unwrap_or(path), read.draft))
}

fn from_drawn(name: &str, drawn: Drawn) -> Draft {
    Draft {
        name: name.to_owned(),
        ends: drawn.ends as u32,
        picks: drawn.picks as u32,
        up: drawn.up,
        end_colours: drawn.end_colours.into_iter().map(u32::from).collect(),
        pick_colours: drawn.pick_colours.into_iter().map(u32::from).collect(),
    }
}

fn drawdown(object: &Object) -> Result<Draft, String> {
    let rows = rows_of(object, "rows")?;
    let ends = rows.first().map_or(0, Vec::len);
    if ends == 0 {
        return Err("a draft needs at least one end and one pick".to_owned());
    }
    let mut up = Vec::with_capacity(rows.len() * ends);
    for (pick, row) in rows.iter().enumerate() {
        if row.len() != ends {
            return Err(format!("row {} has {} ends and the first has {ends}", pick + 1, row.len()));
        }
        for mark in row {
            match mark {
                0 => up.push(false),
                1 => up.push(true),
                other => {
                    let row = pick + 1;
                    return Err(format!("row {row} holds {other}: 1 is warp over weft, 0 is weft over warp"));
                }
            }
        }
    }
    let picks = rows.len();
    let drawn = Drawn { ends, picks, up, end_colours: vec![1; ends], pick_colours: vec![1; picks] };
    let up = drawn.interlaced().map_err(|error| error.to_string())?.up;
    Ok(Draft {
        name: object.name.to_string(),
        ends: ends as u32,
        picks: picks as u32,
        up,
        end_colours: repeated(counts_of(object, "end_colours")?, ends)?,
        pick_colours: repeated(counts_of(object, "pick_colours")?, picks)?,
    })
}

/// A list repeated to a length.
fn repeated(list: Vec<usize>, length: usize) -> Result<Vec<u32>, String> {
    if list.is_empty() {
        return Err("a list of colours needs at least one colour".to_owned());
    }
    Ok((0..length).map(|i| list[i % list.len()] as u32).collect())
}

fn singles(list: Vec<usize>) -> Vec<Vec<usize>> {
    list.into_iter().map(|one| vec![one]).collect()
}

fn largest<'a>(lists: impl Iterator<Item = &'a Vec<usize>>) -> usize {
    lists.flatten().copied().max().unwrap_or(0)
}

fn value<'a>(object: &'a Object, name: &str) -> Result<&'a Value, String> {
    object.fields.get(name).map(|slot| &slot.value).ok_or_else(|| format!("`{name}` is not given"))
}

fn number(value: &Value) -> Result<usize, String> {
    match value {
        Value::Number(number) => {
            let count = number.as_count().and_then(|count| usize::try_from(count).ok()).filter(|n| *n <= 1_000_000);
            count.ok_or_else(|| format!("{} is no count of threads", number.si))
        }
        _ => Err("a whole number is needed".to_owned()),
    }
}

fn numbers(value: &Value) -> Result<Vec<usize>, String> {
    match value {
        Value::List(list) => list.iter().map(number).collect(),
        _ => Err("a list of whole numbers is needed".to_owned()),
    }
}

fn count_of(object: &Object, name: &str) -> Result<usize, String> {
    number(value(object, name)?)
}

fn counts_of(object: &Object, name: &str) -> Result<Vec<usize>, String> {
    numbers(value(object, name)?)
}

fn rows_of(object: &Object, name: &str) -> Result<Vec<Vec<usize>>, String> {
    match value(object, name)? {
        Value::List(rows) => rows.iter().map(numbers).collect(),
        _ => Err("a list of rows is needed".to_owned()),
    }
}
