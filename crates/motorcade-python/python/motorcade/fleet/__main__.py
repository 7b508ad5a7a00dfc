"""python -m motorcade.fleet MANIFEST --out PLACE: what `ray job submit` starts."""

import argparse
import sys
from typing import Any

from .. import Error
from . import run


def main() -> int:
    """Exit codes as those of `motorcade batch`: 0 all drives are done, 4 some are not, 3 the manifest does not read."""
    parser = argparse.ArgumentParser(prog="python -m motorcade.fleet", description="Many drives on a Ray cluster.")
    parser.add_argument("manifest", help=".csv, .jsonl or .parquet, local or at a URL")
    parser.add_argument("--out", required=True, help="folder of the results, local or at a URL")
    parser.add_argument("--address", help="of the cluster; by default that of the environment")
    parser.add_argument("--cpus", type=float, default=1.0, help="cores a drive")
    parser.add_argument("--memory-mb", type=float, help="memory a drive")
    parser.add_argument("--retries", type=int, default=3, help="further attempts of a drive whose worker died")
    parser.add_argument("--calibration", help="for rows without one")
    parser.add_argument("--height", help="for rows without one, in metres, or auto")
    arguments = vars(parser.parse_args())

    def progress(done: int, total: int, line: dict[str, Any]) -> None:
        print(f"{done}/{total} {line['id']}: {line['status']} {line.get('message') or ''}".rstrip(), file=sys.stderr)

    try:
        lines = run(arguments.pop("manifest"), arguments.pop("out"), progress=progress, **arguments)
    except Error as error:
        print(f"error: {error}", file=sys.stderr)
        return 3
    failed = [line for line in lines if line["status"] != "done"]
    print(f"{len(lines) - len(failed)} of {len(lines)} drives done")
    return 4 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
