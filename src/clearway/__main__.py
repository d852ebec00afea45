"""`clearway`, the installed script, and `python -m clearway`."""

import sys


def main() -> None:
    """The command line; Ctrl-C while it is still being loaded ends it as it does later."""
    try:
        from clearway.cli.app import main as run

        run()
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(130)  # `INTERRUPTED` of what may not be loaded yet.


if __name__ == "__main__":
    main()
