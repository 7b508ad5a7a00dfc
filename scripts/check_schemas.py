#!/usr/bin/env python3
"""Checks the JSON files of runs against docs/schemas. Called by check_clients.sh.

    scripts/check_schemas.py RUN... [--evaluation FILE] [--online LINES...]
"""
import argparse
import json
import pathlib
import sys

import jsonschema

SCHEMAS = pathlib.Path(__file__).resolve().parent.parent / "docs/schemas"
parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("runs", nargs="+", type=pathlib.Path)
parser.add_argument("--evaluation", type=pathlib.Path)
parser.add_argument("--online", nargs="+", default=[], type=pathlib.Path)
options = parser.parse_args()
checked = 0


def check(name, text, place):
    """Stops with the first errors of a document."""
    global checked
    schema = json.loads((SCHEMAS / f"{name}.schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    errors = list(jsonschema.Draft202012Validator(schema).iter_errors(json.loads(text)))
    for error in errors[:5]:
        print(f"{place}: /{'/'.join(map(str, error.absolute_path))}: {error.message[:300]}")
    if errors:
        sys.exit(1)
    checked += 1


for run in options.runs:
    check("run", (run / "run.json").read_text(), run / "run.json")
    if (run / "graph.json").exists():
        check("graph", (run / "graph.json").read_text(), run / "graph.json")
if options.evaluation:
    check("evaluation", options.evaluation.read_text(), options.evaluation)
revisions, moved = {"by a map": 0, "by a place seen again": 0}, 0
for file in options.online:
    lines = file.read_text().splitlines()
    assert lines, f"{file} is empty"
    for number, line in enumerate(lines, 1):
        check("online", line, f"{file}:{number}")
        entry = json.loads(line)
        if "revision" in entry:
            # A sum of kinds fits where any does: a correction has to fit as one.
            assert "status" not in entry and "keyframes" in entry, f"{file}:{number}"
            moved += len(entry["keyframes"])
            revisions["by a map" if "map" in entry else "by a place seen again"] += 1
if options.online:
    print("corrections of online runs: " + ", ".join(f"{count} {kind}" for kind, count in revisions.items()))
    # The first one by a map may move none: the drive may begin where the map did.
    assert all(revisions.values()) and moved, (revisions, moved)
print(f"{checked} JSON documents fit docs/schemas")
