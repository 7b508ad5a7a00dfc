#!/usr/bin/env python3
"""Stops where a file of the workspace writes or moves files by itself. Results have two writers: `atomic_file.rs` for single files and `output/directory.rs`
for directories, which leave no half of one and replace nothing but files. Called by .ci/run; tests are not looked at.

    scripts/one_writer.py
"""
import pathlib
import re
import sys

root = pathlib.Path(__file__).resolve().parent.parent
WRITES = re.compile(r"\b(fs::write|fs::copy|fs::rename|File::create(_new)?|File::options|OpenOptions::new|NamedTempFile::new|\.persist(_noclobber)?)\(")
# Files that may, in how many lines, and why.
ALLOWED = {
    "motorcade-dataset/src/atomic_file.rs": (3, "the writer of single files"),
    "motorcade/src/output/directory.rs": (7, "the writer of directories"),
    "motorcade/src/output/mod.rs": (1, "into the staged directory"),
    "motorcade-cli/src/draw/target.rs": (1, "into the staged directory"),
    "motorcade-cli/src/draw/recording.rs": (1, "into the file that PendingFile staged"),
    "motorcade-cli/src/growing_tracks.rs": (3, "grows while an online run goes on; no result, and what an earlier run left is put aside"),
    "motorcade-cli/src/export.rs": (1, "into the staged directory"),
    "motorcade-tables/src/dataset.rs": (1, "into the staged directory"),
    "motorcade-simulate/src/output/kitti.rs": (6, "into the staged directory"),
    "motorcade-simulate/src/training/mod.rs": (1, "into the staged directory"),
    "motorcade-simulate/src/training/npy.rs": (1, "into the staged directory"),
    "motorcade-graph/src/g2o/write.rs": (1, "a library of its own below motorcade-dataset; the program writes its text by OutFile"),
    "motorcade-perception/src/files/checkpoint.rs": (2, "grows while a run goes on; no result"),
    "motorcade/src/state/folder.rs": (2, "the state beside the checkpoint, written beside and renamed; no result"),
    "motorcade/src/archive/mod.rs": (2, "temporary files of a run"),
    "motorcade-fleet/src/state.rs": (1, "a line is added for each attempt"),
    "motorcade-fleet/src/log.rs": (1, "what a process says"),
}


def program(text):
    """The text without comments and without what is compiled for tests alone."""
    lines, depth = [], None
    for line in text.splitlines():
        if depth is None and re.match(r"\s*#\[cfg\((all\()?test\b", line):
            depth = 0
        if depth is None:
            lines.append(re.sub(r"//.*", "", line))
            continue
        depth += line.count("{") - line.count("}")
        if depth <= 0 and ("}" in line or line.rstrip().endswith(";")):
            depth = None
    return lines


found, failures = {}, []
for path in sorted((root / "crates").glob("*/src/**/*.rs")):
    name = path.relative_to(root / "crates").as_posix()
    if path.stem == "tests" or path.stem.endswith("_tests") or "/motorcade-testing/" in f"/{name}":
        continue
    lines = [line.strip() for line in program(path.read_text()) if WRITES.search(line)]
    if lines:
        found[name] = lines
for name in sorted(found.keys() | ALLOWED.keys()):
    lines, (allowed, _) = found.get(name, []), ALLOWED.get(name, (0, ""))
    if len(lines) != allowed:
        failures.append(f"{name}: {len(lines)} lines, {allowed} in the list" + "".join(f"\n    {line}" for line in lines))
if failures:
    sys.exit("files are written by atomic_file.rs or OutputDirectory; otherwise give a reason in scripts/one_writer.py:\n" + "\n".join(failures))
print(f"{len(found)} files write by themselves, each with a reason")
