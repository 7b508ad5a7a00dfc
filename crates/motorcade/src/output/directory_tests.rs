use super::*;

/// A directory of results with these files, whose content is `content`.
fn write(at: &Path, force: bool, names: &[&str], content: &str) -> Result<()> {
    let directory = OutputDirectory::open(at, RUN_RECORD, force)?;
    fill(&directory, names, content)
}

fn fill(directory: &OutputDirectory, names: &[&str], content: &str) -> Result<()> {
    let fill = |folder: &Path| {
        names.iter().for_each(|name| put(folder, name, content));
        Ok(())
    };
    directory.write(fill, |files, ()| serde_json::json!({"files": files, "content": content}))
}

fn put(folder: &Path, name: &str, content: &str) {
    fs::create_dir_all(parent(&folder.join(name))).unwrap();
    fs::write(folder.join(name), content).unwrap();
}

/// Every file below a folder with its content.
fn all(folder: &Path) -> Vec<(String, String)> {
    let files = listing::files(folder).unwrap();
    files.into_iter().map(|f| (f.name.clone(), fs::read_to_string(folder.join(f.name)).unwrap())).collect()
}

/// The directory that an error says the results lie in.
fn kept(error: &Error) -> PathBuf {
    let text = error.to_string();
    let (_, path) = text.split_once("the results lie in ").unwrap();
    PathBuf::from(path)
}

#[test]
fn a_move_that_fails_half_way_puts_the_earlier_result_back() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path().join("run");
    write(&at, false, &["a.txt", "vehicles/1.tum", "y.txt"], "old").unwrap();
    let before = all(&at);
    // A folder that belongs to the file system and is no result. After `a.txt`, and before `run.json` and `z.txt`, it stands in the way of a file.
    fs::create_dir(at.join("lost+found")).unwrap();
    let error = write(&at, true, &["a.txt", "lost+found", "vehicles/2.tum", "z.txt"], "new").unwrap_err();
    assert!(error.to_string().contains("lost+found is in the way"), "{error}");
    let kept = kept(&error);
    let new = all(&kept);
    let names: Vec<&str> = new.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["a.txt", "lost+found", RUN_RECORD, "vehicles/2.tum", "z.txt"]);
    assert!(new.iter().all(|(name, content)| name == RUN_RECORD || content == "new"), "{new:?}");
    // Nothing of the new result is left where the old one is, once the kept one is taken away.
    fs::rename(&kept, folder.path().join("kept")).unwrap();
    assert_eq!(all(&at), before);
    fs::remove_dir(at.join("lost+found")).unwrap();
    write(&at, true, &["a.txt"], "newer").unwrap();
    assert_eq!(fs::read_to_string(at.join("a.txt")).unwrap(), "newer");
}

/// A process that ends between two moves leaves no record beside files of which some are not there.
#[test]
fn the_record_goes_first_and_comes_last() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path().join("run");
    // Names before and after the record's in the alphabet.
    let names = ["a.txt", "vehicles/1.tum", "z.txt"];
    write(&at, false, &names, "old").unwrap();
    let directory = OutputDirectory::open(&at, RUN_RECORD, true).unwrap();
    let (new, old) = (folder.path().join("new"), folder.path().join("old"));
    for name in names.iter().chain(&[RUN_RECORD]) {
        put(&new, name, "new");
        put(&old, name, "in the way of whatever is moved first");
    }
    let first = directory.moved(&new, &old).unwrap_err();
    assert_eq!(first, format!("{RUN_RECORD} is in the way"));
    assert!(all(&at).iter().any(|(name, _)| name == RUN_RECORD));

    let mut moves = Moves::default();
    let empty = OutputDirectory::open(&folder.path().join("empty"), RUN_RECORD, false).unwrap();
    empty.move_all(&mut moves, &[], &new, &old).unwrap();
    let order: Vec<_> = moves.0.iter().map(|(_, to)| to.strip_prefix(&empty.path).unwrap()).collect();
    assert_eq!(order, ["a.txt", "vehicles/1.tum", "z.txt", RUN_RECORD].map(Path::new));
}

#[test]
fn a_place_that_was_taken_in_the_meantime_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path().join("run");
    let directory = OutputDirectory::open(&at, RUN_RECORD, false).unwrap();
    put(&at, "mine.txt", "mine");
    let error = fill(&directory, &["a.txt"], "new").unwrap_err();
    assert!(error.to_string().contains("in the meantime"), "{error}");
    let kept = kept(&error);
    assert_eq!(fs::read_to_string(kept.join("a.txt")).unwrap(), "new");
    assert!(kept.join(RUN_RECORD).exists());
    assert_eq!(fs::read_to_string(at.join("mine.txt")).unwrap(), "mine");
    assert!(!at.join("a.txt").exists() && !at.join(RUN_RECORD).exists());
    // Another run cleans up what was left behind, and not this.
    write(&folder.path().join("other"), false, &["b.txt"], "b").unwrap();
    assert!(kept.join("a.txt").exists());
}
