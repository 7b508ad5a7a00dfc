#!/usr/bin/env python3
"""Finds circles between the modules of a crate.

    scripts/module_cycles.py [CRATE_FOLDER...]

Reads `crate::`, `super::` and `self::` paths of every source file, in `use` declarations and in code; without folders, of all
crates below `crates`. A name that a module re-exports counts as a use of the module that it comes from. A module and its
submodules are one unit towards other modules, and so are a module's own items towards its submodules; tests do not count. Prints
every circle with one use for each of its arrows, and exits 1 when there is one.
"""
import pathlib
import re
import sys

COMMENT_OR_STRING = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:[^"\\]|\\.)*"', re.DOTALL)
USE = re.compile(r"(?:^|\n)\s*(?:pub(?:\([^)]*\))?\s+)?use\s+([^;]+);")
PATH = re.compile(r"\b(?:crate|super|self)(?:::\w+)+")
TESTS = re.compile(r"#\[cfg\(test\)\]\s*(?:pub(?:\([^)]*\))?\s+)?mod\s+\w+\s*\{")


def modules(source):
    """Module path (tuple of names) of each file below a crate's `src`, tests left out."""
    out = {}
    for file in sorted(source.rglob("*.rs")):
        parts = list(file.relative_to(source).with_suffix("").parts)
        if "tests" in parts or parts[0] == "bin":
            continue
        if parts[-1] in ("mod", "lib", "main"):
            parts.pop()
        out[tuple(parts)] = file
    return out


def code_of(file):
    """Text of a file without comments, strings and its test module."""
    text = COMMENT_OR_STRING.sub(lambda m: '""' if m[0].startswith('"') else " ", file.read_text())
    tests = TESTS.search(text)
    return text[: tests.start()] if tests else text


def expand(tree):
    """Paths of a use tree, as (path, name it is bound to): `a::{b, c::d as e}` has `a::b` and `a::c::d`."""
    tree = tree.strip()
    if "{" not in tree:
        path, _, alias = tree.partition(" as ")
        parts = [p.strip() for p in path.split("::") if p.strip()]
        yield parts, alias.strip() or (parts[-1] if parts else "")
        return
    start, rest = tree.index("{"), tree[tree.index("{") + 1 : tree.rindex("}")]
    prefix = [p.strip() for p in tree[:start].split("::") if p.strip()]
    depth, item = 0, ""
    for letter in rest + ",":
        depth += {"{": 1, "}": -1}.get(letter, 0)
        if letter == "," and depth == 0:
            if item.strip():
                for parts, name in expand(item):
                    yield prefix + [p for p in parts if p != "self" or not prefix], name if parts != ["self"] else prefix[-1]
            item = ""
        else:
            item += letter


def absolute(parts, module, known):
    """Path from the crate's root, or None for another crate's."""
    if parts[0] == "crate":
        return tuple(parts[1:])
    at, rest = list(module), list(parts)
    if rest[0] == "self":
        return tuple(at + rest[1:])
    if rest[0] == "super":
        while rest and rest[0] == "super":
            if not at:
                return None
            at.pop()
            rest.pop(0)
        return tuple(at + rest)
    return tuple(at + rest) if tuple(at + rest[:1]) in known else None


class Crate:
    def __init__(self, source):
        self.files = modules(source)
        self.code = {module: code_of(file) for module, file in self.files.items()}
        self.bound = {module: {} for module in self.files}
        for module, code in self.code.items():
            for tree in USE.findall(code):
                for parts, name in expand(tree):
                    target = absolute(parts, module, self.files) if parts else None
                    if target is not None:
                        self.bound[module][name] = target

    def module_of(self, path, depth=0):
        """Module that an item's path leads to, through re-exports."""
        module = ()
        for index, name in enumerate(path):
            if (*module, name) in self.files:
                module = (*module, name)
                continue
            target = self.bound.get(module, {}).get(name)
            if target is not None and target != path and depth < 8:
                return self.module_of((*target, *path[index + 1 :]), depth + 1)
            break
        return module

    def uses(self):
        """(module, used module, path as written)."""
        for module, code in self.code.items():
            written = [parts for tree in USE.findall(code) for parts, _ in expand(tree) if parts]
            written += [m.split("::") for m in PATH.findall(USE.sub("\n", code))]
            for parts in written:
                path = absolute(parts, module, self.files)
                if path is not None:
                    yield module, self.module_of(path), "::".join(parts)

    def graph(self):
        """Arrows between submodules of one module: {(from, to): (file, path as written)}."""
        arrows = {}
        for module, used, written in self.uses():
            common = 0
            while common < min(len(module), len(used)) and module[common] == used[common]:
                common += 1
            if common < len(module) and common < len(used):
                arrow = module[: common + 1], used[: common + 1]
                arrows.setdefault(arrow, (self.files[module], written))
        return arrows


def circles(arrows):
    """One shortest circle through every group of modules that reach each other."""
    after = {}
    for start, end in arrows:
        after.setdefault(start, []).append(end)
    seen = set()
    for start in sorted(after):
        if start in seen:
            continue
        ways, queue = {start: None}, [start]
        while queue:
            at = queue.pop(0)
            if start in after.get(at, []):
                way = [start]
                while at != start:
                    way.insert(1, at)
                    at = ways[at]
                seen.update(way)
                yield way
                break
            for step in sorted(after.get(at, [])):
                if step not in ways:
                    ways[step] = at
                    queue.append(step)


def main(folders):
    root = pathlib.Path(__file__).resolve().parent.parent
    found = 0
    for folder in folders or sorted(p.parent for p in (root / "crates").glob("*/Cargo.toml")):
        arrows = Crate(pathlib.Path(folder) / "src").graph()
        for way in circles(arrows):
            found += 1
            print(f"{pathlib.Path(folder).name}: " + " -> ".join("::".join(m) for m in [*way, way[0]]))
            for pair in zip(way, [*way[1:], way[0]]):
                file, written = arrows[pair]
                print(f"    {file.relative_to(folder)}: {written}")
    print(f"{found} circles")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
