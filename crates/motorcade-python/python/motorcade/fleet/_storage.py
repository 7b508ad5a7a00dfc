"""Files at any place that fsspec knows."""

from __future__ import annotations

import json
import os
import uuid
from typing import Any

import fsspec
from fsspec.implementations.local import LocalFileSystem


class Place:
    """A folder, local or at a URL. Every file appears whole or not at all."""

    def __init__(self, url: str) -> None:
        self.fs, self.root = fsspec.core.url_to_fs(url)
        self.local = isinstance(self.fs, LocalFileSystem)

    def path(self, name: str) -> str:
        """Full name of a file in it."""
        return f"{self.root.rstrip('/')}/{name}"

    def put(self, local: str, name: str) -> None:
        """Copies a file into it; one of that name is replaced."""
        target = self.path(name)
        self.fs.makedirs(target.rsplit("/", 1)[0], exist_ok=True)
        if not self.local:
            # Object stores show an object when it is complete.
            self.fs.put_file(local, target)
            return
        # A worker that is killed here leaves a name that nothing reads.
        staged = f"{target}.{uuid.uuid4().hex}.part"
        self.fs.put_file(local, staged)
        os.replace(staged, target)

    def put_folder(self, local: str, name: str, last: str) -> None:
        """Copies all files of a folder, the one named `last` at the end."""
        files = [os.path.relpath(os.path.join(at, file), local) for at, _, names in os.walk(local) for file in names]
        for file in sorted(files, key=lambda file: (file == last, file)):
            self.put(os.path.join(local, file), f"{name}/{file.replace(os.sep, '/')}")

    def put_json(self, value: Any, name: str, folder: str) -> None:
        """Writes a value; `folder` is a local place for it on its way."""
        local = os.path.join(folder, f"{uuid.uuid4().hex}.json")
        with open(local, "w", encoding="utf-8") as file:
            json.dump(value, file)
        self.put(local, name)

    def exists(self, name: str) -> bool:
        """True when it has a file of this name."""
        return bool(self.fs.exists(self.path(name)))

    def get_json(self, name: str) -> Any | None:
        """A value that was written; None where there is none that reads."""
        try:
            return json.loads(self.fs.cat_file(self.path(name)))
        except (OSError, ValueError):
            return None


def staged(path: str, folder: str) -> str:
    """A local copy of a file or folder at a URL, in `folder`; a local path as it is."""
    if "://" not in path:
        return path
    fs, remote = fsspec.core.url_to_fs(path)
    target = os.path.join(folder, uuid.uuid4().hex, remote.rstrip("/").rsplit("/", 1)[-1])
    os.makedirs(os.path.dirname(target))
    if fs.isfile(remote):
        fs.get_file(remote, target)
    else:
        # The slash makes fsspec copy what is in the folder.
        fs.get(remote.rstrip("/") + "/", target + "/", recursive=True)
    return target
