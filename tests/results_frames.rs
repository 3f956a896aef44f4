//! Frames read back from their bytes, as a reader of the VTK file format would.

use ripstop::results::folder::Folder;
use ripstop::results::pvd::Collection;
use ripstop::results::vtu::{Array, Grid, POLY_LINE, TRIANGLE, Values};

/// A fresh folder under the test's own temporary place.
fn fresh(name: &str) -> Folder {
    let root = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&root);
    Folder::open(root).expect("the temporary folder takes files")
}

/// An attribute of the first tag that holds `mark`.
fn attribute<'a>(xml: &'a str, mark: &str, name: &str) -> &'a str {
    let tag = xml.split('<').find(|tag| tag.contains(mark)).unwrap_or_else(|| panic!("no tag with {mark}"));
    let from = tag.find(&format!("{name}=\"")).unwrap_or_else(|| panic!("no {name} in <{tag}")) + name.len() + 2;
    &tag[from..from + tag[from..].find('"').expect("closed")]
}

/// The bytes of a named array.
fn array<'a>(file: &'a [u8], name: &str) -> &'a [u8] {
    let mark = b"<AppendedData encoding=\"raw\">\n_";
    let at = file.windows(mark.len()).position(|w| w == mark).expect("appended data");
    let xml = std::str::from_utf8(&file[..at]).expect("the head is text");
    let offset: usize = attribute(xml, &format!("Name=\"{name}\""), "offset").parse().expect("an offset");
    let data = &file[at + mark.len()..];
    let length = u64::from_le_bytes(data[offset..offset + 8].try_into().expect("8 bytes")) as usize;
    &data[offset + 8..offset + 8 + length]
}

fn f64s(bytes: &[u8]) -> Vec<f64> {
    bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().expect("8 bytes"))).collect()
}

fn i64s(bytes: &[u8]) -> Vec<i64> {
    bytes.chunks_exact(8).map(|b| i64::from_le_bytes(b.try_into().expect("8 bytes"))).collect()
}

#[test]
fn a_grid_reads_back_as_it_was_written() {
    let mut grid =
        Grid { points: vec![0.0, 1e-300, -2.5, 1.0, 1.0, 1.0, 3.0, 0.1, 0.2], time: 1.5e-6, ..Grid::default() };
    grid.cell(POLY_LINE, [0, 1]);
    grid.cell(TRIANGLE, [2, 1, 0]);
    grid.point_data.push(Array::new("velocity <m/s>", 3, Values::F64((0..9).map(f64::from).collect())));
    grid.point_data.push(Array::new("strain", 1, Values::F32(vec![0.1, 0.2, 0.3])));
    grid.cell_data.push(Array::new("yarn", 1, Values::I32(vec![7, -1])));
    let file = grid.clone().to_bytes();
    let head = String::from_utf8_lossy(&file);
    assert_eq!(attribute(&head, "VTKFile type", "header_type"), "UInt64");
    assert_eq!(attribute(&head, "VTKFile type", "byte_order"), "LittleEndian");
    assert_eq!(attribute(&head, "Piece ", "NumberOfPoints"), "3");
    assert_eq!(attribute(&head, "Piece ", "NumberOfCells"), "2");
    assert_eq!(f64s(array(&file, "Points")), grid.points);
    assert_eq!(f64s(array(&file, "TimeValue")), [1.5e-6]);
    assert_eq!(i64s(array(&file, "connectivity")), [0, 1, 2, 1, 0]);
    assert_eq!(i64s(array(&file, "offsets")), [2, 5]);
    assert_eq!(array(&file, "types"), [4, 5]);
    assert_eq!(f64s(array(&file, "velocity &lt;m/s&gt;")), (0..9).map(f64::from).collect::<Vec<_>>());
    assert_eq!(array(&file, "strain").len(), 12);
    assert_eq!(array(&file, "yarn"), [7, 0, 0, 0, 255, 255, 255, 255]);
}

#[test]
fn a_collection_lists_every_frame_with_its_time() {
    let folder = fresh("collection");
    let mut list = Collection::default();
    for k in 0..3 {
        list.add(1e-6 * f64::from(k), 0, "ply & bullet", &format!("frames/ply_{k:04}.vtu"));
        list.write(&folder, "frames.pvd").expect("written");
        let text = std::fs::read_to_string(folder.path("frames.pvd")).expect("there after every frame");
        assert_eq!(text.matches("<DataSet ").count(), k as usize + 1);
        assert!(text.trim_end().ends_with("</VTKFile>"));
        assert!(text.contains(&format!("timestep=\"{:?}\"", 1e-6 * f64::from(k))));
        assert!(text.contains("ply &amp; bullet"));
    }
    assert!(!folder.path("frames.pvd.partial").exists());
}

#[test]
fn a_full_disk_is_named_with_the_path() {
    let folder = fresh("full_disk");
    std::os::unix::fs::symlink("/dev/full", folder.path("a.vtu.partial")).expect("a link");
    let error = folder.write("a.vtu", &[0; 4096]).expect_err("the device is full");
    assert_eq!(error.code.0, "E0952");
    assert!(error.message.contains("a.vtu") && error.message.contains("full"), "{}", error.message);
    assert!(!folder.path("a.vtu").exists());

    std::os::unix::fs::symlink("/dev/full", folder.path("probes.csv")).expect("a link");
    let mut lines = folder.lines("probes.csv").expect("opens");
    lines.add("1,2,3").expect("still in memory");
    let error = lines.flush().expect_err("the device is full");
    assert_eq!(error.code.0, "E0952");
    assert!(error.message.contains("probes.csv"), "{}", error.message);
}

#[test]
fn a_folder_that_cannot_be_made_or_a_name_that_is_taken_says_so() {
    let folder = fresh("taken");
    folder.write("file", b"text").expect("written");
    let error = Folder::open(folder.path("file/out")).expect_err("a file is in the way");
    assert_eq!(error.code.0, "E0950");
    assert!(error.message.contains("file/out"), "{}", error.message);
    std::fs::create_dir(folder.path("summary.json")).expect("a folder in the way");
    let error = folder.write("summary.json", b"{}").expect_err("a folder is in the way");
    assert_eq!(error.code.0, "E0951");
    assert!(!folder.path("summary.json.partial").exists());
}
