#!/usr/bin/env python3
"""Checks that every dependency has a licence that deny.toml allows, and comes from crates.io.

Reads `cargo metadata`; a stand-in for `cargo deny check licenses sources` where cargo-deny is not installed.
"""
import json
import pathlib
import re
import subprocess
import sys
import tomllib

root = pathlib.Path(__file__).resolve().parent.parent
allowed = set(tomllib.loads((root / "deny.toml").read_text())["licenses"]["allow"])
metadata = json.loads(subprocess.check_output(["cargo", "metadata", "--format-version", "1", "--locked"], cwd=root))


def acceptable(expression):
    """SPDX expression with OR / AND / parentheses (old style: /)."""
    expression = expression.replace("/", " OR ")
    tokens = re.findall(r"\(|\)|[^\s()]+(?:\s+WITH\s+[^\s()]+)?", expression)
    python = " ".join(
        {"OR": "or", "AND": "and", "(": "(", ")": ")"}.get(token, str(token in allowed)) for token in tokens
    )
    return bool(eval(python, {"__builtins__": {}}))


problems = []
for package in metadata["packages"]:
    name = f"{package['name']} {package['version']}"
    licence = package.get("license")
    if package["source"] is None:
        continue
    if not licence:
        if not package.get("license_file"):
            problems.append(f"{name}: no licence")
    elif not acceptable(licence):
        problems.append(f"{name}: {licence}")
    if package["source"].startswith("git+"):
        problems.append(f"{name}: from {package['source']}")
print(f"{len(metadata['packages'])} packages, {len(problems)} problems")
sys.exit("\n".join(problems) if problems else 0)
