"""Command line: `python -m motorcade_training make-data|train|evaluate|export scene|vehicle`."""

import argparse
import importlib
import importlib.util
import sys

from motorcade_training.common.stage import STAGES, Stage

NETWORKS = ("scene", "vehicle", "presence")


def stages_of(network: str) -> dict[str, Stage]:
    """The stages that `motorcade_training.<network>.cli` defines; none without that package."""
    if importlib.util.find_spec(f"motorcade_training.{network}") is None:
        return {}
    return importlib.import_module(f"motorcade_training.{network}.cli").STAGES


def parser() -> argparse.ArgumentParser:
    """The argument parser with a subcommand per stage and network."""
    root = argparse.ArgumentParser(prog="motorcade_training", description=__doc__)
    by_stage = root.add_subparsers(dest="stage", required=True, metavar="STAGE")
    networks = {name: stages_of(name) for name in NETWORKS}
    for stage, text in STAGES.items():
        of_stage = by_stage.add_parser(stage, help=text, description=text)
        by_network = of_stage.add_subparsers(dest="network", required=True, metavar="NETWORK")
        for name, stages in networks.items():
            if stage in stages:
                part = stages[stage]
                sub = by_network.add_parser(
                    name,
                    help=part.help,
                    description=part.help,
                    formatter_class=argparse.ArgumentDefaultsHelpFormatter,
                )
                part.add_arguments(sub)
                sub.set_defaults(run=part.run)
    return root


def main(arguments: list[str] | None = None) -> int:
    """Exit status: 0 fine, 1 wrong arguments or input."""
    options = parser().parse_args(arguments)
    try:
        options.run(options)
    except (OSError, ValueError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
